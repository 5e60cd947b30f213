"""The search for an end of an interval of the profile likelihood."""

import dataclasses
import math

import numpy as np

_FIRST, _GROWTH, FARTHEST = 2.0, 4.0, 200.0  # distances of the held values, in standard errors
_NEAR = 0.02  # relative distance of the rise from its limit at which the end counts as found
_PLAIN = 4.0  # distance beyond which a side is open even if simulations fail farther out
_CLOSE = 0.1  # relative distance to a failing simulation at which the walk ends
_AWAY = 0.1  # distance of another minimum that counts as one


@dataclasses.dataclass
class Walk:
    """Search for the end of an interval, outwards from the estimate on one side of one parameter.

    Distances are in standard errors; for a positive parameter close to zero they are differences of
    its natural logarithm.
    """

    parameter: int
    side: int
    centre: float
    unit: float
    logarithmic: bool
    farthest: float  # distance to the end of the range
    limit: float  # rise at the end of the interval
    inner: tuple[float, float] = (0.0, 0.0)  # distance and rise of a point inside the interval
    outer: tuple[float, float] | None = None  # distance and rise of a point outside it
    barrier: float = math.inf  # distance at which the simulation failed
    distance: float = 0.0
    follows: bool = True  # the others start at their conditional expectation, not at the estimate
    done: bool = False
    bounded: bool = False

    @property
    def failed(self) -> bool:
        """True if neither the end was found nor the side shown to be open."""
        return not self.bounded and self.inner[0] < min(self.farthest, _PLAIN)

    def value(self, distance: float) -> float:
        """The parameter at a distance."""
        if self.logarithmic:
            return self.centre * math.exp(self.side * distance)
        return self.centre + self.side * distance * self.unit

    def include(self, value: float, rise: float) -> None:
        """Begins outside a value with a known rise, if that is inside the interval."""
        away = self.side * (value - self.centre) / self.unit
        if self.logarithmic:
            away = self.side * math.log(value / self.centre) if value > 0 else 0.0
        if not self.done and rise < self.limit and away > _AWAY:
            self.inner = (min(away, self.farthest), rise)

    def next_value(self) -> float:
        """The value to hold next: farther out, or between points on both sides of the limit."""
        if self.outer is None:
            ahead = _FIRST if self.inner[0] == 0 else _GROWTH * self.inner[0]
            self.distance = min(ahead, self.farthest)
            if self.distance >= self.barrier:
                a, low = self.inner
                expected = a * self.limit / low if low > 0 else math.inf
                self.distance = min(expected, (a + self.barrier) / 2)
        else:
            (a, low), (b, high) = self.inner, self.outer
            share = (self.limit - low) / (high - low)
            self.distance = a + float(np.clip(share, 0.1, 0.9)) * (b - a)
        return self.value(self.distance)

    def learn(self, rise: float) -> None:
        """Records the rise at the value that was held; NaN if the simulation failed."""
        if math.isnan(rise) and self.follows:
            self.follows = False  # try the same value again: the others may have left their range
            return
        if math.isnan(rise) and self.outer is None:
            self.barrier = self.distance
            self.done = self.barrier - self.inner[0] < _CLOSE * self.barrier
            return
        at_limit = abs(rise - self.limit) < _NEAR * self.limit
        if rise >= self.limit or at_limit:
            self.outer, self.bounded = (self.distance, rise), True
        elif rise < self.limit:
            self.inner = (self.distance, rise)
        far = self.distance >= min(self.farthest, FARTHEST)
        self.done = at_limit or math.isnan(rise) or (self.outer is None and far)

    def end(self, beyond: float) -> float:
        """The end of the interval; NaN if it is not known."""
        if self.failed:
            return math.nan
        if not self.bounded:
            return beyond
        assert self.outer is not None
        (a, low), (b, high) = self.inner, self.outer
        share = (self.limit - low) / (high - low)
        return self.value(a + share * (b - a))
