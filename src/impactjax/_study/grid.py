"""Grids."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from impactjax._study.design import AbstractDesign, Points
from impactjax._types import Numbers


class Grid(AbstractDesign):
    """All combinations of some values of each parameter: `Grid(gamma=[0.1, 0.2], omega0=[600])`.

    **Arguments:**

    - `axes`: the values of each parameter, by its name.

    **Raises** `ValueError` without a parameter, or for values that are not a list of numbers.
    """

    axes: Mapping[str, Float[np.ndarray, " values"]]

    def __init__(self, **axes: Numbers) -> None:
        if not axes:
            raise ValueError("A grid needs at least one parameter: `Grid(gamma=[0.1, 0.2])`.")
        self.axes = {name: _values(name, given) for name, given in axes.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.axes)

    @property
    def dimensions(self) -> Mapping[str, int]:
        """One axis for each parameter."""
        return {name: values.size for name, values in self.axes.items()}

    def points(self) -> Points:
        """All combinations; the last parameter varies fastest."""
        mesh = np.meshgrid(*self.axes.values(), indexing="ij")
        return np.stack([each.ravel() for each in mesh], axis=1)


def _values(name: str, given: Numbers) -> Float[np.ndarray, " values"]:
    values = np.asarray(given)
    if values.ndim != 1 or not values.size or values.dtype.kind not in "iuf":
        raise ValueError(f"Argument `{name}` must be a list of at least one number.")
    if not np.isfinite(values).all():
        raise ValueError(f"Argument `{name}` must be a list of finite numbers.")
    return values.astype(float)
