"""Motion of the base on which an oscillator and its stops stand."""

import abc
import dataclasses
import math
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import (
    as_parameter,
    parameter,
    raise_if_violated,
    range_requirements,
)
from impactjax._refusal import of_kind
from impactjax._shown import with_numbers
from impactjax._types import (
    Acceleration,
    AngularAcceleration,
    AngularFrequency,
    Length,
    Ratio,
    Time,
)

Own = TypeVar("Own", bound=AbstractOscillator)
Moving = TypeVar("Moving", bound="AbstractBaseMotion")
Times = Float[np.ndarray, " times"]


class AbstractBaseMotion(eqx.Module):
    """Motion of the base and the stops.

    The oscillator's coordinate is relative to the moving base. In this frame the motion acts as a
    force of inertia, minus the acceleration of the base, per unit of mass. A motion of your own
    needs this one method; a default step is a Taylor step if it is analytic.
    """

    @abc.abstractmethod
    def inertia(self, t: Time) -> Acceleration:
        """Force of inertia per unit of mass [m/s²], in the direction of the motion."""

    def smooth_until(self, t: Time) -> Time | None:
        """The next time at which the motion is not smooth: a step ends there. `None` if it is
        smooth at all times; NaN where it is not known after `t`.
        """
        del t

    def phases(self) -> "tuple[AbstractBaseMotion, ...]":
        """Motions of which those at all phases are combinations; itself if it has no phase."""
        return (self,)


def in_quadrature(motion: Moving) -> tuple[Moving, Moving]:
    """A motion at the phases 0 and π/2, with weights cos φ and sin φ at the phase φ."""
    begin, later = (dataclasses.replace(motion, phase=phase) for phase in (0.0, math.pi / 2))
    return begin, later


class HarmonicMotion(AbstractBaseMotion):
    """Harmonic motion of the base and the stops: amplitude · sin(frequency t + phase).

    Its force of inertia is amplitude · frequency² sin(frequency t + phase) per unit of mass.

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

    def inertia(self, t: Time) -> Acceleration:
        return self.amplitude * self.frequency**2 * jnp.sin(self.frequency * t + self.phase)

    def phases(self) -> tuple[AbstractBaseMotion, ...]:
        return in_quadrature(self)

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))

    __repr__ = with_numbers


class Chirp(AbstractBaseMotion):
    """Motion of the base and the stops whose frequency changes at a constant rate:
    amplitude · sin ψ with ψ = frequency t + rate t² / 2 + phase. Its frequency is ψ′.

    Its force of inertia is amplitude · (ψ′² sin ψ − rate cos ψ) per unit of mass.

    **Arguments:**

    - `amplitude`: A [m].
    - `frequency`: Ω at the time 0 [rad/s].
    - `rate`: change of the frequency in a second [rad/s²]; (Ω₁ − Ω₀) / T for a sweep from Ω₀ to Ω₁
      in the time T.
    - `phase`: φ [rad].
    """

    amplitude: Length = eqx.field(
        converter=as_parameter, metadata=parameter("m", at_least=0, known=True)
    )
    frequency: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", known=True)
    )
    rate: AngularAcceleration = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s²", known=True)
    )
    phase: Ratio = eqx.field(
        converter=as_parameter, metadata=parameter("rad", known=True), default=0.0
    )

    def inertia(self, t: Time) -> Acceleration:
        now = self.frequency + self.rate * t
        angle = (self.frequency + self.rate * t / 2) * t + self.phase
        return self.amplitude * (now**2 * jnp.sin(angle) - self.rate * jnp.cos(angle))

    def phases(self) -> tuple[AbstractBaseMotion, ...]:
        return in_quadrature(self)

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))

    __repr__ = with_numbers


as_base = of_kind("base", AbstractBaseMotion, "HarmonicMotion(0.003, 6.3)", optional=True)
"""Converter that lets only a motion of the base through, or `None`."""


def inertias(base: AbstractBaseMotion | None, times: Times) -> Float[np.ndarray, "phases times"]:
    """Forces of inertia per unit of mass at the phases of a motion, in NumPy; none at rest."""
    motions = () if base is None else base.phases()
    each = [np.asarray(motion.inertia(jnp.asarray(times))) for motion in motions]
    return np.array(each).reshape(-1, len(times))


def on_base(oscillator: Own, motion: AbstractBaseMotion) -> Own:
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
