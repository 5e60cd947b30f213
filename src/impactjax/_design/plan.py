"""The result of a design: performances, and what they are expected to tell."""

import dataclasses
import math
from collections.abc import Mapping

from impactjax._design.allocation import MOST
from impactjax._design.criterion import AbstractCriterion, scale_of
from impactjax._number_format import interval, with_unit


@dataclasses.dataclass(frozen=True)
class Performance:
    """Performances of one experiment.

    - `name`, `values`: the candidates' name, and the choices.
    - `number`: how often to perform it.
    - `costs`: what all of them take of each resource.
    """

    name: str
    values: Mapping[str, float]
    number: int
    costs: Mapping[str, float]

    def __str__(self) -> str:
        at = ", ".join(f"{name} = {value:.4g}" for name, value in self.values.items())
        return f"{self.number} x {self.name}" + (f" at {at}" if at else "")


@dataclasses.dataclass(frozen=True)
class Expected:
    """Expected and simulated precision of a parameter of the model.

    - `value`, `unit`: the value in the first model.
    - `positive`: true for a parameter that cannot be negative.
    - `half_width`: expected half-width of the 95 % interval relative to the value, or in the unit
      for a value of zero; infinite if the plan does not determine the parameter.
    - `attained`: the same from the spread of simulated refits; NaN without them.
    """

    name: str
    value: float
    unit: str
    positive: bool
    half_width: float
    attained: float

    @property
    def interval(self) -> tuple[float, float]:
        """The expected 95 % interval, in the unit."""
        width = self.half_width * scale_of(self.value)
        low = self.value - width
        return max(low, 0.0) if self.positive else low, self.value + width

    @property
    def quoted(self) -> str:
        """The expected interval with its unit."""
        if not math.isfinite(self.half_width):
            return "not determined"
        low, high = self.interval
        return with_unit(interval(low, high, (high - self.value) / 2), self.unit)

    def __str__(self) -> str:
        if not math.isfinite(self.half_width):
            return f"{self.name}: {self.quoted}"
        refits = "" if math.isnan(self.attained) else f", refits {self.amount(self.attained)}"
        return f"{self.name}: {self.quoted}, ± {self.amount(self.half_width)}{refits}"

    def amount(self, width: float) -> str:
        """A half-width relative to the value, in per cent."""
        if not self.value:
            return with_unit(f"{width:.2g}", self.unit)
        return f"{100 * width:.2g} %" if width < 1 else f"{100 * width:.0f} %"


@dataclasses.dataclass(frozen=True)
class Design:
    """A plan of experiments, and what it is expected to tell.

    - `criterion`: the criterion.
    - `performances`: the experiments to perform; none if the goal is reached already.
    - `expected`: expected precision of each parameter, by name.
    - `size`: the criterion as a relative standard error [1]; for a goal, the ratio of the
      half-width to what was asked.
    - `least_size`: no plan of these candidates within the budgets has a smaller one; fractions of
      performances are allowed in it, the candidates are the points that were tried.
    - `costs`, `budget`: what the plan takes of each resource, and what there is.
    - `least_share`: for a goal that is reached, no plan of these candidates takes less than this
      share of what the plan takes; NaN otherwise.
    - `scatter`: scatter of restitution that was assumed [1].
    - `refits`, `failed`: number of simulated refits, and of those that found no minimum.
    - `impossible`: number of candidates whose motion cannot be simulated.
    """

    criterion: AbstractCriterion
    performances: tuple[Performance, ...]
    expected: Mapping[str, Expected]
    size: float
    least_size: float
    costs: Mapping[str, float]
    budget: Mapping[str, float]
    least_share: float
    scatter: float
    refits: int
    failed: int
    impossible: int

    @property
    def reached(self) -> bool:
        """True if there is no goal, or the plan reaches it."""
        return self.criterion.goal == -math.inf or self.size <= 1 + 1e-9

    def __str__(self) -> str:
        return "\n".join([self.verdict, *self._plan(), *self._told(), *self.limits])

    @property
    def verdict(self) -> str:
        """The answer in a sentence."""
        if not self.criterion.asked_widths():
            if not self.performances:
                return f"No plan was found: {self._nothing}."
            return f"The best plan found leaves a relative error of {100 * self.size:.2g} %."
        asked = ", ".join(
            f"{name} within {100 * x:.3g} %" for name, x in self.criterion.asked_widths().items()
        )
        if not self.reached and not self.performances:
            return f"No plan was found that tells {asked}: {self._nothing}."
        if not self.reached:
            most = "within the budget" if self.budget else f"with {MOST} performances"
            return (
                f"No plan was found that tells {asked}: {most} the intervals are {self.size:.3g} "
                "times as wide."
            )
        if not self.performances:
            return f"What is known already tells {asked}."
        return f"This plan tells {asked}."

    @property
    def _nothing(self) -> str:
        return "no performance that the budget pays for tells anything of it"

    def _plan(self) -> list[str]:
        costs = ", ".join(
            f"{name} {spent:.4g}" + (f" of {self.budget[name]:.4g}" if name in self.budget else "")
            for name, spent in self.costs.items()
        )
        rows = [f"  {each}" for each in self.performances]
        return [*rows, f"  it takes: {costs}"] if rows else []

    def _told(self) -> list[str]:
        return [f"  {each}" for each in self.expected.values()]

    @property
    def limits(self) -> list[str]:
        """Sentences on what a better plan might reach, and on what failed."""
        found = []
        number = sum(each.number for each in self.performances)
        if number >= MOST:
            found.append(f"No more than {MOST} performances are planned.")
        if self.least_share > 0 and number > 1:
            share = f"{100 * self.least_share:.0f} %"
            found.append(f"Any plan of these candidates takes at least {share} as much.")
        elif not self.reached or not self.criterion.asked_widths():
            share = f"{100 * self.least_size / self.size:.0f} %"
            found.append(f"Any plan of these candidates leaves at least {share} of this error.")
        if self.failed:
            found.append(f"{self.failed} of {self.refits} refits found no minimum.")
        if self.impossible:
            found.append(f"{self.impossible} candidates cannot be simulated and were left out.")
        return found
