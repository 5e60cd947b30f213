"""Verdicts on the identifiability of a parameter."""

import enum

_WORDS = "fixed", "identified", "one-sided", "not identified", "undecided"


class Verdict(enum.IntEnum):
    """Identifiability of a parameter: the sides from which the recording bounds it."""

    FIXED = 0
    IDENTIFIED = 1  # from both sides
    ONE_SIDED = 2  # from one side only
    NOT_IDENTIFIED = 3  # from none
    UNDECIDED = 4  # no interval that can be relied on

    def __str__(self) -> str:
        return _WORDS[self.value]
