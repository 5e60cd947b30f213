"""Designs: the points at which a study evaluates its function."""

import abc
import hashlib
from collections.abc import Mapping
from typing import TypeAlias

import equinox as eqx
import numpy as np
from jaxtyping import Float

LANE = "lane"  # axis of samples, and the number of a lane

Points: TypeAlias = Float[np.ndarray, "lanes parameters"]


class AbstractDesign(eqx.Module):
    """The points of a study, one for each lane: values of its parameters.

    A design of your own is a subclass with these three attributes.
    """

    @property
    @abc.abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""

    @property
    @abc.abstractmethod
    def dimensions(self) -> Mapping[str, int]:
        """Names and lengths of the axes on which the lanes lie, the last one fastest. A parameter
        with an axis of its own name varies along that axis only.
        """

    @abc.abstractmethod
    def points(self) -> Points:
        """Values of the parameters in each lane."""


def checked_points(design: AbstractDesign) -> Points:
    """The points of a design. Raises `ValueError` if they do not match its own description."""
    points, names = np.asarray(design.points(), float), design.names
    lanes = int(np.prod([*design.dimensions.values()], dtype=int))
    if points.shape != (lanes, len(names)) or not points.size:
        raise ValueError(
            f"Argument `design` must have at least one lane and one parameter, and points of shape "
            f"(lanes, parameters), which are {(lanes, len(names))} for its dimensions and names, "
            f"but {points.shape} for its points."
        )
    if not np.isfinite(points).all():
        raise ValueError("Argument `design` must have points that are finite.")
    if LANE in names:
        raise ValueError(f"A parameter cannot be called `{LANE}`, which numbers the lanes.")
    for name, column in zip(names, points.T, strict=True):
        if name in design.dimensions and not _varies_along(name, column, design.dimensions):
            raise ValueError(
                f"Parameter `{name}` has the name of an axis of the design, along which alone it "
                "would have to vary: give it another name."
            )
    return points


def _varies_along(
    axis: str, values: Float[np.ndarray, " lanes"], dimensions: Mapping[str, int]
) -> bool:
    """True if values vary along no other axis than a named one."""
    along = np.moveaxis(values.reshape(*dimensions.values()), [*dimensions].index(axis), 0)
    rows = along.reshape(len(along), -1)
    return bool(np.all(rows == rows[:, :1]))


def digest_of(design: AbstractDesign, points: Points) -> str:
    """A digest of names, axes and points of a design, the same for equal points."""
    axes = [*design.dimensions.items()]
    digest = hashlib.sha256(repr((type(design).__name__, design.names, axes)).encode())
    digest.update(points.tobytes())
    return digest.hexdigest()
