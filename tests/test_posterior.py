"""Posterior distributions, against closed forms and the profile likelihood."""

import dataclasses
import functools
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray
from scipy import signal, stats

import impactjax as ij
from estimates import SMALL
from impactjax._fit.estimate import P
from impactjax._identify.density import Density, density_of
from impactjax._problem.abstract_problem import Answer
from tiers import thorough

LINE = ij.ImpactOscillator(ij.FreeMass())
TS = np.linspace(0.0, 1.0, 9)
LEVEL, SLOPE, SIGMA = 0.3, 0.7, 0.05
DRAWS, CHAINS = 500, 4
LEVELS = np.array([0.025, 0.25, 0.5, 0.75, 0.975])


def errors(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(len(TS))


def recorded(seed: int) -> np.ndarray:
    return LEVEL + SLOPE * TS + SIGMA * errors(seed)


def draws_of(tree: xarray.DataTree, name: str) -> np.ndarray:
    return np.asarray(tree["posterior"].dataset[name])


def line(own: np.ndarray, **more) -> ij.Experiment:
    """A straight line with errors, recorded from a free mass."""
    ts = np.linspace(0.0, 1.0, len(own))
    recording = ij.Recording(ts, LEVEL + SLOPE * ts + SIGMA * own, ij.Displacement())
    given = {"initial": ij.InitialState(0.2, 0.5), "noise": ij.WhiteNoise(), "simulation": SMALL}
    return ij.Experiment(LINE, recording, **given | more)


@functools.cache
def fitted() -> ij.Estimate[ij.Problem]:
    return ij.fit(line(errors()))


def densities(estimate: ij.Estimate[P], places: np.ndarray) -> np.ndarray:
    """Log-densities of natural values under a linear model."""
    density = density_of(estimate)
    rows = estimate.residuals + (places - np.asarray(estimate.values)) @ estimate.jacobian.T
    return np.array([float(density.of_rows(row)) for row in jnp.asarray(rows)])


def around(estimate: ij.Estimate[P]) -> np.ndarray:
    """Values up to three standard errors from those of an estimate."""
    away = np.random.default_rng(2).uniform(-3, 3, (6, len(estimate.names)))
    return np.asarray(estimate.values) + away * np.asarray(estimate.standard_errors)


def squares(places: np.ndarray, centre: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Squared distances from a centre, in units of a scale matrix."""
    away = places - centre
    return np.sum(away @ np.linalg.inv(scale) * away, axis=1)


def students(
    places: np.ndarray, centre: np.ndarray, scale: np.ndarray, freedom: float
) -> np.ndarray:
    """Log-density of Student's distribution in several dimensions, up to a constant."""
    return -(freedom + len(centre)) / 2 * np.log1p(squares(places, centre, scale) / freedom)


def agree(found: np.ndarray, expected: np.ndarray) -> None:
    """Checks that log-densities differ by a constant."""
    np.testing.assert_allclose(found - found[0], expected - expected[0], rtol=1e-6, atol=1e-8)


def test_density_with_noise_of_unknown_size_is_students():
    estimate, places = fitted(), around(fitted())
    rows = np.stack([np.ones_like(TS), TS], axis=1)
    values, left, *_ = np.linalg.lstsq(rows, recorded(1), rcond=None)
    scale = left[0] / (len(TS) - 2) * np.linalg.inv(rows.T @ rows)
    agree(densities(estimate, places), students(places, values, scale, len(TS) - 2))


def test_density_with_known_noise_is_normal():
    estimate = ij.fit(line(errors(), sensor=ij.Sensor(sigma=SIGMA)))
    rows, places = np.stack([np.ones_like(TS), TS], axis=1), around(estimate)
    covariance = SIGMA**2 * np.linalg.inv(rows.T @ rows)
    normal = -squares(places, np.asarray(estimate.values), covariance) / 2
    agree(densities(estimate, places), normal)


@thorough
def test_density_under_correlated_noise_has_the_intervals_of_the_estimate():
    """An autoregression, whose errors the fit widens."""
    own = np.asarray(
        signal.lfilter([1.0], [1.0, -0.6], np.random.default_rng(4).standard_normal(80))
    )
    estimate = ij.fit(line(own, noise=ij.AutoregressiveNoise()))
    assert float(np.min(estimate.inflation)) > 1.3
    places = around(estimate)
    about = np.asarray(estimate.values), np.asarray(estimate.covariance), float(estimate.freedom)
    agree(densities(estimate, places), students(places, *about))


@thorough
def test_density_of_a_joint_estimate_has_its_prior_and_integrates_over_each_noise():
    known = ij.Normal(0.4, 0.02)
    first, second = [line(errors(seed), fixed=("x_dot0",)) for seed in (1, 2)]
    first = dataclasses.replace(first, priors={"x0": known})
    estimate = ij.fit_together([first, second], shared=("x0",))
    places = around(estimate)

    def expected(level: float) -> float:
        left = [level + 0.5 * TS - recorded(seed) for seed in (1, 2)]
        likelihood = sum(-len(TS) / 2 * np.log(np.sum(own**2)) for own in left)
        return float(likelihood + stats.norm.logpdf(level, 0.4, 0.02))

    agree(densities(estimate, places), np.array([expected(*place) for place in places]))


def test_flat_prior_is_flat_in_the_parameters_own_unit():
    """The distribution of a slope within bounds, integrated over the sampler's coordinate."""
    estimate = ij.fit(line(errors(), fixed=("x0",), bounds={"x_dot0": (0.3, 1.2)}))
    density = density_of(estimate)
    at = jnp.linspace(-12.0, 12.0, 4001)[:, None]
    values = jax.jit(jax.vmap(lambda x: density.values(x)[0]))(at)
    rows = estimate.residuals + (values - estimate.values) @ estimate.jacobian.T
    jacobian = jnp.asarray(estimate.jacobian)

    @jax.jit
    @jax.vmap
    def of_density(x, row):
        return density.log_density(x, Answer(row, estimate.impacts, jacobian))

    logs, slopes = of_density(at, rows)
    weights = np.exp(np.asarray(logs - jnp.max(logs)))
    below = np.cumsum(weights) / np.sum(weights)
    own = stats.t(len(TS) - 1, float(estimate.values[0]), float(estimate.standard_errors[0]))
    ends = own.cdf([0.3, 1.2])
    expected = (own.cdf(np.asarray(values[:, 0])) - ends[0]) / (ends[1] - ends[0])
    np.testing.assert_allclose(below, expected, atol=2e-3)
    numeric = np.gradient(np.asarray(logs), np.asarray(at[:, 0]))
    np.testing.assert_allclose(slopes[1:-1, 0], numeric[1:-1], rtol=1e-3, atol=1e-3)


def test_failed_simulation_has_density_zero():
    estimate = fitted()
    density, lost = density_of(estimate), jnp.full_like(estimate.residuals, jnp.nan)
    answer = Answer(lost, estimate.impacts, jnp.full_like(estimate.jacobian, jnp.nan))
    logarithm, gradient = density.log_density(jnp.zeros(2), answer)
    assert float(logarithm) == -np.inf
    np.testing.assert_array_equal(gradient, 0.0)


def check_quantiles(found: np.ndarray, expected: np.ndarray) -> None:
    """Checks quantiles 0.025, 0.25, 0.5, 0.75, 0.975 of draws, within their chance."""
    unit = (expected[3] - expected[1]) / 1.35
    allowed = unit * np.array([0.35, 0.18, 0.15, 0.18, 0.35])
    quantiles = np.quantile(found, LEVELS)
    assert np.all(np.abs(quantiles - expected) < allowed), (quantiles, expected)


def test_draws_of_a_line_are_students_and_compile_once(monkeypatch):
    traced, done = [], []
    own = Density.potential
    monkeypatch.setattr(Density, "potential", lambda self, at: traced.append(1) or own(self, at))
    estimate = fitted()
    tree = ij.posterior(
        estimate, DRAWS, warmup=200, progress=lambda one, all_: done.append((one, all_))
    )
    once = len(traced)
    other = ij.fit(line(errors(5)))
    again = ij.posterior(other, DRAWS, warmup=200, seed=1)
    assert (once > 0, len(traced)) == (True, once)
    assert (done[0], done[-1]) == ((50, 700), (700, 700))
    for found, each in ((tree, estimate), (again, other)):
        assert found["posterior"].sizes == {"chain": CHAINS, "draw": DRAWS}
        assert found["posterior"].dataset["x_dot0"].attrs["unit"] == "m/s"
        assert "no divergence" in found.attrs["diagnosis"]
        assert "Warning" not in found.attrs["diagnosis"]
        for i, name in enumerate(each.names):
            student = stats.t(len(TS) - 2, each.values[i], each.standard_errors[i])
            expected = student.ppf(LEVELS)
            check_quantiles(draws_of(found, name), expected)
    assert set(tree["sample_stats"]) >= {"lp", "diverging", "energy", "n_steps", "step_size"}


def _through_zero(values: np.ndarray) -> tuple[float, float]:
    """Slope of a line through the origin, and its standard error."""
    slope = np.sum(TS * values) / np.sum(TS**2)
    left = values - slope * TS
    return slope, np.sqrt(np.sum(left**2) / (len(TS) - 1) / np.sum(TS**2))


@thorough
def test_posterior_of_coupled_parameters_is_the_ridge():
    """Only the product of gain and speed is determined: with flat priors within bounds that do not
    cut the ridge, the gain's density is proportional to 1/gain.
    """
    low, high = 0.5, 4.0
    estimate = ij.fit(
        line(
            errors(3),
            initial=ij.InitialState(0.0, 0.5),
            sensor=ij.Sensor(offset=LEVEL),
            fixed=("x0",),
            free=("gain",),
            bounds={"gain": (low, high), "x_dot0": (0.05, 10.0)},
        )
    )
    tree = ij.posterior(estimate, DRAWS, warmup=500)
    gain, speed = (draws_of(tree, name) for name in ("gain", "x_dot0"))
    expected = low * (high / low) ** LEVELS
    check_quantiles(gain, expected)
    product = stats.t(len(TS) - 1, *_through_zero(recorded(3) - LEVEL))
    check_quantiles(gain * speed, product.ppf(LEVELS))
    assert np.corrcoef(np.log(gain.ravel()), np.log(speed.ravel()))[0, 1] < -0.98


@thorough
def test_draws_of_a_joint_estimate_with_prior_knowledge():
    """The level of a line, against the integral over its slope on a grid."""
    known = ij.Normal(0.4, 0.02)
    estimate = ij.fit_together([line(errors(), priors={"x0": known})])
    level, slope = np.meshgrid(np.linspace(0.2, 0.6, 1001), np.linspace(-1, 3, 801), indexing="ij")
    left = sum((level + slope * t - x) ** 2 for t, x in zip(TS, recorded(1), strict=True))
    density = np.exp(stats.norm.logpdf(level, 0.4, 0.02)) * left ** (-len(TS) / 2)
    below = np.cumsum(np.sum(density, axis=1)) / np.sum(density)
    found = draws_of(ij.posterior(estimate, DRAWS, warmup=200), "x0")
    check_quantiles(found, np.interp(LEVELS, below, level[:, 0]))


@thorough
def test_posterior_of_a_compliant_contact_agrees_with_its_profile():
    pendulum = ij.Pendulum(13.0, 0.02, length=0.071)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(600.0, 0.2)))
    ts = np.linspace(0.0, 0.7, 141)
    motion = ij.simulate(model, ij.InitialState(0.78), ts).position
    noise = 1e-3 * np.random.default_rng(0).standard_normal(141)
    known = ("theta0", "theta_dot0", "omega_n", "zeta")
    experiment = ij.Experiment(
        model, ij.Recording(ts, motion + noise, ij.Angle()), ij.InitialState(0.78), fixed=known
    )
    estimate = ij.profiled(ij.fit(experiment))
    tree = ij.posterior(estimate, 300, warmup=200)
    for name in estimate.names:
        own = estimate[name]
        found = np.quantile(draws_of(tree, name), [0.025, 0.975])
        np.testing.assert_allclose(found, (own.low, own.high), atol=0.15 * (own.high - own.low))


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"outcome": np.int32(ij.Outcome.MAX_ITERATIONS)}, "no posterior: not converged"),
        ({"high": np.array([np.inf, 1.0])}, "does not bound `x0` from above"),
        ({"low": np.array([0.1, -np.inf])}, "does not bound `x_dot0` from below"),
    ],
)
def test_posterior_refuses_estimates_without_one(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        ij.posterior(dataclasses.replace(fitted(), **changed))


def test_posterior_refuses_other_losses_and_scatter():
    robust = dataclasses.replace(fitted().problem, loss=ij.Cauchy(0.1))
    with pytest.raises(ValueError, match=r"with `loss=Squares\(\)`"):
        ij.posterior(dataclasses.replace(fitted(), problem=robust))
    none = np.zeros(())
    scatter = ij.Scatter(none, none, none, np.zeros(1), np.zeros((len(TS), 2)))
    with pytest.raises(ValueError, match=r"scatter=NoScatter\(\)"):
        ij.posterior(dataclasses.replace(fitted(), scatter=scatter))


@pytest.mark.parametrize(("name", "value"), [("draws", 3), ("chains", 1), ("warmup", -1)])
def test_posterior_refuses_counts(name, value):
    with pytest.raises(ValueError, match=f"`{name}` must be at least"):
        ij.posterior(fitted(), **{name: value})


def test_posterior_says_which_packages_it_needs(monkeypatch):
    monkeypatch.setitem(sys.modules, "numpyro", None)
    with pytest.raises(ImportError, match=r"pip install 'impactjax\[posterior\]'"):
        ij.posterior(fitted())
