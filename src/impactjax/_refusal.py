"""Checks of the types of arguments, with a readable error where an object is made."""

from collections.abc import Callable
from typing import Any


def check_kind(name: str, value: object, kind: type, example: str) -> None:
    """Raises `TypeError` if an argument does not have the required type.

    **Arguments:**

    - `name`, `value`: name and value of the argument.
    - `kind`: required type.
    - `example`: code that makes one, quoted in the error.
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
    """A field converter that lets only one type through, and `None` if `optional`."""

    def check(value: object) -> object:
        if not (optional and value is None):
            check_kind(name, value, kind, example)
        return value

    return check


def _article(noun: str) -> str:
    return "an" if noun[0] in "AEIOU" else "a"


def _also(value: object) -> str:
    return f" ({type(value).__name__})"
