"""One fitted parameter with its uncertainty."""

from typing import NamedTuple

from impactjax._fit.verdict import Verdict
from impactjax._number_format import with_unit


class FittedParameter(NamedTuple):
    """One fitted parameter, in its own unit.

    - `name`, `unit`: such as "gamma" and "1".
    - `value`, `standard_error`: estimate and its standard error.
    - `low`, `high`: ends of the 95 % interval.
    - `verdict`: sides from which the recording bounds it.
    - `quoted`: the value with its error as text, or its bound, to two digits of the error.
    """

    name: str
    unit: str
    value: float
    standard_error: float
    low: float
    high: float
    verdict: Verdict
    quoted: str

    def __str__(self) -> str:
        sign = " =" if "±" in self.quoted else ":"
        return f"{self.name}{sign} {with_unit(self.quoted, self.unit)} ({self.verdict})"
