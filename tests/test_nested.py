"""Laws that hold others as special cases fit no worse than they do."""

import dataclasses
import functools
from typing import Any, cast

import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._compare.compare import compare_by
from impactjax._compare.fit_models import _is_worse
from impactjax._compare.laws import LAWS
from impactjax._compare.nested import SPECIAL_CASES, in_stages
from impactjax._first_look.first_look import FirstLook
from impactjax._fit.search import Search
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._parameter import ranges
from impactjax._report.outcome import outcome_of
from tiers import thorough

MASS = 0.02
SEEN = FirstLook(
    ij.Pendulum(13.0, mass=MASS),
    ij.InitialState(0.7),
    np.array([0.7, 0.6, 0.5]),
    np.array([0.6, 0.6, 0.6]),
    700.0,
    swings_freely=False,
)
SPEEDS = jnp.array([0.1, 0.5, 1.5])


def values_of(law) -> dict[str, float]:
    return {name: float(getattr(law, name)) for name in ranges(law)} | {"mass": MASS}


def force(law, speed):
    """At two depths on the way in and out, of an impact at a speed."""
    depth, mass = jnp.array([1e-4, 1e-3, 1e-3, 1e-4]), jnp.asarray(MASS)
    rate, touch = speed * jnp.array([1.0, 0.5, -0.5, -1.0]), law.touch(speed, mass)
    return jnp.stack([law.force(*each, touch, mass) for each in zip(depth, rate, strict=True)])


@pytest.mark.parametrize(("small", "large"), SPECIAL_CASES)
def test_special_case_equals_smaller_law(small, large):
    started = {type(law): law for law in (start(SEEN) for start in LAWS.values())}
    law, larger, kind = started[small], started[large], cast("Any", large)
    at = values_of(larger) | values_of(law)
    special = SPECIAL_CASES[small, large](at)
    assert special is not None
    at |= dict(special)
    same = kind(**{name: at[name] for name in ranges(larger)})
    for speed in SPEEDS:
        if isinstance(law, ij.AbstractImpactLaw):
            assert isinstance(same, ij.AbstractImpactLaw)
            np.testing.assert_allclose(same.restitution(speed), law.restitution(speed), rtol=1e-12)
        else:
            np.testing.assert_allclose(force(same, speed), force(law, speed), rtol=1e-12)


def test_special_cases_are_fitted_first():
    def model(law: str) -> ij.ImpactOscillator:
        return ij.ImpactOscillator(SEEN.oscillator, ij.Stop(LAWS[law](SEEN)))

    laws = ["power-law", "maxwell", "hunt-crossley", "simon", "hertz"]
    stages = [set(stage) for stage in in_stages({law: model(law) for law in laws})]
    assert stages == [{"maxwell", "hertz"}, {"simon"}, {"hunt-crossley"}, {"power-law"}]
    dry = ij.ImpactOscillator(ij.LinearOscillator(5.0, dry_friction=0.1))
    viscous = ij.ImpactOscillator(ij.LinearOscillator(5.0))
    assert in_stages({"dry": dry, "viscous": viscous}) == [["viscous"], ["dry"]]


@functools.cache
def compared():
    """A free swing with viscous and dry friction, and a search that fails with both: it stays where
    it starts unless it starts at the viscous answer.
    """
    ts = np.linspace(0.0, 2.0, 81)
    values = np.exp(-0.05 * ts) * np.cos(5 * ts)
    values = values + 0.01 * np.random.default_rng(2).standard_normal(81)
    recording = ij.Recording(jnp.asarray(ts), jnp.asarray(values), ij.Displacement())

    class Lazy(Search):
        def minima(self, problem, optimiser, searches):
            early = not np.all(searches.parts == searches.parts[-1])
            lazy = "dry_friction" in problem.names and early
            chosen = LevenbergMarquardt(1) if lazy else optimiser
            return Search().minima(problem, chosen, searches)

    prepared = ij.prepare(recording, laws=["none"])
    return compare_by(Lazy(), prepared, ij.Starts(16), LevenbergMarquardt(), lambda _: None, map)


@thorough
def test_more_friction_never_fits_worse():
    fits = {each.is_dry: each for each in compared()}
    assert float(fits[True].estimate.rms) <= float(fits[False].estimate.rms) * (1 + 1e-9)
    assert bool(fits[True].estimate.converged)
    assert fits[True].worse_than == ()


def test_fit_worse_than_special_case_has_no_result():
    viscous, both = sorted(compared(), key=lambda each: each.is_dry)
    assert _is_worse(
        viscous.estimate, dataclasses.replace(both.estimate, rms=0.9 * viscous.estimate.rms)
    )
    assert not _is_worse(both.estimate, viscous.estimate)
    worse = jnp.asarray(ij.Outcome.WORSE_THAN_SPECIAL_CASE)
    failed = both._replace(
        worse_than=("none",), estimate=dataclasses.replace(both.estimate, outcome=worse)
    )
    assert outcome_of(failed) == "worse than none, which it contains: the search failed"
