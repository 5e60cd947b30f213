"""Checks of the types of arguments, with a readable error where an object is made."""

import inspect
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

_LARGEST = np.iinfo(np.int32).max


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


def check_function(name: str, value: object) -> None:
    """Raises `TypeError` if an argument is no function."""
    if not callable(value):
        raise TypeError(f"Argument `{name}` must be a function, but it is {value!r}.")


def check_takes(argument: str, function: object, names: Sequence[str], *first: object) -> None:
    """Raises `TypeError` for an argument that is not a function of some named values.

    **Arguments:**

    - `argument`, `function`: name and value of the argument.
    - `names`: names of the values.
    - `first`: values that come before them, without a name.
    """
    check_function(argument, function)
    assert callable(function)
    try:
        inspect.signature(function).bind(*first, **dict.fromkeys(names))
    except (TypeError, ValueError) as error:
        asked = f"the parameters {', '.join(names)} by name" if names else "no other parameters"
        raise TypeError(f"Argument `{argument}` must take {asked} ({error}).") from error


def as_names(argument: str, given: Iterable[str]) -> tuple[str, ...]:
    """A list of names. Raises `TypeError` for anything else."""
    if isinstance(given, str | Mapping):
        names = [given] if isinstance(given, str) else [*given]
        raise TypeError(f"Argument `{argument}` must be a list of names: {names}.")
    if not isinstance(given, Iterable):
        raise TypeError(f"Argument `{argument}` must be a list of names, but it is {given!r}.")
    found = tuple(given)
    for name in found:
        check_kind(argument, name, str, "'offset'")
    return found


def whole(name: str, value: int, least: int = 1) -> int:
    """A whole number. Raises `TypeError` for anything else, and `ValueError` for one that is too
    small or too large.
    """
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or isinstance(value, bool):
        raise TypeError(f"Argument `{name}` must be a whole number, but it is {value!r}.")
    if number < least:
        raise ValueError(f"Argument `{name}` must be at least {least}, but it is {number}.")
    if number > _LARGEST:
        raise ValueError(f"Argument `{name}` must be at most {_LARGEST}, but it is {number}.")
    return number


def check_number(name: str, value: object) -> None:
    """Raises `TypeError` if an argument is not one real number."""
    array = np.asarray(value)
    if array.ndim or array.dtype.kind not in "iuf":
        raise TypeError(f"Argument `{name}` must be a number, but it is {value!r}.")


def returned(argument: str, found: object) -> Array:
    """The array that a function returned. Raises `TypeError` for anything else."""
    return _array(argument, "an array", found)


def returned_number(argument: str, found: object) -> Array:
    """The number that a function returned. Raises `TypeError`, or `ValueError` for a shape."""
    array = _array(argument, "one number", found)
    if array.shape:
        shape = array.shape
        raise ValueError(f"Argument `{argument}` must return one number, but its shape is {shape}.")
    return array


def _array(argument: str, wanted: str, found: object) -> Array:
    if not eqx.is_array_like(found):
        kind = type(found).__name__
        raise TypeError(f"Argument `{argument}` must return {wanted}, but it returns a {kind}.")
    return jnp.asarray(found)


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
