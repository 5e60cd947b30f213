"""Codes of results, each with its words."""

import enum


class AbstractCode(enum.IntEnum):
    """Enumeration of whole numbers with words: `CONVERGED = 0, "converged"`."""

    words: str

    def __new__(cls, number: int, words: str) -> "AbstractCode":
        """The member of an enumeration."""
        member = int.__new__(cls, number)
        member._value_ = number
        member.words = words
        return member

    def __str__(self) -> str:
        return self.words
