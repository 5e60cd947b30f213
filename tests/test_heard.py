"""Impacts behind a list of times: what was missed and what is false is found, and nothing else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impactjax as ij
from impactjax._check.noise import noise_of
from impactjax._record.missed_impacts import heard
from tiers import quick

pytestmark = quick


def bounces(count, ratios, first=0.4, noise=0.0, seed=0):
    flights = first * np.cumprod(np.concatenate([[1.0], np.broadcast_to(ratios, count - 2)]))
    times = 0.1 + np.concatenate([[0.0], np.cumsum(flights)])
    return times + noise * np.random.default_rng(seed).standard_normal(count)


RATIOS = {"soft": 0.6, "hard": 0.95, "speed-dependent": np.linspace(0.65, 0.8, 13)}


@pytest.mark.parametrize("name", RATIOS)
@pytest.mark.parametrize("seed", range(20))
def test_complete_impact_list_is_unchanged(name, seed):
    times = bounces(
        15 if name != "soft" else 9,
        RATIOS[name][:13] if name == "speed-dependent" else RATIOS[name],
        noise=3e-4,
        seed=seed,
    )
    found = heard(times)
    np.testing.assert_array_equal(found.times, times)
    assert found.valid.all()
    assert not found.false.size


@pytest.mark.parametrize("name", RATIOS)
@pytest.mark.parametrize("missed", [2, 5, 9])
@pytest.mark.parametrize("false", [None, 1, 4])
def test_one_missed_and_one_false_impact(name, missed, false):
    full = bounces(15, RATIOS[name])
    wrong = np.zeros(0) if false is None else full[false : false + 1] + 0.4 * np.diff(full)[false]
    found = heard(np.sort(np.concatenate([np.delete(full, missed), wrong])))
    np.testing.assert_allclose(found.times, full, atol=0.1 * np.diff(full)[missed])
    np.testing.assert_array_equal(found.valid, np.arange(15) != missed)
    np.testing.assert_array_equal(found.false, wrong)


def test_two_missed_impacts_and_false_start():
    full = bounces(14, 0.9)
    found = heard(np.concatenate([[0.02], np.delete(full, [6, 7])]))
    np.testing.assert_array_equal(found.valid, ~np.isin(np.arange(14), [6, 7]))
    np.testing.assert_array_equal(found.false, [0.02])


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 30))
def test_every_time_is_impact_or_false(seed, count):
    times = np.cumsum(np.random.default_rng(seed).uniform(1e-3, 1, count))
    found = heard(times)
    np.testing.assert_array_equal(
        np.sort(np.concatenate([found.times[found.valid], found.false])), times
    )
    assert np.all(np.diff(found.times) > 0)


def test_flight_over_a_missed_impact_is_no_noise():
    times = bounces(10, 0.8, noise=1e-4)
    assert 0 < noise_of(ij.ImpactTimes(times, np.arange(10) != 4)).size < 3e-4
