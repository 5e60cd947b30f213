"""A profile as a curve, and how one is made of the points along it."""

import dataclasses

import numpy as np
from jaxtyping import Float

from impactjax._fit.straight import Straight
from impactjax._identify.curves import Knots, Span
from impactjax._identify.profile_axis import Axis
from impactjax._identify.profile_shape import ProfileShape, crossings, shape_of
from impactjax._number_format import interval, with_unit

_OPEN_BELOW = (ProfileShape.OPEN_BELOW, ProfileShape.FLAT)
_OPEN_ABOVE = (ProfileShape.OPEN_ABOVE, ProfileShape.FLAT)


@dataclasses.dataclass(frozen=True)
class Profile:
    """Profile likelihood as a curve: the rise of the sum of squares S with a held quantity, while
    all parameters that are free are fitted again.

    - `name`, `unit`: of the quantity that is held, a parameter or a prediction.
    - `value`: its estimate.
    - `at`: values at which it is held, in rising order, shape (points,).
    - `rise`: (S − S_min)/(σ² i²) there, with the variance σ² of a residual and the inflation i of
      the standard error by correlated residuals, at least 1; NaN where the fit failed.
    - `threshold`: the rise that bounds the 95 % interval, the square of the 97.5 % quantile of
      Student's t.
    - `low`, `high`: ends of the interval, the outermost crossings of the threshold; where there is
      none, the end of the range; NaN if unknown.
    - `shape`: the `ProfileShape`.
    - `names`, `values`: all fitted parameters along the curve, shape (points, parameters).
    - `knots`: the points as they are continued; their distances, coordinates, and derivatives.
    """

    name: str
    unit: str
    value: float
    at: Float[np.ndarray, " points"]
    rise: Float[np.ndarray, " points"]
    threshold: float
    low: float
    high: float
    shape: ProfileShape
    names: tuple[str, ...]
    values: Float[np.ndarray, "points parameters"]
    knots: Knots = dataclasses.field(repr=False)

    def __str__(self) -> str:
        error = (self.high - self.low) / 4
        error = error if np.isfinite(error) and error > 0 else abs(self.value) / 100
        low = -np.inf if self.shape in _OPEN_BELOW else self.low
        high = np.inf if self.shape in _OPEN_ABOVE else self.high
        ends = interval(low, high, error)
        return f"{self.name}: {with_unit(ends, self.unit)} ({self.shape})"


def profile_along(
    name: str,
    axis: Axis,
    knots: Knots,
    span: Span,
    threshold: float,
    known: tuple[bool, bool],
    parameters: tuple[tuple[str, ...], Float[np.ndarray, "points parameters"]],
    *,
    doubtful: bool,
) -> Profile:
    """The profile of a quantity from points along its axis.

    **Arguments:**

    - `name`: of the quantity.
    - `span`: the part of the curve, with the rise of the cost at `threshold`.
    - `known`: for each end of the curve, true if the profile is open there unless it crosses.
    - `parameters`: names and values of all parameters at the points.
    - `doubtful`: as in `Estimate`.
    """
    costs = np.where(np.isfinite(knots.cost), knots.cost, np.nan)
    rise = threshold * (costs - span.lowest) / span.unit
    ends = crossings(knots.x, rise, threshold, known)
    centre, at = float(axis.value(np.zeros(1))[0]), axis.value(knots.x)
    names, values = parameters
    low, high = _values_of(axis, ends.low, ends.high)
    if axis.allowed.power < 0:
        at, rise, values = at[::-1], rise[::-1], values[::-1]
        ends = type(ends)(-ends.high, -ends.low)
    shape = shape_of(rise, ends, doubtful=doubtful)
    if shape is ProfileShape.SEVERAL_MINIMA and np.nanmin(rise) < -1:
        low = high = np.nan
    unit = axis.allowed.unit
    return Profile(name, unit, centre, at, rise, threshold, low, high, shape, names, values, knots)


def _values_of(axis: Axis, low: float, high: float) -> tuple[float, float]:
    """The interval of values between two distances; an open side ends with the range."""
    straight = axis.straight
    held = axis.held(np.array([low, high]))
    held = np.where(np.isneginf([low, high]), straight.low, held)
    held = np.where(np.isposinf([low, high]), straight.high, held)
    one = Straight((axis.allowed.power,), (axis.allowed.fades,), (straight,), (axis.allowed,))
    begin, end = one.interval(held[:1], held[1:])
    return float(begin[0]), float(end[0])
