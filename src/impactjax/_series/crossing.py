"""First zero of a polynomial with a falling sign, isolated by its Bernstein coefficients.

The number of roots in [0, 1] is at most the number of sign changes of the Bernstein coefficients,
and differs from it by an even number (Descartes' rule of signs). No change proves that there is no
root, one change that there is exactly one. With more changes the step has to be shorter.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from impactjax._series.polynomial import horner_with_slope
from impactjax._types import Code, Each, Flag, Scalar

_NEWTON_STEPS = 7


class Crossing(NamedTuple):
    """The first passage from positive to negative on [0, 1]."""

    fraction: Each  # its place; infinity if there is none
    unclear: Flag  # there may be two passages; a shorter interval is needed


class Signs(NamedTuple):
    """Signs of a sequence of Bernstein coefficients."""

    first: Code  # sign of the first coefficient that is not zero
    changes: Code
    guess: Each  # approximate place at which the sequence first falls through zero


def bernstein(coefficients: Sequence[Each]) -> list[Each]:
    """Bernstein coefficients on [0, 1] of Σ aₖ wᵏ."""
    n = len(coefficients) - 1
    return [
        sum(
            (coefficients[k] * (math.comb(i, k) / math.comb(n, k)) for k in range(1, i + 1)),
            coefficients[0],
        )
        for i in range(n + 1)
    ]


def signs(control: Sequence[Each]) -> Signs:
    """Sign changes of Bernstein coefficients, ignoring zeros."""
    sign = first = changes = jnp.zeros((), jnp.int32)
    guess = jnp.ones_like(control[0])
    found = jnp.zeros((), bool)
    for i, value in enumerate(control):
        own = jnp.sign(value).astype(jnp.int32)
        changed = own * sign < 0
        falls = changed & (own < 0) & ~found
        if i > 0:
            drop = jnp.where(falls, control[i - 1] - value, 1.0)
            between = (i - 1 + control[i - 1] / drop) / (len(control) - 1)
            guess = jnp.where(falls, between, guess)
        found = found | falls
        changes = changes + changed.astype(jnp.int32)
        first = jnp.where(first == 0, own, first)
        sign = jnp.where(own == 0, sign, own)
    return Signs(first, changes, guess)


def first_crossing(
    coefficients: Sequence[Each], settle: Flag, margin: Each | float = 0.0
) -> Crossing:
    """The first w in [0, 1] at which p(w) = Σ aₖ wᵏ falls from positive to negative.

    By the signs of the Bernstein coefficients:

    - all negative, or p(0) ≤ 0 with p′(0) < 0: a crossing at w = 0
    - all positive, or first negative with one change (p rises): no crossing
    - first positive with one change: the root, by Newton's method
    - several changes, or several after subtracting `margin`, the error of p between its ends, or no
      convergence: unclear
    - unclear with `settle`, for an interval too short to divide: a crossing at w = 1 if p(1) < 0
    """
    control = bernstein(coefficients)
    first, changes, guess = signs(control)
    lowered = [control[0], *(value - margin for value in control[1:-1]), control[-1]]
    hidden = changes if isinstance(margin, float) else signs(lowered).changes
    root, converged = _root(coefficients, guess)
    single = (first > 0) & (changes == 1)
    falling = (coefficients[0] <= 0) & (coefficients[1] < 0)
    at_once = falling | ((first < 0) & (changes == 0))
    fraction = jnp.where(single, root, jnp.inf)
    fraction = jnp.where(at_once, jnp.zeros_like(root), fraction)
    unclear = ~falling & ((changes > 1) | (hidden > 1) | (single & ~converged))
    at_end = jnp.where(control[-1] < 0, jnp.ones_like(root), jnp.inf)
    return Crossing(jnp.where(unclear & settle, at_end, fraction), unclear & ~settle)


def shortened(h: Scalar, fraction: Scalar, t: Scalar) -> Scalar:
    """A shorter step after an unclear one from `t`. It contains the event found, if any, and is
    long enough for the resolution of time.
    """
    least = 4 * jnp.finfo(t.dtype).eps * jnp.abs(t)
    return jnp.minimum(h / 2, jnp.maximum(2 * jnp.minimum(fraction, 1.0) * h, least))


def _root(coefficients: Sequence[Each], guess: Each) -> tuple[Each, Bool[Array, "..."]]:
    """The only root in (0, 1] of a polynomial that is positive before it, by Newton's method within
    a bracket.
    """
    low, high = jnp.zeros_like(guess), jnp.ones_like(guess)
    root = guess
    value = correction = jnp.ones_like(guess)
    taken = jnp.zeros((), bool)
    for _ in range(_NEWTON_STEPS):
        value, slope = horner_with_slope(coefficients, root)
        low = jnp.where(value > 0, root, low)
        high = jnp.where(value > 0, high, root)
        correction = value / jnp.where(slope == 0, jnp.ones_like(slope), slope)
        newton = root - correction
        # Close to the root its side of the bracket is decided by rounding: bisection would lose it.
        close = jnp.abs(correction) <= 4 * np.finfo(guess.dtype).eps * root
        taken = close | ((newton >= low) & (newton <= high))
        root = jnp.where(value == 0, root, jnp.where(taken, newton, (low + high) / 2))
    enough = math.sqrt(np.finfo(guess.dtype).eps)
    return root, (value == 0) | (taken & (jnp.abs(correction) <= enough * root))
