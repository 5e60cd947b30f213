"""Dependence of the free acceleration on time, however small at the present parameters.

There may be a derivative by an amplitude that is zero, so none of this asks for its value.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.extend.core import JaxprEqn

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._series.jaxpr import read
from impactjax._simulate.state import State
from impactjax._types import Scalar

_TIME = object()  # marks what depends on time


def is_driven(model: ImpactOscillator) -> bool:
    """True if time enters the equation of the free acceleration."""

    def mark(equation: JaxprEqn, operands: list[Any]) -> list[Any]:
        depends = any(operand is _TIME for operand in operands)
        return [_TIME if depends else None for _ in equation.outvars]

    number = jax.ShapeDtypeStruct((), model.oscillator.mass.dtype)
    closed = jax.make_jaxpr(model.oscillator.acceleration)(number, number, number)
    return read(closed.jaxpr, closed.consts, [_TIME, None, None], mark)[0] is _TIME


def driving_rate(model: ImpactOscillator, t: Scalar, y: State) -> Scalar:
    """The rate [rad/s] at which the free acceleration of a standing mass changes with time, by any
    parameter of the oscillator; zero if time does not enter it.

    With g(t) the derivative of the acceleration by all parameters together, it is
    √((g‴² + |g″ g⁗|) / (g″² + |g′ g‴|)): Ω for any part a sin(Ω t + φ), λ for any a exp(λ t).
    """
    if not is_driven(model):
        return jnp.zeros_like(t)
    numbers, others = eqx.partition(model.oscillator, eqx.is_inexact_array)
    ones = jax.tree.map(jnp.ones_like, numbers)

    def response(t: Scalar) -> Scalar:
        def acceleration(numbers: AbstractOscillator) -> Scalar:
            moved: AbstractOscillator = eqx.combine(numbers, others)
            return moved.acceleration(t, y.position, y.velocity)

        return jax.jvp(acceleration, (numbers,), (ones,))[1]

    _, first, second, third, fourth = _derivatives(response, t, 4)
    above, below = third**2 + jnp.abs(second * fourth), second**2 + jnp.abs(first * third)
    known = jnp.isfinite(above) & jnp.isfinite(below) & (below > 0)
    return jnp.where(known, jnp.sqrt(above / jnp.where(known, below, 1.0)), 0.0)


def _derivatives(function: Callable[[Scalar], Scalar], t: Scalar, order: int) -> tuple[Scalar, ...]:
    """A function's value and its derivatives up to an order."""
    if order == 0:
        return (function(t),)
    lower, rates = jax.jvp(
        lambda t: _derivatives(function, t, order - 1), (t,), (jnp.ones_like(t),)
    )
    return *lower, rates[-1]
