"""A claim of the thesis, and what a computation says of it."""

import enum
from typing import NamedTuple, TypeAlias

import numpy as np

Truth: TypeAlias = bool | np.bool_


class Verdict(enum.StrEnum):
    """Judgement of a claim."""

    AGREES = "agrees"
    DIFFERS = "differs"
    MISPRINT = "misprint"
    OPEN = "cannot be judged"


class Claim(NamedTuple):
    """A claim of the thesis, judged.

    - `figure`: number of the figure or equation beside which the claim stands.
    - `said`: subject of the claim.
    - `thesis`, `ours`: the printed value, and the one computed on the spot.
    - `verdict`: the judgement.
    - `reason`: reason of the verdict; empty only where the claim agrees.
    """

    figure: str
    said: str
    thesis: str
    ours: str
    verdict: Verdict
    reason: str = ""

    def row(self) -> tuple[str, str, str, str, str]:
        """The cells of a table with five columns; the reason stands beside our value."""
        computed = f"{self.ours}; {self.reason}" if self.reason else self.ours
        return self.figure, self.said, self.thesis, computed, self.verdict


def judged(agrees: Truth, *, misprint: Truth = False) -> Verdict:
    """Verdict on a claim that can be computed: it agrees as printed, it agrees with another reading
    of the print (`misprint`), or it differs.
    """
    if agrees:
        return Verdict.AGREES
    return Verdict.MISPRINT if misprint else Verdict.DIFFERS
