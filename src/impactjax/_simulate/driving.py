"""Dependence of the free acceleration on time, however small at the present parameters.

There may be a derivative by an amplitude that is zero, so none of this asks for its value.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.extend.core import JaxprEqn

from impactjax._model.base_motion import HarmonicMotion
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._simulate.jaxpr import read
from impactjax._simulate.state import State
from impactjax._types import Scalar

_TIME = object()  # marks what depends on time


def bases(model: ImpactOscillator) -> list[HarmonicMotion]:
    """The harmonic motions of the base, of which there is one or none."""
    parts = jax.tree.leaves(model, is_leaf=_is_base)
    return [part for part in parts if _is_base(part)]


def stirred(model: ImpactOscillator, acceleration: Scalar) -> ImpactOscillator:
    """The model with a base that is accelerated by `acceleration` [m/s²] at least."""

    def at_least(part: Any) -> Any:  # noqa: ANN401  any part of a model
        if not _is_base(part):
            return part
        amplitude = jnp.maximum(part.amplitude, acceleration / part.frequency**2)
        return HarmonicMotion(amplitude, part.frequency, part.phase)

    return jax.tree.map(at_least, model, is_leaf=_is_base)


def is_driven(model: ImpactOscillator) -> bool:
    """True if time enters the equation of the free acceleration."""

    def mark(equation: JaxprEqn, operands: list[Any]) -> list[Any]:
        depends = any(operand is _TIME for operand in operands)
        return [_TIME if depends else None for _ in equation.outvars]

    number = jax.ShapeDtypeStruct((), model.oscillator.mass.dtype)
    closed = jax.make_jaxpr(model.oscillator.acceleration)(number, number, number)
    return read(closed.jaxpr, closed.consts, [_TIME, None, None], mark)[0] is _TIME


def driving_rate(model: ImpactOscillator, t: Scalar, y: State) -> Scalar:
    """The fastest rate [rad/s] at which the free acceleration of a standing mass changes with time,
    by any parameter of the oscillator.

    With g(t) the derivative of the acceleration by all parameters together, it is
    √((g‴² + |g″ g⁗|) / (g″² + |g′ g‴|)): Ω for any part a sin(Ω t + φ), λ for any a exp(λ t).
    """
    numbers, others = eqx.partition(model.oscillator, eqx.is_inexact_array)
    ones = jax.tree.map(jnp.ones_like, numbers)

    def response(t: Scalar) -> Scalar:
        def acceleration(numbers: AbstractOscillator) -> Scalar:
            moved: AbstractOscillator = eqx.combine(numbers, others)
            return moved.acceleration(t, y.position, y.velocity)

        return jax.jvp(acceleration, (numbers,), (ones,))[1]

    first = _derivative(response)
    second = _derivative(first)
    third = _derivative(second)
    fourth = _derivative(third)
    above = third(t) ** 2 + jnp.abs(second(t) * fourth(t))
    below = second(t) ** 2 + jnp.abs(first(t) * third(t))
    known = jnp.isfinite(above) & jnp.isfinite(below) & (below > 0)
    return jnp.where(known, jnp.sqrt(above / jnp.where(known, below, 1.0)), 0.0)


def _derivative(function: Callable[[Scalar], Scalar]) -> Callable[[Scalar], Scalar]:
    return lambda t: jax.jvp(function, (t,), (jnp.ones_like(t),))[1]


def _is_base(part: object) -> bool:
    return isinstance(part, HarmonicMotion)
