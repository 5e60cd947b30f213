"""Figure 2.3: natural frequency and damping from a free decay."""

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from impactjax._thesis.claim import Claim, Verdict, judged
from impactjax._thesis.constants import GRAVITY, LENGTH, OMEGA_N, SAMPLING, ZETA
from impactjax._thesis.drawing import OTHER, RECORDED, SOFT, Made, named, panels, zero
from impactjax._thesis.record import LOST, sensor

_ANGLE = math.pi / 2  # the figure's axis of ±2 rad shows swings of more than 1.5 rad
_SECONDS = 5.0
_SHOWN = 1.5  # seconds in the figure


class _Decay(NamedTuple):
    """A record of a free decay, and what two models find in it.

    - `exact`: fit of the equation of motion.
    - `formula`: ω_n, ζ, angle and velocity at the start by multiple scales.
    - `curve`: the formula's angle [rad].
    """

    experiment: ij.Experiment
    exact: ij.Estimate[ij.Problem]
    formula: np.ndarray
    curve: np.ndarray


def figure_2_3() -> Made:
    """Free oscillation curve fitting."""
    found = _decay()
    recording = found.experiment.recording
    assert isinstance(recording, ij.Recording)
    ts, angle = np.asarray(recording.ts), np.asarray(recording.values)
    shown = ts <= _SHOWN
    drawn, (above, below) = panels(2, 1, 4.6)
    above.plot(ts[shown], angle[shown], ".", color=RECORDED, markersize=3, label=LOST)
    above.plot(ts[shown], found.curve[shown], color=SOFT, linewidth=1, label="multiple scales")
    above.set(ylabel="angle θ [rad]", xlim=(0, _SHOWN), ylim=(-2, 2.8))
    named(above, loc="upper right", ncols=2)
    left = np.asarray(found.exact.residuals)
    below.plot(ts, np.degrees(found.curve - angle), color=SOFT, linewidth=0.7)
    below.plot(ts, np.degrees(left), color=OTHER, linewidth=0.7)
    below.plot([], [], color=SOFT, label="multiple scales")
    below.plot([], [], color=OTHER, label="equation of motion")
    below.set(xlabel="time t [s]", ylabel="residual [deg]", xlim=(0, _SECONDS))
    named(below, loc="upper right", ncols=2)
    below.set(ylim=(-2.5, 3.5))
    for ax in (above, below):
        zero(ax)
    return Made(drawn, _claims(found))


def _decay() -> _Decay:
    from scipy import optimize  # a tenth of a second that other commands can do without

    ts = jnp.arange(round(_SECONDS * SAMPLING)) / SAMPLING
    swing = ij.ImpactOscillator(ij.Pendulum(OMEGA_N, ZETA, length=LENGTH))
    plan = ij.Experiment(
        swing, ij.planned(ts, ij.Angle()), ij.InitialState(_ANGLE), sensor=sensor()
    )
    experiment = ij.synthetic(plan, jax.random.key(2005))
    exact = ij.fit(experiment)
    recording = experiment.recording
    assert isinstance(recording, ij.Recording)
    angle = np.asarray(recording.values)

    @eqx.filter_jit
    def formula(values: jax.Array) -> jax.Array:
        omega_n, zeta, position, velocity = values
        start = ij.InitialState(position, velocity)
        return ij.MultipleScales(ij.Pendulum(omega_n, zeta), start).position(ts)

    begin = np.array([OMEGA_N, ZETA, _ANGLE, 0.0])
    by_formula = optimize.least_squares(lambda p: np.asarray(formula(p)) - angle, begin, "3-point")
    return _Decay(experiment, exact, by_formula.x, np.asarray(formula(by_formula.x)))


def _claims(found: _Decay) -> tuple[Claim, ...]:
    exact, formula = found.exact, found.formula
    omega_n, zeta = (exact.value(name) for name in ("omega_n", "zeta"))
    shift, share = formula[0] - OMEGA_N, formula[1] / ZETA - 1
    length = GRAVITY / OMEGA_N**2
    return (
        Claim(
            "2.3",
            "natural frequency and damping of the free pendulum",
            "13.47 ± 0.05 rad/s, 0.0017 ± 0.0001",
            f"{omega_n:.4f} rad/s, {zeta:.6f}",
            Verdict.OPEN,
            "the measurement is lost; these are the values that a fit of the equation of motion "
            "finds again in a simulated record",
        ),
        Claim(
            "2.3",
            "multiple scales describe this decay",
            "fitted within ± 0.05 rad/s and ± 0.0001",
            f"off by {shift:+.3f} rad/s and {formula[1] - ZETA:+.5f}",
            judged(abs(shift) < 0.05 and abs(share) < 0.0001 / ZETA),
            "the figure's axis of ± 2 rad shows swings beyond 1.5 rad; from 90 deg the formula's "
            "own error is larger than the errors stated",
        ),
        Claim(
            "2.3",
            "frequency in Hz",
            "2.144 ± 0.008 Hz",
            f"{OMEGA_N / (2 * math.pi):.3f} ± {0.05 / (2 * math.pi):.3f} Hz",
            judged(abs(OMEGA_N / (2 * math.pi) - 2.144) < 5e-4),
        ),
        Claim(
            "2.3",
            "effective length L = g/ω²",
            "71 ± 0.5 mm",
            f"{1e3 * length:.2f} mm",
            judged(abs(length - LENGTH) < 0.5e-3),
            "71 mm does not follow from 13.47 rad/s; it serves here as the distance of the contact "
            "from the pivot",
        ),
    )
