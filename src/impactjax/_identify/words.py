"""Directions in parameter space in words, as products of powers."""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from impactjax._identify.directions import DETERMINED, Directions
from impactjax._identify.information import Information
from impactjax._refusal import check_kind

_WORTH = 1.5  # factor by which the error may grow for a simpler combination
_WELL = 0.01  # relative standard error up to which a simpler combination is always accepted
_PRESENT = 0.1  # ratio to the largest exponent below which a parameter is not mentioned
_RATIOS = sorted({Fraction(a, b) * s for a in (1, 2, 3) for b in (1, 2, 3) for s in (-1, 1)})
_CLOSE = 0.1  # relative difference within which an exponent is rounded to a simple ratio

Exponents = dict[str, float]


class Finding(NamedTuple):
    """One combination of parameters and its error.

    - `combination`: "c/k" if it is determined; else the free direction, "k at fixed c/k".
    - `exponents`: exponents of the direction that it approximates, of length one.
    - `relative_error`: standard error of the combination [1].
    - `determined`: true if that is less than a half.
    - `amount`: the error in words, "to 0.3 %"; empty if it is infinite.
    """

    combination: str
    exponents: Exponents
    relative_error: float
    determined: bool
    amount: str


def findings(information: Information) -> list[Finding]:
    """Determined and undetermined combinations of parameters, the best determined first."""
    check_kind("information", information, Information, "identifiability(estimate)")
    found = information.directions
    rows = zip(np.asarray(found.exponents), np.asarray(found.errors), strict=True)
    return [_finding(information, found, row, float(error)) for row, error in rows]


def coupling(information: Information) -> str:
    """Determined and undetermined combinations in a sentence; empty without model parameters."""
    found = findings(information)
    told = [f"{each.combination} {each.amount}" for each in found if each.determined]
    open_ = [f"{each.combination} {each.amount}".rstrip() for each in found if not each.determined]
    parts = [
        *([f"determined: {', '.join(told)}"] if told else []),
        *([f"not determined: {', '.join(open_)}"] if open_ else []),
    ]
    sentence = "; ".join(parts)
    return f"{sentence[0].upper()}{sentence[1:]}." if sentence else ""


def _finding(information: Information, found: Directions, row: np.ndarray, error: float) -> Finding:
    exponents = dict(zip(found.names, row.tolist(), strict=True))
    if not error < DETERMINED:
        free = {name: round(w, 12) for name, w in exponents.items()}
        amount = f"(± {percent(error)})" if error < 10 and _has_size(information, free) else ""
        return Finding(_free(information, free), exponents, error, False, amount)
    simple = _simplest(found, row, error)
    own = float(found.error(simple))
    kept = {name: float(w) for name, w in zip(found.names, simple, strict=True) if w != 0}
    if _are_powers(information, kept):
        return Finding(_product(kept), exponents, own, True, f"to {percent(own)}")
    combination, lead = _sum(information, kept)
    if _are_powers(information, [lead]):
        return Finding(combination, exponents, own, True, f"to {percent(own)}")
    at = information.names.index(lead)
    size, unit = own * float(information.scale[at]), information.units[at]
    amount = f"to ± {size:.2g}" + ("" if unit == "1" else f" {unit}")
    return Finding(combination, exponents, own, True, amount)


def _are_powers(information: Information, names: Iterable[str]) -> bool:
    """True if steps of the parameters are steps of their logarithms: all are positive, and none is
    so small that it is scaled by its error.
    """
    at = [information.names.index(name) for name in names]
    return all(information.positive[i] for i in at) and _is_own_size(information, at)


def _has_size(information: Information, exponents: Exponents) -> bool:
    """True if the parameter with the largest exponent is scaled by its own value."""
    lead = max(exponents, key=lambda name: abs(exponents[name]))
    return _is_own_size(information, [information.names.index(lead)])


def _is_own_size(information: Information, at: list[int]) -> bool:
    values, scale = np.abs(np.asarray(information.values)), np.asarray(information.scale)
    return bool(np.all(scale[at] <= values[at]))


def _simplest(found: Directions, row: np.ndarray, error: float) -> np.ndarray:
    """The simplest exponents whose product is determined about as well as the direction itself, or
    to 1 %; the largest is one.

    Example: (0.70, −0.71) for (c, k) becomes (1, −1), so "c/k", if the error of c/k is at most 1.5
    times that of the direction. Few parameters are tried before many, simple ratios before decimal
    numbers.
    """
    large = np.abs(row) > 0.99 * np.abs(row).max()
    exact = row / row[np.flatnonzero(large)[-1]]
    alone = np.asarray(found.error(np.eye(len(row), dtype=row.dtype)))
    weight = np.where(large, np.inf, np.abs(exact) * np.minimum(alone, 1e9))
    limit = max(_WORTH * error * np.linalg.norm(exact), _WELL)
    for count in range(int(large.sum()), len(row) + 1):
        kept = np.isin(np.arange(len(row)), np.argsort(-weight)[:count])
        for rounded in (_as_ratio, _two_digits):
            simple = np.array([rounded(w) for w in exact]) * kept
            if float(found.error(simple)) <= limit:
                return simple
    return exact


def _as_ratio(exponent: float) -> float:
    """The nearest simple ratio, if it is close; else the exponent to two digits."""
    nearest = float(min(_RATIOS, key=lambda ratio: abs(exponent - ratio)))
    close = abs(exponent - nearest) < _CLOSE * abs(nearest)
    return nearest if close else _two_digits(exponent)


def _two_digits(exponent: float) -> float:
    return float(f"{exponent:.2g}")


def _free(information: Information, exponents: Exponents) -> str:
    """An undetermined direction in words: the parameter that varies, and the combinations that
    stay, "k at fixed c/k".
    """
    largest = max(abs(w) for w in exponents.values())
    lead = next(name for name, w in exponents.items() if abs(w) > 0.99 * largest)
    others = {
        name: _as_ratio(w / exponents[lead])
        for name, w in exponents.items()
        if name != lead and abs(w) > _PRESENT * largest
    }
    if not others:
        return lead
    stays = [{name: 1.0, lead: -ratio} for name, ratio in others.items()]
    fixed = [
        _product(each) if _are_powers(information, each) else _sum(information, each)[0]
        for each in stays
    ]
    return f"{lead} at fixed {' and '.join(fixed)}"


def _product(exponents: Exponents) -> str:
    """Powers as a fraction: "c/k", "k·m/c^2"."""
    above = [_power(name, w) for name, w in exponents.items() if w > 0]
    below = [_power(name, -w) for name, w in exponents.items() if w < 0]
    if not above and len(below) == 1:
        return below[0]
    top = "·".join(above) or "1"
    if not below:
        return top
    return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({'·'.join(below)})"


def _power(name: str, exponent: float) -> str:
    if math.isclose(exponent, 1):
        return name
    ratio = Fraction(exponent).limit_denominator(3)
    if math.isclose(ratio, exponent):
        return f"{name}^{ratio}" if ratio.denominator == 1 else f"{name}^({ratio})"
    return f"{name}^{exponent:.2g}"


def _sum(information: Information, weights: Exponents) -> tuple[str, str]:
    """A sum in natural units, for parameters that may be negative: "r0 - 0.62 alpha"; and the
    parameter with the largest weight.
    """
    lead = max(weights, key=lambda name: abs(weights[name]))
    scale = dict(zip(information.names, np.asarray(information.scale).tolist(), strict=True))
    others: Sequence[str] = [name for name in weights if name != lead]
    terms = [lead]
    for name in others:
        factor = weights[name] / weights[lead] * scale[lead] / scale[name]
        terms.append(f"{'+' if factor > 0 else '-'} {abs(factor):.3g} {name}")
    return " ".join(terms), lead


def percent(error: float) -> str:
    """A relative error to two digits."""
    percent = 100 * error
    digits = max(1 - math.floor(math.log10(percent)), 0) if percent > 0 else 0
    return f"{percent:.{digits}f} %"
