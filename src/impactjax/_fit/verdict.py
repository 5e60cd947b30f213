"""What a recording tells about a parameter."""

import enum

_WORDS = "fixed", "identified", "one-sided", "not identified", "undecided"


class Verdict(enum.IntEnum):
    """From which sides the recording bounds a parameter."""

    FIXED = 0
    IDENTIFIED = 1  # from both sides
    ONE_SIDED = 2  # from one side only
    NOT_IDENTIFIED = 3  # from none
    UNDECIDED = 4  # where the profile could not go on, which says nothing

    def __str__(self) -> str:
        return _WORDS[self.value]
