"""Intervals that allow for what a record does not decide, in records made with SciPy. Dry friction
that a record does not ask for widens intervals, and is no part of the fit.
"""

import functools

import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from impactjax._fit.left_out import not_excluded
from reference import pendulum, simulate_rigid
from tiers import thorough

OMEGA_N, ZETA, R = 13.47, 0.0017, 0.6
TIMES = np.linspace(0.0, 1.4, 701)
NOISE = np.radians(0.2)


def noisy(angles, seed):
    noise = NOISE * np.random.default_rng(seed).standard_normal(TIMES.size)
    return ij.Recording(TIMES, angles + noise, ij.Angle())


@functools.cache
def compared(friction=0.0, gap=0.0, seed=2, denied=False, zeta=ZETA):
    """A comparison of one law, with its intervals and notes, and the fits that it began."""

    def flow(t, y):
        return pendulum(OMEGA_N, zeta, friction)(t, y - np.array([gap, 0.0]))

    start = [np.pi / 4 + gap, 0.0]
    angles = simulate_rigid(flow, start, TIMES, lambda speed: R, max_step=1e-3).position - gap
    record = noisy(angles, seed)
    fixed = {"gain": 1.0, "offset": 0.0, "drift": 0.0} | ({"dry_friction": None} if denied else {})
    prepared, begun = ij.prepare(record, laws=["restitution"], fixed=fixed), []
    return ij.compare(prepared, starts=ij.Starts(4), progress=begun.append), begun


def noted(comparison, words):
    return any(words in note for note in comparison.notes)


def test_intervals_allow_for_dry_friction_that_the_record_does_not_exclude():
    """Friction could account for a part of the damping, whose interval reaches farther down."""
    rubbed = {"friction": 0.04, "zeta": 0.012}
    (allowed, _), (denied, _) = compared(**rubbed), compared(**rubbed, denied=True)
    assert noted(allowed, "does not exclude dry friction of up to")
    assert not noted(denied, "dry friction")
    names = denied.best.estimate.names
    assert allowed.best.estimate.names == names
    for name in names:
        own, other = allowed.best.estimate[name], denied.best.estimate[name]
        assert own.value == pytest.approx(other.value, rel=1e-6), name
        assert own.low <= other.low or own.low == pytest.approx(other.low), name
        assert own.high >= other.high or own.high == pytest.approx(other.high), name
    own, other = (each.best.estimate["zeta"] for each in (allowed, denied))
    assert 0 < own.low < other.low - other.standard_error / 10


def test_record_without_friction_is_not_fitted_with_it():
    comparison, begun = compared()
    assert "dry_friction" not in comparison.best.estimate.names
    assert begun == ["restitution", "restitution with dry friction"]
    assert len(comparison) == 1


def test_friction_fixed_without_a_value_is_absent():
    record = ij.Recording(TIMES, np.abs(np.cos(9 * TIMES)), ij.Angle())
    prepared = ij.prepare(record, laws=["restitution"], fixed={"dry_friction": None})
    (experiment,) = prepared.experiments.values()
    assert vars(experiment.model.oscillator)["dry_friction"] is None


@thorough
def test_intervals_allow_for_a_held_gap():
    found = [compared(gap=3e-4, seed=seed)[0] for seed in range(8)]
    undecided = [each for each in found if noted(each, "A gap from")]
    assert undecided
    for each in undecided:
        omega_n = each.best.estimate["omega_n"]
        assert omega_n.low < OMEGA_N < omega_n.high


def test_needed_gap_is_fitted():
    comparison, _ = compared(gap=0.004, seed=0, denied=True)
    omega_n = comparison.best.estimate["omega_n"]
    assert noted(comparison, "asks for `gap`")
    assert abs(omega_n.value - OMEGA_N) < 3 * omega_n.standard_error


def behind_a_low_pass(cutoff, scatter=0.0):
    """Angles behind a Butterworth low-pass of order 2, by SciPy at 10 kHz."""
    random = np.random.default_rng(5)
    fine = np.linspace(0.0, 1.4, 14001)
    flow, start = pendulum(OMEGA_N, ZETA, 0.0), [np.pi / 4, 0.0]

    def restitution(_):
        return R * np.exp(scatter * random.standard_normal())

    angles = simulate_rigid(flow, start, fine, restitution, max_step=1e-3).position
    sections = signal.butter(2, cutoff, fs=1e4, output="sos")
    filtered, _ = signal.sosfilt(sections, angles, zi=signal.sosfilt_zi(sections) * angles[0])
    return filtered[::20]


@pytest.mark.parametrize("scatter", [0.0, 0.02])
def test_effect_of_a_held_cutoff_is_that_of_fits_with_others(scatter):
    model = ij.ImpactOscillator(ij.Pendulum(13.4, 0.002), ij.Stop(ij.Restitution(0.6)))
    record, initial = noisy(behind_a_low_pass(50.0, scatter), 3), ij.InitialState(0.78)

    def found(cutoff):
        sensor = ij.Sensor(low_pass=ij.Butterworth(cutoff))
        size = ij.NormalScatter() if scatter else ij.NoScatter()
        return ij.fit(ij.Experiment(model, record, initial, sensor, scatter=size))

    middle, below, above = found(50.0), found(49.0), found(51.0)
    (own,) = [each for each in not_excluded(middle) if each.held.name == "cutoff"]
    moved = (above.values - below.values) / 2 / middle.standard_errors
    np.testing.assert_allclose(own.effect / middle.standard_errors, moved, rtol=0, atol=0.01)
    assert np.max(np.abs(moved)) > 0.1


@thorough
def test_intervals_allow_for_a_stated_cutoff_that_is_wrong():
    """The sensor is said to have 50 Hz and has 40: a later release makes up for it."""
    record = noisy(behind_a_low_pass(40.0), 3)
    sensor = ij.Sensor(low_pass=ij.Butterworth(50.0))

    def found(**fixed):
        known = {"gain": 1.0, "offset": 0.0, "drift": 0.0, "dry_friction": None, **fixed}
        prepared = ij.prepare(record, laws=["restitution"], sensor=sensor, fixed=known)
        return ij.compare(prepared, starts=ij.Starts(4))

    allowed, trusted = found(), found(cutoff=None)
    assert noted(allowed, "A cutoff from")
    assert not noted(trusted, "A cutoff from")
    names = allowed.best.estimate.names
    assert names == trusted.best.estimate.names
    speeds = [each.best.estimate["theta_dot0"] for each in (allowed, trusted)]
    assert [each.low < 0 < each.high for each in speeds] == [True, False]
