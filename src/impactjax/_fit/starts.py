"""Starting points of the searches."""

import math

import equinox as eqx
import numpy as np
from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._parameter import Range, plain
from impactjax._problem.abstract_problem import AbstractProblem
from impactjax._problem.parameters import Handle
from impactjax._shown import with_numbers

_FADING_SPREAD, _CONTACT_SPREAD, _OTHER_SPREAD = 1.5, 1.0, 0.02
_INSIDE = 0.02  # share of a range kept from its ends, where a law is a special one: r = 0, r = 1


class Starts(eqx.Module):
    """Starting points of searches: the model's own values, and values scattered around them.

    Parameters of the contact laws, whose first estimates are the least certain, are multiplied by
    random factors from 1/e to e, the cutoff of a low-pass by factors from 0.22 to 4.5, the others
    by factors within 2 % of 1.

    **Arguments:**

    - `count`: number of searches; the first one starts at the model's own values.
    - `seed`: random seed of the scatter.
    """

    count: int = eqx.field(default=16, static=True)
    seed: int = eqx.field(default=0, static=True)

    def __check_init__(self) -> None:
        if self.count < 1:
            raise ValueError(f"Argument `count` must be at least 1, but it is {self.count}.")

    def lanes(self, problem: AbstractProblem) -> Float[AnyArray, "lanes parameters"]:
        """The starts in the coordinates of a search."""
        random, columns = np.random.default_rng(self.seed), []
        begin = zip(problem.handles().values(), problem.starting_values(), strict=True)
        for handle, start in begin:
            value, spread = plain(start), _spread(handle)
            scatter = random.uniform(-spread, spread, self.count - 1).astype(value.dtype)
            columns.append(_within(handle.allowed, value, np.exp(scatter)))
        return problem.coordinates(namespace(*columns).stack(columns, axis=1))

    __repr__ = with_numbers


def _spread(handle: Handle) -> float:
    """The largest change of the logarithm of a parameter."""
    if handle.allowed.fades:
        return _FADING_SPREAD
    return _CONTACT_SPREAD if "law" in handle.path else _OTHER_SPREAD


def _within(
    allowed: Range, value: Float[AnyArray, ""], factors: np.ndarray
) -> Float[AnyArray, " lanes"]:
    """A value, and its products with some factors, clipped to its range."""
    xp, low, high = namespace(value), allowed.low, allowed.high
    ended = math.isfinite(high - low) and not allowed.fades
    inside = _INSIDE * (high - low) if ended else 0.0
    others = xp.clip(value * factors, low + inside, high - inside)
    return xp.concatenate([xp.clip(value, low, high)[None], others])
