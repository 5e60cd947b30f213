"""Refusal of arguments of a wrong kind, in a sentence, where an object is made."""

from collections.abc import Callable
from typing import Any


def check_kind(name: str, value: object, kind: type, example: str) -> None:
    """Raises `TypeError` if an argument is of another kind.

    **Arguments:**

    - `name`, `value`: of the argument.
    - `kind`: what it must be.
    - `example`: how one is made.
    """
    if isinstance(value, kind):
        return
    words = kind.__name__.removeprefix("Abstract")
    shown = repr(value)
    shown = shown if len(shown) < 60 and "\n" not in shown else "of another kind"
    raise TypeError(
        f"Argument `{name}` must be {_article(words)} {words}, such as `{example}`, but it is "
        f"{shown}{_also(value)}."
    )


def of_kind(name: str, kind: type, example: str, *, optional: bool = False) -> Callable[[Any], Any]:
    """A converter of a field that lets nothing but a kind through, or `None` if that is allowed."""

    def check(value: object) -> object:
        if not (optional and value is None):
            check_kind(name, value, kind, example)
        return value

    return check


def _article(noun: str) -> str:
    return "an" if noun[0] in "AEIOU" else "a"


def _also(value: object) -> str:
    return f" ({type(value).__name__})"
