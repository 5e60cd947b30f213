"""Parameters held at a value, on records whose faults are known."""

import dataclasses
import functools

import equinox as eqx
import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from impactjax._compare.asked_for import words
from tiers import thorough

DEGREE = np.pi / 180
NOISE = 0.2 * DEGREE
R, SPEED, OMEGA = 0.7, 6.0, 12.0


def swing(ts):
    """A linear oscillator that bounces off a stop at its equilibrium, in closed form: half periods
    of a sine, each with 0.7 times the speed of the one before.
    """
    half = np.pi / OMEGA
    number = np.floor(ts / half)
    return SPEED / OMEGA * R**number * np.abs(np.sin(OMEGA * ts))


def record(seed, *, offset=0.0, gain=1.0, drift=0.0, delay=0.0):
    ts = np.arange(600) / 500
    shown = gain * swing(np.maximum(ts - delay, 0.0)) + offset + drift * ts
    return ij.Recording(ts, shown + NOISE * np.random.default_rng(seed).standard_normal(600), PLACE)


PLACE = ij.Displacement()


def experiment(recording, **more):
    oscillator = ij.LinearOscillator(OMEGA, 0.0)
    model = ij.ImpactOscillator(oscillator, ij.Stop(ij.Restitution(R)))
    start = ij.InitialState(0.0, SPEED)
    fixed = ["zeta", "x0", *more.pop("fixed", ())]
    return ij.Experiment(model, recording, start, fixed=fixed, **more)


@functools.cache
def fitted(**faults):
    return ij.fit(experiment(record(1, **faults)))


def gains(estimate):
    return {each.name: each.gain for each in ij.left_out(estimate)}


def test_clean_record_asks_for_nothing():
    assert max(gains(fitted()).values()) < 5.0


def test_zero_off_by_half_the_noise_is_found():
    found = ij.left_out(fitted(offset=NOISE / 2))
    assert found[0].name == "offset"
    assert found[0].is_needed
    assert found[0].value == pytest.approx(NOISE / 2, abs=3 * found[0].standard_error)
    assert "offset" in str(found[0])


def test_profile_of_a_fit_with_drift_starts_at_its_minimum():
    """And not at that before the drift was fitted; the model is nearly linear."""
    found = ij.fit(experiment(record(1, drift=2 * NOISE), free=["drift"]), starts=ij.Starts(2))
    squares = np.sum(np.asarray(found.residuals) ** 2)
    assert 2 * float(np.min(found.start_costs)) == pytest.approx(float(squares), rel=1e-12)
    low, high = (np.asarray(getattr(ij.profiled(found), end)) for end in ("low", "high"))
    expected = np.asarray(found.high) - np.asarray(found.low)
    np.testing.assert_allclose(high - low, expected, rtol=0.1)


def test_expected_gain_is_that_of_the_fit():
    before = fitted(offset=NOISE / 2)
    again = ij.fit(experiment(record(1, offset=NOISE / 2), free=["offset"]))
    expected = ij.left_out(before)[0]
    assert float(before.aic - again.aic) == pytest.approx(expected.gain, rel=0.05)
    assert again["offset"].value == pytest.approx(expected.value, rel=0.02)
    assert again["offset"].standard_error == pytest.approx(expected.standard_error, rel=0.05)


def test_needed_parameters_are_fitted():
    faults = {"offset": 2 * NOISE, "drift": -3 * NOISE}
    before = fitted(**faults)
    after = ij.with_left_out(before)
    assert {*after.names} - {*before.names} == {"offset", "drift"}
    for name, truth in (*faults.items(), ("r", R), ("omega_n", OMEGA)):
        assert after[name].value == pytest.approx(truth, abs=4 * after[name].standard_error)
    assert "AIC falls by" in words(ij.left_out(before)[:2], before, after)


def test_known_parameters_stay():
    before = fitted(offset=NOISE / 2)
    assert ij.with_left_out(before, fixed=["offset", "drift", "gap"]).names == before.names


def test_low_pass_that_nobody_stated_is_found():
    """Released from rest, and filtered by SciPy at 20 kHz."""
    fine = swing(np.arange(24000) / 20000 + np.pi / (2 * OMEGA))
    k = np.tan(np.pi * 15.0 / 20000)  # Butterworth, order 2, by the bilinear transformation
    above = np.array([1.0, 2.0, 1.0]) * k**2
    below = np.array([1 + np.sqrt(2) * k + k**2, 2 * (k**2 - 1), 1 - np.sqrt(2) * k + k**2])
    rest = signal.lfilter_zi(above, below) * fine[0]
    shown, _ = signal.lfilter(above, below, fine, zi=rest)
    noise = NOISE * np.random.default_rng(3).standard_normal(600)
    plain = experiment(ij.Recording(np.arange(600) / 500, shown[::40] + noise, PLACE))
    start = ij.InitialState(SPEED / OMEGA, 0.0)
    plain = dataclasses.replace(plain, initial=start, fixed={"zeta": None})
    before = ij.fit(plain)
    assert ij.left_out(before)[0].name == "cutoff"
    assert str(ij.left_out(before)[0]).split(",")[0].endswith("Hz instead of none")
    after = ij.with_left_out(before)
    for name, truth in (("cutoff", 15.0), ("r", R), ("omega_n", OMEGA)):
        assert after[name].value == pytest.approx(truth, abs=4 * after[name].standard_error)


@thorough
def test_comparison_fits_what_the_record_asks_for():
    laws = {"r": experiment(record(2, offset=NOISE))}
    found = ij.compare(laws, starts=ij.Starts(2))
    assert "offset" in found.best.estimate.names
    assert "`offset` = " in found.notes[0]
    stated = {"r": experiment(record(2, offset=NOISE), fixed=["offset"])}
    assert "offset" not in ij.compare(stated, starts=ij.Starts(2)).best.estimate.names


def test_what_cannot_be_tested_is_refused():
    jitted = eqx.filter_jit(lambda estimate: [each.gain for each in ij.left_out(estimate)])
    with pytest.raises(ValueError, match="outside `jit`"):
        jitted(fitted())
    failed = eqx.tree_at(lambda each: each.outcome, fitted(), np.array(1))
    with pytest.raises(ValueError, match="did not converge"):
        ij.left_out(failed)
