"""Motion of the base on which an oscillator and its stops stand."""

import dataclasses
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp

from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import (
    as_parameter,
    parameter,
    raise_if_violated,
    range_requirements,
)
from impactjax._refusal import of_kind
from impactjax._shown import with_numbers
from impactjax._types import AngularFrequency, Length, Ratio, Time

Own = TypeVar("Own", bound=AbstractOscillator)


class HarmonicMotion(eqx.Module):
    """Harmonic motion of the base and the stops: amplitude · sin(frequency t + phase).

    The oscillator's coordinate is relative to the moving base. In this frame the motion acts as a
    force of inertia, amplitude · frequency² sin(frequency t + phase) per unit of mass.

    Source: Carter (2005), 2.10, whose text has a cosine where its equation has a sine.

    **Arguments:**

    - `amplitude`: A [m].
    - `frequency`: Ω [rad/s].
    - `phase`: φ [rad].
    """

    amplitude: Length = eqx.field(
        converter=as_parameter, metadata=parameter("m", at_least=0, known=True)
    )
    frequency: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", above=0, known=True)
    )
    phase: Ratio = eqx.field(
        converter=as_parameter, metadata=parameter("rad", known=True), default=0.0
    )

    def inertia(self, t: Time) -> Length:
        """Force of inertia per unit of mass [m/s²], in the direction of the motion."""
        return self.amplitude * self.frequency**2 * jnp.sin(self.frequency * t + self.phase)

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))

    __repr__ = with_numbers


as_base = of_kind("base", HarmonicMotion, "HarmonicMotion(0.003, 6.3)", optional=True)
"""Converter that lets only a motion of the base through, or `None`."""


def on_base(oscillator: Own, motion: HarmonicMotion) -> Own:
    """An oscillator on a base that moves. Raises `ValueError` if its base cannot."""
    if "base" not in vars(oscillator):
        raise ValueError(f"The base of a {type(oscillator).__name__} cannot move.")
    return dataclasses.replace(oscillator, base=motion)


def or_at_rest(oscillator: Own, motion: HarmonicMotion) -> Own:
    """An oscillator on its own base; if that does not move, on one with an amplitude of zero, so
    that it shares compiled programs with one that moves. Raises `ValueError` as `on_base` does.
    """
    still = dataclasses.replace(motion, amplitude=jnp.zeros_like(motion.amplitude))
    resting = on_base(oscillator, still)
    return resting if vars(oscillator)["base"] is None else oscillator
