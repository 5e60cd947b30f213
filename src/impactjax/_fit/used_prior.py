"""Prior knowledge that a fit used, beside what it found."""

import math
from typing import NamedTuple

from impactjax._number_format import with_error, with_unit

CLEAR = 3.0  # standard errors between prior knowledge and the record that contradict each other
_TOLD = 1e-9  # share of the prior's variance below which nothing beside it tells the parameter


class UsedPrior(NamedTuple):
    """Prior knowledge of a parameter that a fit used, beside what it found.

    - `name`, `unit`: of the parameter.
    - `mean`, `sigma`: mean and standard deviation of the prior.
    - `value`, `standard_error`: those of the estimate.
    """

    name: str
    unit: str
    mean: float
    sigma: float
    value: float
    standard_error: float

    @property
    def distance(self) -> float:
        """Distance of the estimate from the prior's mean, in its standard deviations."""
        return (self.value - self.mean) / self.sigma

    @property
    def conflict(self) -> float:
        """Distance of the prior's mean from the value that the record alone tells, in standard
        errors of both together: (p − mean)/√(sigma² − e²) with value p and standard error e.
        """
        left = 1 - (self.standard_error / self.sigma) ** 2
        if not left > 0:
            return self.distance
        return self.distance / math.sqrt(left) if left > _TOLD else 0.0

    @property
    def is_contradicted(self) -> bool:
        """True if record and prior differ by more than three standard errors of both together."""
        return abs(self.conflict) > CLEAR

    @property
    def shown(self) -> str:
        """The prior as text, "0.071 ± 0.001 m"."""
        return with_unit(with_error(self.mean, self.sigma), self.unit)

    def __str__(self) -> str:
        said = f"{self.name} was known before as {self.shown}"
        if self.is_contradicted:
            return (
                f"{said}, and the record contradicts it: they differ by {abs(self.conflict):.1f} "
                "standard errors. The prior, the law or the sensor is wrong."
            )
        side = "above" if self.distance >= 0 else "below"
        return f"{said}: the estimate lies {abs(self.distance):.1f} of that error {side} it."


def prior_words(prior: UsedPrior | None) -> str:
    """Words after the verdict on a parameter: ", prior 0.071 ± 0.001 m"; empty without a prior."""
    return "" if prior is None else f", prior {prior.shown}"
