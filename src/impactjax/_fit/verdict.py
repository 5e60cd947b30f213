"""What a recording tells about a parameter."""

import enum


class Verdict(enum.IntEnum):
    """From which sides the recording bounds a parameter."""

    FIXED = 0
    IDENTIFIED = 1  # from both sides
    ONE_SIDED = 2  # from one side only
    NOT_IDENTIFIED = 3  # from none

    def __str__(self) -> str:
        return ("fixed", "identified", "one-sided", "not identified")[self.value]
