"""Velocities that jump from one sample to the next; the records are made by SciPy."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from impactjax._record.velocity_jumps import MarkedJumps
from reference import ball, simulate_compliant, simulate_rigid
from tiers import mostly_thorough, quick

RATE, FINE = 500, 20_000  # of the record and of its integration [Hz]
COUNT, SIZE, R = 700, 0.02, 0.7  # samples, noise [m/s], restitution
TS = np.arange(COUNT) / RATE
FINE_TS = np.arange(COUNT * FINE // RATE) / FINE
GAMMA = 0.11


def rigid(height=0.4, cutoff=None):
    """Velocity of a ball that falls from a height [m], behind a low-pass [Hz]."""
    motion = simulate_rigid(ball(), [height, 0.0], FINE_TS, lambda speed: R)
    if cutoff is None:
        return motion.velocity[:: FINE // RATE], motion.impact_times
    sections = signal.butter(2, cutoff, fs=FINE, output="sos")
    values = np.asarray(signal.sosfilt(sections, motion.velocity))
    return values[:: FINE // RATE], motion.impact_times


def soft(omega0, height=0.4):
    """Velocity of a ball on a Kelvin-Voigt contact of natural frequency `omega0` [rad/s]."""

    def contact(t, y):
        del t
        return np.array([y[1], -(omega0**2) * y[0] - 2 * GAMMA * omega0 * y[1] - 9.80665])

    return simulate_compliant(ball(), contact, [height, 0.0], TS).velocity


def recording(values, seed=0):
    noise = SIZE * np.random.default_rng(seed).standard_normal(COUNT)
    return ij.Recording(TS, values + noise, ij.Velocity())


def weights_of(record):
    return np.asarray(record.jumps.weights)


def means_of(record):
    return np.asarray(record.jumps.means)


def compared(record, *laws):
    prepared = ij.prepare(record, oscillator=ij.BouncingBall(), laws=laws)
    return ij.compare(prepared, starts=ij.Starts(4))


def holds(parameter, truth):
    return bool(parameter.low <= truth <= parameter.high)


@quick
@pytest.mark.parametrize("turned", [False, True])
def test_jumps_are_marked_where_impacts_are(turned):
    values, times = rigid()
    marked = recording(-values if turned else values).with_jumps()
    weights = weights_of(marked)
    before = np.array([np.flatnonzero(time >= TS)[-1] for time in times])
    size = np.abs(values[before + 1] - values[before] + 9.80665 / RATE)
    np.testing.assert_allclose(weights[before], np.sqrt(12) * SIZE / size, rtol=0.2)
    np.testing.assert_allclose(weights[before + 1], 10 * SIZE / size, rtol=0.2)
    np.testing.assert_array_equal(weights[before - 3], 1.0)
    assert np.count_nonzero(weights) == 7 * len(before) - 2  # the last is close to the end


@quick
def test_smooth_velocities_are_not_marked():
    swing = np.cos(12 * TS) * np.exp(-TS)
    slow = [rigid(cutoff=cutoff)[0] for cutoff in (30, 100, 200)] + [soft(150.0), soft(600.0)]
    for values in (swing, *slow):
        for wrong in (0.0, 1.0):
            record = recording(values + np.where(TS == 0.6, wrong, 0.0))
            assert record.with_jumps() is record
    place = ij.Recording(TS, rigid()[0], ij.Displacement())
    assert place.with_jumps() is place


@quick
def test_short_and_missing_samples_are_not_marked():
    values, times = rigid()
    assert not ij.Recording(TS[:9], values[:9], ij.Velocity()).with_jumps().shows_jumps
    number = np.searchsorted(TS, times)
    valid = ~np.isin(np.arange(COUNT), number)
    assert not ij.Recording(TS, values, ij.Velocity(), valid).with_jumps().shows_jumps
    for counted in (np.zeros(COUNT, bool), np.arange(COUNT) % 2 == 0):
        assert not ij.Recording(TS, values, ij.Velocity(), counted).with_jumps().shows_jumps
    falling = (TS < 0.1) | (TS > 0.2)
    fall = ij.Recording(TS[falling][:100], -9.81 * TS[falling][:100], ij.Velocity())
    assert not fall.with_jumps().shows_jumps
    alone = ~np.isin(np.arange(COUNT), [*(number - 2), *(number + 1)])
    assert ij.Recording(TS, values, ij.Velocity(), alone).with_jumps().shows_jumps


@quick
def test_marks_stay_in_parts_and_paddings_of_a_record():
    marked = recording(rigid()[0]).with_jumps()
    weights, means = weights_of(marked), means_of(marked)
    kept = (TS >= 0.2) & (TS <= 1.0)
    part, longer = marked.between(0.2, 1.0), marked.padded(COUNT + 5)
    np.testing.assert_array_equal(weights_of(part), weights[kept])
    np.testing.assert_array_equal(means_of(part), means[kept])
    np.testing.assert_array_equal(weights_of(longer), [*weights, *np.zeros(5)])
    np.testing.assert_array_equal(weights_of(marked.truncated(0.5)), weights)
    np.testing.assert_array_equal(means_of(marked.turned()), -means)


@quick
def test_marked_jumps_refuse_a_low_pass():
    marked = recording(rigid()[0]).with_jumps()
    model = ij.ImpactOscillator(ij.BouncingBall(), lower=ij.Stop(ij.Restitution(R)))
    with pytest.raises(ValueError, match="no low-pass"):
        marked.check_suits(model, ij.Sensor(low_pass=ij.Butterworth(50.0)))
    with pytest.raises(ValueError, match="jumps"):
        ij.Recording(TS, rigid()[0], ij.Velocity(), jumps=MarkedJumps(jnp.ones(3), jnp.ones(3)))


def test_residual_beside_a_jump_is_that_of_the_mean_velocity():
    motion = simulate_rigid(ball(), [0.4, 0.0], TS, lambda speed: R)
    marked = ij.Recording(TS, motion.velocity, ij.Velocity()).with_jumps()
    sensor = ij.Sensor(gain=1.1, offset=0.2, drift=0.3)
    model = ij.ImpactOscillator(ij.BouncingBall(), lower=ij.Stop(ij.Restitution(R)))
    experiment = ij.Experiment(model, marked, ij.InitialState(0.4, 0.0), sensor)
    problem = ij.build_problem(experiment)
    rows, _ = marked.residuals(problem.system, problem.simulation, None)
    weights, values = weights_of(marked), motion.velocity
    means = 1.1 * np.diff(motion.position) * RATE + 0.2 + 0.3 * (TS[1:] + TS[:-1]) / 2
    beside = weights[:-1] * (means - (values[1:] + values[:-1]) / 2)
    expected = np.where(weights[:-1] > 0, beside, (0.1 * values + 0.2 + 0.3 * TS)[:-1])
    np.testing.assert_allclose(rows[:-1], expected, atol=1e-7)
    own = 0.01 * np.cos(TS)
    more, _ = marked.shifted(own).residuals(problem.system, problem.simulation, None)
    np.testing.assert_allclose(more - rows, own, atol=1e-12)
    deviations = marked.curves(np.asarray(rows)).fitted - values
    np.testing.assert_allclose(deviations * np.where(weights > 0, weights, 1.0), rows, atol=1e-12)


@pytest.mark.parametrize("seed", mostly_thorough(range(8), 0))
def test_velocity_of_a_rigid_stop_has_true_intervals_beside_a_law_of_contacts(seed):
    """All intervals hold, and the contact frequency is bounded from one side."""
    height = 0.4 + 0.0025 * seed
    found = compared(recording(rigid(height)[0], seed), "restitution", "kelvin-voigt")
    assert any("jumps from one sample to the next" in note for note in found.notes)
    fits = {each.name: each.estimate for each in found}
    truth = {"r": R, "x0": height, "x_dot0": 0.0}
    for name, value in truth.items():
        assert holds(fits["restitution"][name], value), name
        assert fits["restitution"][name].verdict is ij.Verdict.IDENTIFIED
    omega0 = fits["kelvin-voigt"]["omega0"]
    assert omega0.high > 1e5
    assert omega0.low < 2000


@pytest.mark.parametrize("omega0", mostly_thorough([600.0, 2500.0, 5000.0], 5000.0))
def test_velocity_of_a_short_contact_has_true_intervals(omega0):
    """Half a period of the contact lasts 2.6, 0.6 and 0.3 samples."""
    found = compared(recording(soft(omega0), 3), "kelvin-voigt")
    (estimate,) = (each.estimate for each in found if each.name == "kelvin-voigt")
    for name, value in {"omega0": omega0, "gamma": GAMMA, "x0": 0.4, "x_dot0": 0.0}.items():
        assert holds(estimate[name], value), name


def test_forecast_of_a_check_counts_jumps_as_a_fit_does():
    record = recording(rigid()[0], 2)
    prepared = ij.prepare(record, oscillator=ij.BouncingBall(), laws=["restitution"])
    estimate = ij.fit(prepared.experiment, starts=ij.Starts(4))
    told = ij.check(record, oscillator=ij.BouncingBall()).forecasts
    assert told is not None
    errors = {each.name: each.error for each in told.motion}
    for name in ("r", "x0", "x_dot0"):
        assert 0.4 < errors[name] / float(estimate.standard_error(name)) < 2.0, name


def test_wrong_samples_beside_jumps_do_no_harm():
    """They count as parts of the jumps."""
    values, times = rigid()
    values = values + np.isin(np.arange(COUNT), np.searchsorted(TS, times[:3]) - 3)
    found = compared(recording(values, 5), "restitution")
    r = found.best.estimate["r"]
    assert holds(r, R)
    assert r.verdict is ij.Verdict.IDENTIFIED


@pytest.mark.parametrize("cutoff", mostly_thorough([60.0, 230.0], 60.0))
def test_low_pass_of_a_velocity_is_found(cutoff):
    found = compared(recording(rigid(cutoff=cutoff)[0], 4), "restitution")
    estimate = found.best.estimate
    assert holds(estimate["cutoff"], cutoff)
    assert holds(estimate["r"], R)
    assert estimate["r"].verdict is ij.Verdict.IDENTIFIED
