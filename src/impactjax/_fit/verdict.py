"""Verdicts on the identifiability of a parameter."""

from impactjax._abstract_code import AbstractCode


class Verdict(AbstractCode):
    """Identifiability of a parameter: the sides from which the recording bounds it."""

    FIXED = 0, "fixed"
    IDENTIFIED = 1, "identified"  # from both sides
    ONE_SIDED = 2, "one-sided"  # from one side only
    NOT_IDENTIFIED = 3, "not identified"  # from none
    UNDECIDED = 4, "undecided"  # no interval that can be relied on
