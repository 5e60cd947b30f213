"""An analogue low-pass filter before the sampling."""

import abc
import math
from collections.abc import Callable
from typing import TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from impactjax._known import AnyArray
from impactjax._parameter import (
    as_parameter,
    parameter,
    raise_if_violated,
    range_requirements,
)
from impactjax._sensor.kinks import Kinks, kinks_of
from impactjax._shown import with_numbers
from impactjax._simulate.jumps import Jumps
from impactjax._types import AngularFrequency, Samples

Mode: TypeAlias = tuple[Complex[Array, ""], Complex[Array, ""]]  # pole and residue
Pieces: TypeAlias = tuple[Float[Array, " intervals"], ...]
Before = tuple[Float[AnyArray, ""], Float[AnyArray, ""]]  # value and rate at the first sample
Jumped: TypeAlias = Complex[Array, " jumps"]
After: TypeAlias = Callable[[Complex[Array, ""], Jumped], Jumped]

_LIGHTLY = 0.99  # largest damping of an instrument that rings
_TERMS = 14  # number of terms of a series with terms below 6 / (j + 4)!


class AbstractLowPass(eqx.Module):
    """A linear filter between the quantity and its samples.

    Its input is known at the samples by value and rate, and by the jumps of the rate between them,
    as at the impacts on a rigid stop; without `jumps` there is none.
    """

    @abc.abstractmethod
    def filtered(
        self, ts: Samples, values: Samples, rates: Samples, jumps: Jumps | None = None
    ) -> Samples:
        """The filter's output at the times `ts`. Before the first sample its input was a straight
        line.
        """

    @abc.abstractmethod
    def filtered_velocity(
        self, ts: Samples, positions: Samples, velocities: Samples, jumps: Jumps | None = None
    ) -> Samples:
        """The filter's output at the times `ts` for the derivative of a position as input. Before
        the first sample the velocity was a straight line.
        """

    @abc.abstractmethod
    def filtered_acceleration(
        self,
        ts: Samples,
        positions: Samples,
        velocities: Samples,
        before: Before,
        jumps: Jumps | None = None,
    ) -> Samples:
        """The filter's output at the times `ts` for the second derivative of a position as input.

        Position and velocity stand for all that the acceleration does between the samples: the
        pulse of a contact that is shorter than a sample; a jump is an impulse. Before the first
        sample the acceleration was a straight line.
        """

    __repr__ = with_numbers


class AbstractModes(AbstractLowPass):
    """A filter whose impulse response is a sum of damped exponentials, Re Σ A exp(p t). Each is
    propagated from sample to sample, exactly for an input that is a cubic polynomial between
    samples with jumps of its rate.
    """

    @abc.abstractmethod
    def modes(self) -> list[Mode]:
        """Poles p with Im p ≥ 0, and their residues A [1/s]."""

    def filtered(
        self, ts: Samples, values: Samples, rates: Samples, jumps: Jumps | None = None
    ) -> Samples:
        kinks = kinks_of(jumps, ts)
        pieces = _cubic(ts, values, rates, kinks)
        return self._response(ts, pieces, (values[0], rates[0]), kinks, _after_kink)

    def filtered_velocity(
        self, ts: Samples, positions: Samples, velocities: Samples, jumps: Jumps | None = None
    ) -> Samples:
        kinks, h = kinks_of(jumps, ts), jnp.diff(ts)
        _, first, second, third = _cubic(ts, positions, velocities, kinks)
        pieces = first / h, 2 * second / h, 3 * third / h
        before = velocities[0], pieces[1][0] / h[0]
        return self._response(ts, pieces, before, kinks, _after_step)

    def filtered_acceleration(
        self,
        ts: Samples,
        positions: Samples,
        velocities: Samples,
        before: Before,
        jumps: Jumps | None = None,
    ) -> Samples:
        kinks, h = kinks_of(jumps, ts), jnp.diff(ts)
        _, _, second, third = _cubic(ts, positions, velocities, kinks)
        pieces = 2 * second / h**2, 6 * third / h**2
        return self._response(ts, pieces, before, kinks, _after_impulse)

    def _response(
        self, ts: Samples, pieces: Pieces, before: Before, kinks: Kinks, after: After
    ) -> Samples:
        """Output for an input by its polynomials between samples, and what its kinks add to them
        until the next sample.
        """

        def mode(pole: Complex[Array, ""]) -> Complex[Array, " samples"]:
            late = kinks.after.astype(pole.dtype)
            added = kinks.size.astype(pole.dtype) * after(pole, late)
            return _mode(pole, ts, pieces, before, kinks.summed(added, ts))

        each = (jnp.real(a * mode(p)) for p, a in self.modes())
        return sum(each, jnp.zeros_like(ts))


class Butterworth(AbstractModes):
    """A Butterworth filter: |H(2π i f)|² = 1 / (1 + (f / cutoff)^(2 order)).

    **Arguments:**

    - `cutoff`: frequency at which the power is halved [Hz].
    - `order`: number of poles.
    """

    cutoff: Float[Array, "..."] = eqx.field(
        converter=as_parameter, metadata=parameter("Hz", above=0, known=True, fades=True)
    )
    order: int = eqx.field(default=2, static=True)

    def __check_init__(self) -> None:
        if not 1 <= self.order <= 12:
            raise ValueError(f"Argument `order` must be from 1 to 12, but it is {self.order}.")
        raise_if_violated(self, range_requirements(self))

    def modes(self) -> list[Mode]:
        scale = 2 * math.pi * self.cutoff
        found = _poles_and_residues(self.order)
        return [(_times(pole, scale), _times(residue, scale)) for pole, residue in found]


class Resonance(AbstractModes):
    """An instrument that rings, such as a load cell: H(s) = ω² / (s² + 2 ζ ω s + ω²) with the
    angular frequency ω = 2π `resonance`.

    **Arguments:**

    - `resonance`: natural frequency without damping [Hz].
    - `resonance_damping`: damping ratio ζ, at most 0.99 [1].
    """

    resonance: Float[Array, "..."] = eqx.field(
        converter=as_parameter, metadata=parameter("Hz", above=0, known=True, fades=True)
    )
    resonance_damping: Float[Array, "..."] = eqx.field(
        converter=as_parameter,
        metadata=parameter("1", above=0, at_most=_LIGHTLY, known=True),
        default=0.02,
    )

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))

    def modes(self) -> list[Mode]:
        omega, zeta = 2 * math.pi * self.resonance, self.resonance_damping
        beating = jnp.sqrt(1 - zeta**2)
        pole = jax.lax.complex(-zeta * omega, beating * omega)
        return [(pole, jax.lax.complex(jnp.zeros_like(omega), -omega / beating))]


def _poles_and_residues(order: int) -> list[tuple[complex, complex]]:
    """Poles with Im ≥ 0 of the filter with unit cutoff; conjugates are counted in the residue."""
    k = np.arange(order)
    poles = np.exp(1j * np.pi * (2 * k + order + 1) / (2 * order))
    found = []
    for pole in poles:
        if pole.imag < -1e-9:
            continue
        others = poles[np.abs(poles - pole) > 1e-9]
        share = 2.0 if pole.imag > 1e-9 else 1.0
        found.append((complex(pole), complex(share / np.prod(pole - others))))
    return found


def _times(constant: complex, scale: AngularFrequency) -> Complex[Array, "..."]:
    return jax.lax.complex(constant.real * scale, constant.imag * scale)


def _cubic(ts: Samples, values: Samples, rates: Samples, kinks: Kinks) -> Pieces:
    """Coefficients of the cubic between samples, without what its kinks add to it."""
    h = jnp.diff(ts)
    rise = jnp.diff(values) - kinks.summed(kinks.size * kinks.after, ts)
    start, end = rates[:-1] * h, (rates[1:] - kinks.summed(kinks.size, ts)) * h
    return values[:-1], start, 3 * rise - 2 * start - end, start + end - 2 * rise


def _after_kink(pole: Complex[Array, ""], t: Jumped) -> Jumped:
    """Response ∫₀ᵗ exp(p (t − τ)) τ dτ to a ramp."""
    return t**2 * _moments(pole * t)[1]


def _after_step(pole: Complex[Array, ""], t: Jumped) -> Jumped:
    """Response ∫₀ᵗ exp(p (t − τ)) dτ to a step."""
    return t * _moments(pole * t)[0]


def _after_impulse(pole: Complex[Array, ""], t: Jumped) -> Jumped:
    return jnp.exp(pole * t)


def _mode(
    pole: Complex[Array, ""],
    ts: Samples,
    pieces: Pieces,
    before: Before,
    added: Complex[Array, " intervals"],
) -> Complex[Array, " samples"]:
    """Response m = ∫ exp(p (t − τ)) x(τ) dτ at the samples, to an x that is a polynomial between
    samples, and was linear before the first.

    **Arguments:**

    - `pieces`: its coefficients, for the time since a sample relative to the interval.
    - `added`: what the kinks in each interval add to the response at its end.
    """
    h = jnp.diff(ts).astype(pole.dtype)
    value, rate = (x.astype(pole.dtype) for x in before)
    first = -value / pole - rate / pole**2
    decay, moments = jnp.exp(pole * h), _moments(pole * h)
    gain = sum(a.astype(pole.dtype) * moment for a, moment in zip(pieces, moments, strict=False))

    def carried(mode: Complex[Array, ""], interval: tuple[Array, Array]) -> tuple[Array, Array]:
        decay, gain = interval
        mode = decay * mode + gain
        return mode, mode

    # A sequential scan: an associative one takes 3 to 50 times as long on a CPU.
    _, modes = jax.lax.scan(carried, first, (decay, gain * h + added))
    return jnp.concatenate([first[None], modes])


def _moments(z: Complex[Array, " intervals"]) -> list[Complex[Array, " intervals"]]:
    """Moments ∫₀¹ exp(z (1 − s)) sᵏ ds for k from 0 to 3, by the stable recursion for each z:
    upwards in k for |z| ≥ 1, downwards from a series for |z| < 1.
    """
    small = jnp.abs(z) < 1
    large, little = jnp.where(small, 1, z), jnp.where(small, z, 0)
    upwards = [(jnp.exp(large) - 1) / large]
    for k in (1, 2, 3):
        upwards.append((k * upwards[-1] - 1) / large)
    terms = [6 / math.factorial(j + 4) for j in range(_TERMS)]
    downwards = [jnp.polyval(jnp.asarray(terms[::-1], z.dtype), little)]
    for k in (3, 2, 1):
        downwards.insert(0, (little * downwards[0] + 1) / k)
    return [jnp.where(small, a, b) for a, b in zip(downwards, upwards, strict=True)]
