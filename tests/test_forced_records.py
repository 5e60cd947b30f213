"""Records of a motion whose base moves: first looks, phases that nobody knows, fits."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

import impactjax as ij
from forced_pendulum import (
    AMPLITUDE,
    BASE,
    FREQUENCY,
    GAMMA,
    LENGTH,
    OMEGA0,
    OMEGA_N,
    PHASE,
    ZETA,
    R,
    on_base,
    record,
)
from tiers import quick

TRUTHS = {"omega_n": OMEGA_N, "zeta": ZETA, "phase": PHASE}
LAWS = {"restitution": {"r": R}, "kelvin-voigt": {"omega0": OMEGA0, "gamma": GAMMA}}
SENSOR = ij.Sensor()  # states that nothing is filtered, shifted or scaled


def prepared(compliant, **said):
    law = "kelvin-voigt" if compliant else "restitution"
    fixed = {"length": LENGTH, "gain": 1.0, "offset": 0.0, "drift": 0.0}
    base = said.pop("base", BASE)
    return ij.prepare(
        record(compliant), oscillator=on_base(base), laws=[law], sensor=SENSOR, fixed=fixed, **said
    )


@quick
@pytest.mark.parametrize("compliant", [False, True])
def test_first_look_at_a_forced_motion(compliant):
    look = prepared(compliant).first_look
    closed_form = np.exp(-np.pi * GAMMA / np.sqrt(1 - GAMMA**2)) if compliant else R
    assert look.phase == pytest.approx(PHASE, abs=0.1)
    assert float(vars(look.oscillator)["omega_n"]) == pytest.approx(OMEGA_N, rel=0.01)
    assert look.restitution == pytest.approx(closed_form, rel=0.06)
    assert len(look.marks) == 8
    assert np.all(look.restitutions < 1)


@quick
def test_first_look_at_a_forced_swing_without_impacts():
    ts = np.linspace(0, 6, 3001)
    omega_n, omega, phase = 9.0, 20.0, -2.0
    steady = 0.01 * omega**2 / (omega_n**2 - omega**2) * np.sin(omega * ts + phase)
    base = ij.HarmonicMotion(0.01, omega)
    shown = ij.Recording(ts, 0.03 * np.cos(omega_n * ts) + steady, ij.Displacement())
    look = shown.first_look(ij.LinearOscillator(5.0, base=base))
    assert look.swings_freely
    assert look.phase == pytest.approx(phase, abs=1e-3)
    assert float(vars(look.oscillator)["omega_n"]) == pytest.approx(omega_n, rel=1e-3)


@quick
def test_first_look_at_a_ball_on_a_moving_table():
    """Between impacts the height is a parabola minus the motion of the table."""
    g, a, omega, phase = 9.80665, 1e-3, 30.0, 1.1
    ts = np.linspace(0, 0.6, 1201)
    flight = 0.3
    s = ts % flight
    heights = g / 2 * s * (flight - s)
    lifted = a * (
        np.sin(omega * ts + phase) - np.interp(ts, [0, 0.3, 0.6], _table(a, omega, phase))
    )
    shown = ij.Recording(ts, heights - lifted, ij.Displacement())
    base = ij.HarmonicMotion(a, omega)
    look = shown.first_look(ij.BouncingBall(base=base))
    assert look.phase == pytest.approx(phase, abs=0.02)


def _table(a, omega, phase):
    return [np.sin(omega * t + phase) for t in (0.0, 0.3, 0.6)]


class _Shake(ij.AbstractBaseMotion):
    """A motion without a phase."""

    strength: Array = eqx.field(converter=jnp.asarray, metadata=ij.parameter("m/s²", known=True))

    def inertia(self, t):
        return self.strength * jnp.sin(FREQUENCY * t + PHASE)


@quick
def test_first_look_with_a_base_of_ones_own_has_no_phase():
    look = prepared(False, base=_Shake(AMPLITUDE * FREQUENCY**2)).first_look
    assert look.phase is None
    assert float(vars(look.oscillator)["omega_n"]) == pytest.approx(OMEGA_N, rel=0.01)


@quick
def test_first_sample_just_before_an_impact():
    """Few samples tell the first velocity; those after the impact do not count."""
    whole = record(True)
    mark = prepared(True).first_look.marks[0]
    late = whole.between(mark - 0.007, 2.0)
    look = late.first_look(on_base())
    assert look.initial.velocity == pytest.approx(-17.0, abs=2.5)


@quick
@pytest.mark.parametrize(
    ("said", "fits"),
    [("", True), ("phase = 0.7\n", False), ("[fixed]\nphase = 0.7\n", False)],
)
def test_phase_that_a_sidecar_does_not_state_is_fitted(tmp_path, said, fits):
    own = record()
    rows = np.stack([own.ts, own.values], axis=1)
    np.savetxt(tmp_path / "own.csv", rows, "%.6f", ",", header="time_s,angle_rad", comments="")
    base = f"[base]\namplitude = {AMPLITUDE}\nfrequency = {FREQUENCY}\n"
    (tmp_path / "own.toml").write_text(base + said)
    (experiment,) = ij.prepare(tmp_path / "own.csv", laws=["restitution"]).experiments.values()
    problem = ij.build_problem(experiment)
    assert ("phase" in problem.names) == fits
    base = vars(problem.system.model.oscillator)["base"]
    assert float(base.phase) == pytest.approx(PHASE, abs=0.1 if fits else 1e-12)


@quick
def test_check_makes_no_forecast_for_a_moving_base():
    words = str(ij.check(record(), oscillator=on_base(), fixed={"length": LENGTH}))
    assert "No forecast" in words
    assert "restitution above 1" not in words


@pytest.mark.parametrize("compliant", [False, True])
def test_forced_record_is_fitted_with_its_phase(compliant):
    law = "kelvin-voigt" if compliant else "restitution"
    other = dataclasses.replace(BASE, phase=2.0)
    (experiment, *_) = prepared(compliant, free=["phase"], base=other).experiments.values()
    estimate = ij.fit(experiment, starts=ij.Starts(4))
    for name, truth in (TRUTHS | LAWS[law]).items():
        own = estimate[name]
        assert abs(own.value - truth) < 3.5 * own.standard_error, name
    assert estimate.rms < 1.05 * np.radians(0.2)
