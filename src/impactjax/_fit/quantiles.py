"""Distributions of Student's t and χ², and their quantiles, in NumPy and in JAX.

A distribution is tabulated once, so that its quantile in a mixture costs no more than
interpolations, and both libraries agree.
"""

from collections.abc import Callable
from types import ModuleType

import jax
import numpy as np
from jax.scipy import special as traced
from jaxtyping import Float
from scipy import special

from impactjax._known import AnyArray, namespace

Number = Float[AnyArray, ""]

NORMAL = float(special.ndtri(0.975))
"""The 97.5 % quantile of the normal distribution."""

_HALVINGS = 36
_FLAT = 12.0  # asinh t beyond which its distribution is flat
_SPREADS = 24.0  # standard deviations of log χ² beyond which its distribution is flat
_NODES = 1024


def student(freedom: Number) -> Callable[[AnyArray], AnyArray]:
    """Distribution function of Student's t."""
    xp, functions = _library(freedom)

    def tail(rapidity: AnyArray) -> AnyArray:
        share = freedom / (freedom + xp.sinh(rapidity) ** 2)
        return functions.betainc(freedom / 2, xp.full_like(freedom, 0.5), share) / 2

    tails = _tabulated(tail, freedom, 0.0, _FLAT)

    def distribution(away: AnyArray) -> AnyArray:
        beyond = tails(xp.arcsinh(xp.abs(away)))
        return xp.where(away > 0, 1 - beyond, beyond)

    return distribution


def chi_squared_above(freedom: Number) -> Callable[[AnyArray], AnyArray]:
    """Probability that χ² is above a value, as a function of the value's logarithm."""
    xp, functions = _library(freedom)

    def above(log_value: AnyArray) -> AnyArray:
        return functions.gammaincc(freedom / 2, xp.exp(log_value) / 2)

    middle, width = xp.log(freedom), _SPREADS * xp.sqrt(2 / freedom)
    return _tabulated(above, freedom, middle - width, middle + width)


def _library(like: AnyArray) -> tuple[ModuleType, ModuleType]:
    """The array module of a number, and the special functions for it."""
    xp = namespace(like)
    return xp, special if xp is np else traced


def _tabulated(
    function: Callable[[AnyArray], AnyArray],
    like: AnyArray,
    low: Number | float,
    high: Number | float,
) -> Callable[[AnyArray], AnyArray]:
    """A function by linear interpolation, with one expensive evaluation for each node."""
    xp = namespace(like)
    nodes = function(xp.linspace(low, high, _NODES))

    def interpolated(place: AnyArray) -> AnyArray:
        steps = xp.clip((place - low) / (high - low), 0.0, 1.0) * (_NODES - 1)
        left = xp.clip(xp.floor(steps), 0.0, _NODES - 2.0)
        row = left.astype(np.int32)
        return nodes[row] + (steps - left) * (nodes[row + 1] - nodes[row])

    return interpolated


def bisected(
    probability: Callable[[AnyArray], AnyArray], level: float, low: AnyArray, high: AnyArray
) -> AnyArray:
    """Place at which an increasing function has the value `level`."""
    xp = namespace(low, high)

    def halved(ends: tuple[AnyArray, AnyArray]) -> tuple[AnyArray, AnyArray]:
        middle = (ends[0] + ends[1]) / 2
        below = probability(middle) < level
        return xp.where(below, middle, ends[0]), xp.where(below, ends[1], middle)

    ends = low, high
    if xp is np:
        for _ in range(_HALVINGS):
            ends = halved(ends)
        return (ends[0] + ends[1]) / 2
    ends = jax.lax.fori_loop(0, _HALVINGS, lambda _, ends: halved(ends), ends)
    return (ends[0] + ends[1]) / 2
