"""Prior knowledge in fits, against linear regression in closed form."""

import dataclasses
import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal, stats

import impactjax as ij
from command import fitted, impactjax
from estimates import SMALL
from impactjax._fit.used_prior import UsedPrior
from tiers import quick, thorough

LINE = ij.ImpactOscillator(ij.FreeMass())
LEVEL, SLOPE, SIGMA, COUNT = 0.3, 0.7, 0.05, 9
MEAN, ERROR = 0.8, 0.02  # of the prior of the slope, about two standard errors from the data's
MATRIX = np.stack([np.ones(COUNT), np.linspace(0.0, 1.0, COUNT)], axis=1)
NOISE = SIGMA * np.random.default_rng(1).standard_normal(COUNT)
RIGHT = MATRIX @ [LEVEL, SLOPE] + NOISE
NUMBERS = ("values", "standard_errors", "low", "high")


def experiment(own=NOISE, prior: ij.Normal | None = None, **more) -> ij.Experiment:
    """A straight line with errors, recorded from a free mass."""
    ts = jnp.linspace(0.0, 1.0, len(own))
    recording = ij.Recording(ts, LEVEL + SLOPE * ts + own, ij.Displacement())
    given = {"initial": ij.InitialState(0.2, 0.5), "noise": ij.WhiteNoise(), "simulation": SMALL}
    priors = {} if prior is None else {"x_dot0": prior}
    return ij.Experiment(LINE, recording, priors=priors, **given | more)


@functools.cache
def found(sigma: float | None, error: float | None) -> ij.Estimate[ij.Problem]:
    prior = None if error is None else ij.Normal(MEAN, error)
    return ij.fit(experiment(prior=prior, sensor=ij.Sensor(sigma=sigma)))


def regression(variance: float, error: float = ERROR, mean: float = MEAN):
    """Values and covariance of a line with a prior of its slope."""
    information = MATRIX.T @ MATRIX / variance + np.diag([0.0, error**-2])
    covariance = np.linalg.inv(information)
    return covariance @ (MATRIX.T @ RIGHT / variance + [0.0, mean / error**2]), covariance


def test_fit_with_known_noise_is_the_gaussian_posterior():
    values, covariance = regression(SIGMA**2)
    estimate = found(SIGMA, ERROR)
    np.testing.assert_allclose(estimate.values, values, rtol=1e-8)
    np.testing.assert_allclose(estimate.covariance, covariance, rtol=1e-8)
    half = stats.norm.ppf(0.975) * np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(estimate.low, values - half, rtol=1e-6)
    left = RIGHT - MATRIX @ values
    minus_two = np.sum((left / SIGMA) ** 2) + COUNT * np.log(2 * np.pi * SIGMA**2)
    minus_two += ((values[1] - MEAN) / ERROR) ** 2
    assert float(estimate.aic) == pytest.approx(2 * 2 + minus_two)


def test_unknown_noise_is_weighed_by_the_degrees_of_freedom():
    """Regression, the variance of its residuals and the parameters that the prior tells, in turn
    until all rest.
    """
    variance, told = SIGMA**2, 0.0
    values, covariance = regression(variance)
    for _ in range(50):
        values, covariance = regression(variance)
        told = covariance[1, 1] / ERROR**2
        variance = np.sum((RIGHT - MATRIX @ values) ** 2) / (COUNT - 2 + told)
    estimate = found(None, ERROR)
    errors = np.sqrt(np.diag(covariance))
    assert np.max(np.abs(np.asarray(estimate.values) - values) / errors) < 0.05
    np.testing.assert_allclose(estimate.standard_errors, errors, rtol=0.02)
    assert float(estimate.freedom) == pytest.approx(COUNT - 2 + told, abs=0.02)


@pytest.mark.parametrize("sigma", [None, SIGMA])
def test_prior_with_a_huge_error_changes_nothing(sigma):
    plain, vague = found(sigma, None), found(sigma, 1e6)
    for name in NUMBERS:
        change = np.abs(np.asarray(getattr(vague, name)) - np.asarray(getattr(plain, name)))
        assert np.max(change / np.asarray(plain.standard_errors)) < 1e-6
    assert float(vague.aic) == pytest.approx(float(plain.aic), abs=1e-9)


@pytest.mark.parametrize("sigma", [None, SIGMA])
def test_prior_with_a_tiny_error_fixes(sigma):
    own = experiment(fixed={"x_dot0": MEAN}, sensor=ij.Sensor(sigma=sigma))
    fixed, sharp = ij.fit(own), found(sigma, 1e-7)
    for name in NUMBERS:
        np.testing.assert_allclose(getattr(sharp, name)[0], getattr(fixed, name)[0], rtol=1e-6)
    assert float(sharp.value("x_dot0")) == pytest.approx(MEAN, abs=1e-8)
    assert float(sharp.standard_error("x_dot0")) == pytest.approx(1e-7, rel=1e-6)
    assert float(sharp.aic - fixed.aic) == pytest.approx(2.0, abs=1e-6)  # one parameter more
    if sigma is None:
        assert float(sharp.freedom) == pytest.approx(float(fixed.freedom), rel=1e-6)


def test_residuals_are_those_of_the_record():
    estimate = found(None, ERROR)
    left = MATRIX @ np.asarray(estimate.values) - RIGHT
    np.testing.assert_allclose(estimate.residuals, left, atol=1e-10)
    assert float(estimate.rms) == pytest.approx(np.sqrt(np.mean(left**2)))


def test_profile_ends_where_the_penalised_sum_of_squares_has_risen():
    profile, linear = ij.profiled(found(SIGMA, ERROR)), found(SIGMA, ERROR)
    np.testing.assert_allclose(profile.low, linear.low, rtol=1e-3)
    np.testing.assert_allclose(profile.high, linear.high, rtol=1e-3)


def test_identifiability_counts_prior_knowledge():
    estimate = found(None, ERROR)
    np.testing.assert_allclose(
        ij.identifiability(estimate).bounds, estimate.standard_errors, rtol=0.02
    )


@thorough
def test_bootstrap_draws_prior_knowledge_anew():
    estimate = found(SIGMA, ERROR)
    drawn = ij.bootstrap(estimate, 1000)
    np.testing.assert_allclose(drawn.standard_errors, estimate.standard_errors, rtol=0.08)


@thorough
def test_batches_and_compiled_programs_have_priors():
    @jax.jit
    @jax.vmap
    def values(mean, error):
        return ij.fit(experiment(prior=ij.Normal(mean, error))).values

    several = values(jnp.array([MEAN, 0.6]), jnp.array([ERROR, 0.1]))
    np.testing.assert_allclose(several[0], found(None, ERROR).values, rtol=1e-8)
    other = ij.fit(experiment(prior=ij.Normal(0.6, 0.1))).values
    np.testing.assert_allclose(several[1], other, rtol=1e-8)


@thorough
@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_intervals_cover_the_truth(memory):
    """Slopes, levels and priors drawn anew, with white and with autoregressive noise."""
    count, error, replicates = 120, 0.03, 400

    @jax.jit
    @jax.vmap
    def fits(own, mean):
        prior, noise = ij.Normal(mean, error), ij.AutoregressiveNoise()
        return ij.fit(experiment(own, prior, noise=noise))

    random = np.random.default_rng(5)
    white = SIGMA * random.standard_normal((replicates, count + 100))
    own = np.asarray(signal.lfilter([1.0], [1.0, -memory], white))[:, 100:]
    means = SLOPE + error * random.standard_normal(replicates)
    estimates = fits(jnp.asarray(own), jnp.asarray(means))
    truth = np.array([LEVEL, SLOPE])
    inside = (np.asarray(estimates.low) < truth) & (truth < np.asarray(estimates.high))
    covered = inside.mean(axis=0)
    assert np.all((covered > 0.92) & (covered < 0.98)), covered
    errors = np.asarray(estimates.standard_errors)[:, 1]
    assert np.median(errors) < error
    spread = np.std(np.asarray(estimates.values)[:, 1])
    assert spread == pytest.approx(np.sqrt(np.mean(errors**2)), rel=0.1)


def test_left_out_parameter_counts_a_prior():
    """Two numbers of one effect: with a prior of the one the record tells the other."""
    without = ij.fit(experiment(fixed={"x0": LEVEL + 0.2}))
    tests = {held.name: held for held in ij.left_out(without)}
    assert tests["offset"].gain > 0
    known = dataclasses.replace(experiment(), priors={"x0": ij.Normal(LEVEL + 0.2, 0.01)})
    (offset,) = (held for held in ij.left_out(ij.fit(known)) if held.name == "offset")
    assert offset.value == pytest.approx(tests["offset"].value, rel=0.2)
    assert not any(held.name == "offset" for held in ij.left_out(found(None, None)))


BALL = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.85)))


def bounce_times(count: int) -> np.ndarray:
    flights = 0.6 * 0.9 ** np.arange(count)
    return np.cumsum(flights) + 1e-4 * np.random.default_rng(4).standard_normal(count)


@thorough
@pytest.mark.parametrize("sigma", [None, 1e-4])
def test_scatter_from_impact_to_impact_beside_a_prior(sigma):
    """A huge error changes nothing, and a tiny one fixes, in the mixed model as well."""
    times = ij.ImpactTimes(jnp.asarray(bounce_times(24)))
    own = ij.Experiment(BALL, times, ij.InitialState(0.0, 2.9), ij.Sensor(sigma=sigma))
    plain = ij.fit(own)
    mean = float(plain.value("r")) + 0.001
    vague, sharp = (
        ij.fit(dataclasses.replace(own, priors={"r": ij.Normal(mean, error)}))
        for error in (1e6, 1e-8)
    )
    fixed = ij.fit(dataclasses.replace(own, fixed={"r": mean}))
    for name in NUMBERS:
        change = np.asarray(getattr(vague, name)) - np.asarray(getattr(plain, name))
        assert np.max(np.abs(change) / np.asarray(plain.standard_errors)) < 1e-4
        change = np.asarray(getattr(sharp, name))[1:] - np.asarray(getattr(fixed, name))
        # The degrees of freedom are not exactly those of the smaller model.
        assert np.max(np.abs(change) / np.asarray(fixed.standard_errors)) < 0.2
    assert sharp.scatter is not None
    assert float(sharp.standard_error("r")) == pytest.approx(1e-8, rel=0.1)


@quick
def test_conflict_of_prior_and_record_is_that_of_both_alone():
    """Record 0.70 ± 0.03 and prior 0.84 ± 0.04: 2.8 standard errors of the difference."""
    weights = np.array([0.03, 0.04]) ** -2.0
    value, error = np.average([0.70, 0.84], weights=weights), weights.sum() ** -0.5
    used = UsedPrior("r", "1", 0.84, 0.04, float(value), float(error))
    assert used.conflict == pytest.approx((0.70 - 0.84) / 0.05)
    assert not used.is_contradicted
    assert str(used).startswith("r was known before as 0.840 ± 0.040: the estimate lies 2.2 of")
    assert used._replace(mean=0.87).is_contradicted
    assert "the record contradicts it" in str(used._replace(mean=0.87))
    assert UsedPrior("r", "1", 0.85, 0.04, 0.85, 0.04).conflict == 0.0


def test_estimate_names_its_priors():
    estimate = found(None, ERROR)
    (used,) = estimate.priors.values()
    distance = (float(estimate.value("x_dot0")) - MEAN) / ERROR
    assert used.distance == pytest.approx(distance)
    assert "(identified, prior 0.800 ± 0.020 m/s)" in str(estimate)


@quick
@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ({"fixed": {"x_dot0": 0.7}}, "`priors` speak of `x_dot0`, which is not fitted"),
        ({"priors": {"x_dot": ij.Normal(0.7, 0.1)}}, "There is no parameter `x_dot`; did you"),
    ],
)
def test_impossible_priors_are_refused(more, sentence):
    own = experiment(prior=ij.Normal(MEAN, ERROR))
    with pytest.raises(ValueError, match=sentence):
        ij.fit(dataclasses.replace(own, **more))


@quick
@pytest.mark.parametrize("numbers", [(math.nan, 0.1), (0.7, 0.0), (0.7, -0.1), (0.7, math.nan)])
def test_priors_need_a_finite_mean_and_a_positive_error(numbers):
    with pytest.raises(ValueError, match="must be finite"):
        ij.Normal(*numbers)


@pytest.fixture(scope="module")
def bounces(tmp_path_factory):
    path = tmp_path_factory.mktemp("priors") / "bounces.csv"
    np.savetxt(path, bounce_times(8), header="impact time [s]", comments="")
    return path


def test_command_counts_a_prior(bounces, tmp_path):
    asked = "--law", "restitution", "--prior", "r=0.9,0.0005"
    run = fitted(tmp_path, bounces, *asked)
    own = run.parameter("r")
    assert own["prior"]["value"] == 0.9
    assert own["prior"]["standard_error"] == 0.0005
    assert own["prior"]["distance"] == pytest.approx((own["value"] - 0.9) / 0.0005)
    assert own["standard_error"] < 0.0006
    assert run.parameter("t0")["prior"] is None
    assert "prior 0.90000 ± 0.00050" in run.stdout
    assert "r was known before as 0.90000 ± 0.00050" in run.stdout


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--prior", "r=0.9"], "is not NAME=VALUE,ERROR"),
        (["--prior", "r=0.9,0"], "must be greater than 0"),
        (["--prior", "r=0.9,-1"], "must be greater than 0"),
        (["--prior", "r=nan,0.1"], "is not a finite number"),
        (["--prior", "r=0.9,x"], "is not a number"),
        (["--prior", "r=0.9,0.1", "--prior", "r=0.8,0.1"], "`r` has two priors"),
        (["--prior", "rr=0.9,0.1"], "There is no parameter `rr`"),
        (["--prior", "r=0.9,0.1", "--fix", "r=0.9"], "`r` is in both `priors` and `fixed`"),
    ],
)
def test_command_refuses_impossible_priors(bounces, arguments, says):
    run = impactjax("fit", bounces, "--law", "restitution", *arguments)
    assert run.status == 2
    assert says in " ".join(run.stderr.split())
