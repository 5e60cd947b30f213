"""Quintic Hermite polynomial of a guard inside a step, through its jets at both ends.

The jet of a guard is its value with its first and second derivative in time.
"""

from typing import TypeAlias

import jax.numpy as jnp

from impactjax._series.crossing import Crossing, first_crossing
from impactjax._types import Each, Flag, Scalar

Jet: TypeAlias = tuple[Each, Each, Each]


def watched(jet0: Jet, jet1: Jet, h: Scalar, settle: Flag) -> Crossing:
    """The first crossing of the quintic through two jets, known up to its distance to the cubic."""
    coefficients, margin = quintic(jet0, jet1, h)
    return first_crossing(coefficients, settle, margin)


def quintic(jet0: Jet, jet1: Jet, h: Scalar) -> tuple[list[Each], Each]:
    """The coefficients of the quintic through two jets, with time in units of the step, and its
    distance to the cubic through their values and slopes.
    """
    a0, a1, a2 = jet0[0], h * jet0[1], h**2 * jet0[2]
    b0, b1, b2 = jet1[0], h * jet1[1], h**2 * jet1[2]
    smooth = jnp.isfinite(a2) & jnp.isfinite(b2)
    a2 = jnp.where(smooth, a2, 6 * (b0 - a0) - 4 * a1 - 2 * b1)
    b2 = jnp.where(smooth, b2, 6 * (a0 - b0) + 4 * b1 + 2 * a1)
    rise, slope, bend = b0 - a0 - a1 - a2 / 2, b1 - a1 - a2, b2 - a2
    coefficients = [
        a0,
        a1,
        a2 / 2,
        10 * rise - 4 * slope + bend / 2,
        -15 * rise + 7 * slope - bend,
        6 * rise - 3 * slope + bend / 2,
    ]
    margin = jnp.abs((a1 - b1) / 32 + (a2 + b2) / 64)
    return coefficients, margin
