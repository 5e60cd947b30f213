"""A model that plainly misses the record identifies nothing, whoever asks."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import SMALL, TS, line
from impactjax._problem.misfit import misfit
from impactjax._report.document import document
from tiers import quick

pytestmark = quick

WAVE = np.sin(2 * np.pi * (TS - TS[0]) / 0.75)


def fitted_by_a_line(values) -> ij.Estimate[ij.Problem]:
    return ij.fit(
        ij.Experiment(
            ij.ImpactOscillator(ij.FreeMass()),
            ij.Recording(jnp.asarray(TS), jnp.asarray(values), ij.Displacement()),
            ij.InitialState(0.0),
            simulation=SMALL,
        ),
        starts=ij.Starts(4),
    )


def left_by_a_line(values) -> float:
    """Share of the standard deviation, by NumPy."""
    rest = values - np.polyval(np.polyfit(TS, values, 1), TS)
    return float(np.std(rest) / np.std(values))


@pytest.mark.parametrize("size", [0.01, 10.0])
def test_misfit_of_wave_by_straight_line(size):
    values = 0.3 + 0.7 * TS + size * WAVE
    found = fitted_by_a_line(values)
    assert bool(found.converged)
    missed = size > 1
    assert bool(found.usable) is not missed
    np.testing.assert_allclose(found.misfit, left_by_a_line(values) if missed else 0.0, rtol=1e-6)
    verdict = ij.Verdict.NOT_IDENTIFIED if missed else ij.Verdict.IDENTIFIED
    for each in (found, ij.profiled(found)):
        assert [each.verdict(name) for name in each.names] == [verdict] * 2
    assert ("misses the record" in str(found)) is missed
    (said,) = document([ij.Comparison("x", (ij.Fitted("free flight", found, 0.0),))])["fits"]
    assert said["result"] == ("misses the record" if missed else "successful")
    assert bool(np.all(np.isinf(ij.identifiability(found).bounds))) is missed


def test_profile_of_unconverged_fit_identifies_nothing():
    _, found = line()
    open_ = dataclasses.replace(found, outcome=jnp.asarray(ij.Outcome.MAX_ITERATIONS))
    same = ij.profiled(open_)
    np.testing.assert_array_equal(same.low, found.low)


NOISE = np.random.default_rng(0).standard_normal(400)
SMOOTH = np.sqrt(2) * np.sin(np.linspace(0.0, 30.0, 400))


@pytest.mark.parametrize(
    ("residuals", "missed"),
    [
        (0.04 * SMOOTH, False),
        (0.06 * SMOOTH, True),
        (0.9 * NOISE, False),
        (2.0 * NOISE, True),
        (np.full(400, np.nan), False),
    ],
)
def test_misfit_of_residuals_larger_than_motion(residuals, missed):
    values = np.cos(np.linspace(0.0, 40.0, 400))
    values = values / values.std()
    recording = ij.Recording(jnp.arange(400.0), jnp.asarray(values), ij.Angle())
    share = float(jax.jit(misfit)(recording.variation(), jnp.asarray(residuals)))
    expected = float(np.sqrt(np.mean(residuals**2))) if missed else 0.0
    assert share == pytest.approx(expected, rel=1e-9)
