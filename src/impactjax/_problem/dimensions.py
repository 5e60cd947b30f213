"""Units as powers of metre, kilogram, second and radian."""

import re
from collections.abc import Mapping

Dimensions = dict[str, float]  # exponents by base unit, without zeros

_SYMBOLS: dict[str, Dimensions] = {
    "1": {},
    "m": {"m": 1.0},
    "kg": {"kg": 1.0},
    "s": {"s": 1.0},
    "rad": {"rad": 1.0},
    "Hz": {"s": -1.0},
    "N": {"kg": 1.0, "m": 1.0, "s": -2.0},
    "Pa": {"kg": 1.0, "m": -1.0, "s": -2.0},
    "J": {"kg": 1.0, "m": 2.0, "s": -2.0},
}
_TOKEN = re.compile(r"\s*([()/^·*+]|[A-Za-z_]\w*|\d+(?:\.\d+)?)")
_SUPERSCRIPTS = {"²": "^2", "³": "^3"}


def dimensions(unit: str, exponents: Mapping[str, float] = {}) -> Dimensions | None:
    """The dimensions of a unit such as "N s/m²" or "N/m^n"; `None` if it cannot be read.

    All factors after a slash are in the denominator. An exponent is a number, a name, or a sum of
    these in parentheses.

    **Arguments:**

    - `unit`: as in the metadata of a parameter.
    - `exponents`: values of the exponents that have names.
    """
    for sign, power in _SUPERSCRIPTS.items():
        unit = unit.replace(sign, power)
    tokens = _TOKEN.findall(unit)
    if "".join(tokens) != "".join(unit.split()):
        return None
    try:
        found = _product(tokens, exponents)
    except (KeyError, IndexError, ValueError):
        return None
    return None if tokens else found


def times(one: Dimensions, other: Dimensions, power: float = 1.0) -> Dimensions:
    """The dimensions of the product of a unit with a power of another."""
    keys = dict.fromkeys([*one, *other])
    found = {key: one.get(key, 0.0) + power * other.get(key, 0.0) for key in keys}
    return {key: exponent for key, exponent in found.items() if abs(exponent) > 1e-12}


def unit_of(found: Dimensions) -> str:
    """The unit of some dimensions as text: "s/rad", "1/(s² rad^0.5)"."""
    above = [_power(name, e) for name, e in found.items() if e > 0]
    below = [_power(name, -e) for name, e in found.items() if e < 0]
    top = " ".join(above) or "1"
    if not below:
        return top
    return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({' '.join(below)})"


def power(name: str, exponent: float) -> str:
    """A power of a name, as text: "k", "k^0.5"."""
    return name if abs(exponent - 1) < 1e-9 else f"{name}^{exponent:.3g}"


def _power(name: str, exponent: float) -> str:
    return f"{name}²" if abs(exponent - 2) < 1e-9 else power(name, exponent)


def _product(tokens: list[str], exponents: Mapping[str, float]) -> Dimensions:
    """Reads factors up to the end or a closing parenthesis, and removes their tokens."""
    found, sign = Dimensions(), 1.0
    while tokens and tokens[0] != ")":
        token = tokens.pop(0)
        if token == "/":
            sign = -1.0
            continue
        if token in "·*":
            continue
        if token == "(":
            factor = _product(tokens, exponents)
            if tokens.pop(0) != ")":
                raise ValueError(token)
        else:
            factor = _SYMBOLS[token]
        found = times(found, factor, sign * _exponent(tokens, exponents))
    return found


def _exponent(tokens: list[str], exponents: Mapping[str, float]) -> float:
    """Reads the exponent of a factor and removes its tokens; 1 if there is none."""
    if not tokens or tokens[0] != "^":
        return 1.0
    del tokens[0]
    if tokens[0] != "(":
        return _number(tokens.pop(0), exponents)
    end = tokens.index(")")
    terms = [each for each in tokens[1:end] if each != "+"]
    del tokens[: end + 1]
    return sum(_number(each, exponents) for each in terms)


def _number(token: str, exponents: Mapping[str, float]) -> float:
    return exponents[token] if token in exponents else float(token)
