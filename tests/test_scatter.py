"""Restitution that scatters from impact to impact, against the closed form of a bouncing ball."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate, stats

import impactjax as ij
from impactjax._fit.mixed_model import Observed, OwnNoise, mixed_model, whitened
from tiers import mostly_thorough, quick, thorough

GRAVITY, R, SPEED = 9.80665, 0.9, 3.0
BOUNCES = 12
FEW = ij.Simulation(max_steps=128)


def bounce_times(rng, scatter, clock=5e-5, bounces=BOUNCES):
    """Times of a ball whose speed after each impact has a random factor."""
    logs = np.log(R) + scatter * rng.standard_normal(bounces - 2)
    flights = 2 * SPEED / GRAVITY * np.exp(np.concatenate([[0.0], np.cumsum(logs)]))
    return np.concatenate([[0.0], np.cumsum(flights)]) + clock * rng.standard_normal(bounces)


def experiment(times, **more):
    model = ij.ImpactOscillator(ij.BouncingBall(GRAVITY), ij.Stop(ij.Restitution(R)))
    start = ij.InitialState(0.0, SPEED)
    return ij.Experiment(model, ij.ImpactTimes(times), start, simulation=FEW, **more)


# The factors of `simulate`.


def ball_at(values, law):
    """Position at 1.9 s of a ball dropped from 1 m, with a factor for each of its first impacts."""
    model = ij.ImpactOscillator(ij.BouncingBall(GRAVITY), ij.Stop(law(values[0])))
    run = ij.simulate(model, ij.InitialState(1.0), jnp.array([0.0, 1.9]), factors=values[1:])
    return run.position[-1]


def closed_form(values):
    """The same in closed form: three impacts of a rigid stop before 1.9 s."""
    r, *factors = values
    speed = np.sqrt(2 * GRAVITY)
    now, t = 0.0, speed / GRAVITY
    for factor in (*factors, 1.0)[:3]:
        speed = r * factor * speed
        now, t = t, t + 2 * speed / GRAVITY
    left = 1.9 - now
    return speed * left - GRAVITY * left**2 / 2


POINT = np.array([0.8, 1.02, 0.97])


def test_factors_multiply_separation_speeds():
    value = ball_at(jnp.array(POINT), ij.Restitution)
    assert value == pytest.approx(closed_form(POINT), abs=1e-12)


@pytest.mark.parametrize("derivative", mostly_thorough([jax.jacfwd, jax.jacrev], jax.jacfwd))
def test_derivatives_by_factors_are_exact(derivative):
    found = derivative(ball_at)(jnp.array(POINT), ij.Restitution)
    complex_step = [
        np.imag(closed_form(POINT + 1e-30j * axis)) / 1e-30 for axis in np.eye(len(POINT))
    ]
    np.testing.assert_allclose(found, complex_step, rtol=1e-11)


@pytest.mark.parametrize(
    "law", [ij.KelvinVoigt(500.0, 0.1), pytest.param(ij.Hertz(1e6), marks=thorough)]
)
def test_factor_scales_the_restitution_of_a_contact(law):
    model = ij.ImpactOscillator(ij.BouncingBall(GRAVITY), ij.Stop(law))

    @eqx.filter_jit
    def restitution(factors):
        run = ij.simulate(model, ij.InitialState(1.0), jnp.array([0.0, 0.9]), factors=factors)
        return run.impacts.separation_speed[0] / run.impacts.approach_speed[0]

    plain, scaled = restitution(jnp.array([1.0])), restitution(jnp.array([0.93]))
    assert scaled / plain == pytest.approx(0.93, rel=1e-9)


# The mixed model, against its definition: matrices inverted, and the ratio integrated by SciPy.


LEFT = 9 - 2 - 2 + 3 / 7  # degrees of freedom of the small model


def small_model():
    rng = np.random.default_rng(3)
    jacobian, effects = rng.standard_normal((9, 2)), rng.standard_normal((9, 4))
    observed = jacobian @ [1.0, -2.0] + effects @ (0.5 * rng.standard_normal(4))
    return observed + 0.3 * rng.standard_normal(9), jacobian, effects


def generalised(observed, jacobian, effects, ratio):
    """Generalised least squares: values, matrix of their scales, sum of squares, log-likelihood."""
    spread = np.eye(9) + ratio * effects @ effects.T
    inverse = np.linalg.inv(spread)
    information = jacobian.T @ inverse @ jacobian
    values = np.linalg.solve(information, jacobian.T @ inverse @ observed)
    left = observed - jacobian @ values
    squares = left @ inverse @ left
    determinants = np.linalg.slogdet(spread)[1] + np.linalg.slogdet(information)[1]
    return values, np.linalg.inv(information), squares, -determinants / 2 - 3.5 * np.log(squares)


def solved(arrays=np.asarray):
    observed, jacobian, effects = (arrays(x) for x in small_model())
    zero = 0.0 * observed[0]
    return mixed_model(Observed(observed, jacobian, effects, zero + 9.0, OwnNoise(zero, zero)))


@quick
def test_mixed_model_solves_generalised_least_squares():
    found = solved()
    for i in (0, 20, 47):
        values, scales, squares, _ = generalised(*small_model(), found.ratios[i])
        np.testing.assert_allclose(found.values[i], values, rtol=1e-10)
        np.testing.assert_allclose(found.scales[i], scales * squares / LEFT, rtol=1e-9)
        assert found.squares[i] == pytest.approx(squares, rel=1e-10)


@quick
def test_mixed_model_integrates_over_the_ratio():
    """Expectation and quantile of a parameter, with the ratio integrated adaptively."""
    model, found = small_model(), solved()
    basis = np.linalg.qr(model[1], mode="complete")[0][:, 2:]
    strengths = np.linalg.svd(basis.T @ model[2], compute_uv=False) ** 2
    most, least = strengths[0], strengths[-1]

    def density(log_ratio):
        ratio = np.exp(log_ratio)
        prior = ratio * most / (1 + ratio * most) / np.sqrt(1 + ratio * least)
        return prior * np.exp(generalised(*model, ratio)[3])

    ends = np.log(1e-4 / most), np.log(1e4 / least)

    def expected(function):
        whole = integrate.quad(density, *ends, limit=200)[0]
        return integrate.quad(lambda x: density(x) * function(x), *ends, limit=200)[0] / whole

    mean = expected(lambda x: generalised(*model, np.exp(x))[0][0])
    assert found.value[0] == pytest.approx(mean, rel=1e-5)
    place = found.quantile(0.975)[0]

    def below(log_ratio):
        values, scales, squares, _ = generalised(*model, np.exp(log_ratio))
        return stats.t.cdf((place - values[0]) / np.sqrt(scales[0, 0] * squares / LEFT), LEFT)

    assert expected(below) == pytest.approx(0.975, abs=2e-4)

    def smaller(log_ratio):
        squares = generalised(*model, np.exp(log_ratio))[2]
        return stats.chi2.sf(np.exp(log_ratio) * squares / found.size(0.5) ** 2, LEFT)

    assert expected(smaller) == pytest.approx(0.5, abs=2e-3)


@quick
def test_whitened_columns_have_the_inverse_covariance():
    _, jacobian, effects = small_model()
    found = whitened(jacobian, effects, np.float64(0.7))
    inverse = np.linalg.inv(np.eye(9) + 0.7 * effects @ effects.T)
    np.testing.assert_allclose(found.T @ found, jacobian.T @ inverse @ jacobian, rtol=1e-10)


@quick
def test_whitening_by_an_infinite_ratio_leaves_what_no_effect_reaches():
    _, jacobian, effects = small_model()
    effects = np.concatenate([effects, np.zeros((9, 1))], axis=1)
    found = whitened(jacobian, effects, np.float64(np.inf))
    beside = jacobian - effects @ np.linalg.lstsq(effects, jacobian)[0]
    np.testing.assert_allclose(found, beside, atol=1e-12)


@quick
def test_traced_mixed_model_equals_that_in_numpy():
    with jax.enable_x64(True):
        traced, plain = jax.jit(lambda: solved(jnp.asarray))(), solved()
    np.testing.assert_allclose(traced.value, plain.value, rtol=1e-10)
    np.testing.assert_allclose(traced.quantile(0.025), plain.quantile(0.025), rtol=1e-6)
    np.testing.assert_allclose(traced.size(0.975), plain.size(0.975), rtol=1e-6)


# Fits.


@eqx.filter_jit
@eqx.filter_vmap(in_axes=(0, None))
def fits(times, scatter):
    found = ij.fit(experiment(times, scatter=scatter))
    return found.values, found.low, found.high, found.scatter


def covered(fitted):
    return np.mean((fitted[1][:, 0] <= R) & (fitted[2][:, 0] >= R))


def records(scatter, count=80):
    rng = np.random.default_rng(11)
    return jnp.asarray([bounce_times(rng, scatter) for _ in range(count)])


@thorough
def test_intervals_hold_where_restitution_scatters():
    """Without scatter in the model, two of three intervals miss the truth."""
    times = records(0.01)
    found = fits(times, ij.NormalScatter())
    assert covered(found) >= 0.85
    size = found[3]
    assert np.mean((size.low <= 0.01) & (size.high >= 0.01)) >= 0.87
    assert np.median(size.size) == pytest.approx(0.01, rel=0.15)
    assert covered(fits(times, ij.NoScatter())) < 0.6


@thorough
def test_jit_and_host_agree_on_scatter():
    times = records(0.01, count=1)
    values, low, high, size = fits(times, ij.NormalScatter())
    found = ij.fit(experiment(times[0]))
    differences = np.abs(np.asarray(found.values) - np.asarray(values[0]))
    assert np.all(differences < 1e-3 * np.asarray(found.standard_errors))
    np.testing.assert_allclose(found.low, low[0], rtol=1e-6)
    np.testing.assert_allclose(found.high, high[0], rtol=1e-6)
    assert found.scatter is not None
    np.testing.assert_allclose(found.scatter.high, size.high[0], rtol=1e-4)


def test_scatter_is_found_where_it_is():
    rng = np.random.default_rng(5)
    found = ij.fit(experiment(jnp.asarray(bounce_times(rng, 0.01))))
    assert found.scatter is not None
    assert found.scatter.low > 0
    assert "scatter from impact to impact" in str(found)
    low, high = found.scatter.single
    assert low * high == pytest.approx(1.0)
    assert high == pytest.approx(np.exp(1.96 * found.scatter.size), rel=1e-4)
    told = ij.identifiability(found)
    np.testing.assert_allclose(told.bounds, found.standard_errors, rtol=1e-6)
    steady = ij.fit(experiment(jnp.asarray(bounce_times(rng, 0.0))))
    assert "less than" in str(steady)


def test_scatter_of_a_recorded_motion():
    """Heights of the ball at 500 Hz, with a factor for each of 13 impacts or more."""
    rng = np.random.default_rng(9)
    ts, scatter, noise = np.arange(2200) / 500, 0.02, 1e-3
    logs = np.log(R) + scatter * rng.standard_normal(24)
    speeds = SPEED * np.exp(np.concatenate([[0.0], np.cumsum(logs)]))
    begins = np.concatenate([[0.0], np.cumsum(2 * speeds / GRAVITY)])
    flight = np.searchsorted(begins, ts, side="right") - 1
    left = ts - begins[flight]
    heights = speeds[flight] * left - GRAVITY * left**2 / 2
    recording = ij.Recording(ts, heights + noise * rng.standard_normal(2200), ij.Displacement())
    plain = experiment(np.arange(6.0))
    own = dataclasses.replace(plain, recording=recording, fixed=["x0"], scatter=ij.NormalScatter())
    found = ij.fit(own)
    assert found.converged
    assert found.scatter is not None
    assert found.scatter.low < scatter < found.scatter.high
    hit = int(flight[-1])
    told = np.asarray(found.scatter.logarithms)[: hit - 1] + np.log(found["r"].value)
    np.testing.assert_allclose(told, logs[: hit - 1], atol=2e-3)
    assert found["r"].low < R < found["r"].high
    wrong = ij.fit(dataclasses.replace(own, scatter=None))
    assert not wrong["r"].low < R < wrong["r"].high


def test_few_impact_times_have_no_scatter():
    found = ij.fit(experiment(jnp.asarray(bounce_times(np.random.default_rng(0), 0.0)[:4])))
    assert found.scatter is None


@thorough
def test_law_with_more_parameters_is_no_failure():
    """Its residual after all expected deviations may be larger than that of its special case."""
    times = bounce_times(np.random.default_rng(7), 0.01, bounces=20)
    constant = experiment(times)
    model = ij.ImpactOscillator(ij.BouncingBall(GRAVITY), ij.Stop(ij.LinearRestitution(R, 0.001)))
    linear = dataclasses.replace(constant, model=model)
    found = ij.compare({"constant": constant, "linear": linear}, starts=ij.Starts(2))
    assert all(bool(each.estimate.converged) for each in found)
    assert abs(float(found[0].estimate.aic - found[1].estimate.aic)) < 10


# Refusals.


@quick
def test_scatter_excludes_other_losses():
    with pytest.raises(ValueError, match="leave out one of them"):
        ij.build_problem(
            experiment(jnp.arange(8.0), loss=ij.Cauchy(1e-3), scatter=ij.NormalScatter())
        )
