"""Least squares against closed forms, SciPy, and the promise of a 95 % interval."""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import optimize, stats

import impactjax as ij
from estimates import SMALL, TS, line, swing

# A free mass is a straight line: all of linear regression is known in closed form.


def test_straight_line_fit_is_linear_regression():
    values, found = line()
    t = TS - TS[0]
    spread = np.sum((t - t.mean()) ** 2)
    slope = np.sum((t - t.mean()) * values) / spread
    level = values.mean() - slope * t.mean()
    assert found.names == ("x0", "x_dot0")
    assert found.units == ("m", "m/s")
    np.testing.assert_allclose(found.values, [level, slope], rtol=1e-9)
    variance = np.sum((values - level - slope * t) ** 2) / (31 - 2)
    errors = [math.sqrt(variance * (1 / 31 + t.mean() ** 2 / spread)), math.sqrt(variance / spread)]
    np.testing.assert_allclose(found.standard_errors, errors, rtol=1e-9)
    covariance = -variance * t.mean() / spread
    np.testing.assert_allclose(found.covariance[0, 1], covariance, rtol=1e-9)
    np.testing.assert_allclose(found.correlation[0, 1], covariance / math.prod(errors), rtol=1e-9)
    half = stats.t(29).ppf(0.975) * np.array(errors)
    np.testing.assert_allclose(found.high - found.values, half, rtol=1e-9)
    np.testing.assert_allclose(found.values - found.low, half, rtol=1e-9)


def test_straight_line_information_criteria():
    values, found = line()
    rms = float(found.rms)
    np.testing.assert_allclose(rms, np.sqrt(np.mean(np.asarray(found.residuals) ** 2)))
    likelihood = np.sum(stats.norm.logpdf(np.asarray(found.residuals), scale=rms))
    np.testing.assert_allclose(found.aic, 2 * 3 - 2 * likelihood, rtol=1e-12)
    np.testing.assert_allclose(found.bic, 3 * math.log(31) - 2 * likelihood, rtol=1e-12)
    model = float(found.value("x0")) + float(found.value("x_dot0")) * (TS - TS[0])
    np.testing.assert_allclose(found.residuals, model - values, atol=1e-14)


def test_profile_of_linear_problem_is_its_interval():
    _, found = line()
    profile = ij.profiled(found)
    np.testing.assert_allclose(profile.low, found.low, rtol=1e-6)
    np.testing.assert_allclose(profile.high, found.high, rtol=1e-6)
    assert [profile.verdict(name) for name in profile.names] == [ij.Verdict.IDENTIFIED] * 2


# A bouncing ball, against SciPy on a closed form of its own.

BALL_TIMES = np.linspace(0.0, 1.5, 61)
TRUTH = np.array([9.81, 0.8, 0.5])
NOISE = 2e-3


def ball(parameters: np.ndarray) -> np.ndarray:
    """Height of a ball dropped from rest, for gravity, restitution and first height."""
    gravity, r, height = parameters
    speed, begin = math.sqrt(2 * gravity * height), -math.sqrt(2 * height / gravity)
    out = np.zeros(len(BALL_TIMES))
    while begin < BALL_TIMES[-1]:
        s = BALL_TIMES - begin
        flies = (s >= 0) & (s < 2 * speed / gravity)
        out[flies] = (speed * s - gravity * s**2 / 2)[flies]
        begin, speed = begin + 2 * speed / gravity, r * speed
    return out


def noisy(count: int) -> np.ndarray:
    return ball(TRUTH) + NOISE * np.random.default_rng(7).standard_normal((count, 61))


def fit_ball(values, r):
    recording = ij.Recording(jnp.asarray(BALL_TIMES), values, ij.Displacement())
    return ij.fit(
        ij.Experiment(
            ij.ImpactOscillator(ij.BouncingBall(9.7), ij.Stop(ij.Restitution(r))),
            recording,
            ij.InitialState(0.49, 0.0),
            fixed=("x_dot0",),
            free=("gravity",),
            simulation=SMALL,
        )
    )


fit_many = jax.jit(jax.vmap(fit_ball))


@functools.cache
def replicates() -> ij.Estimate[ij.Problem]:
    """300 fits in one call of `vmap` under `jit`, from different starts."""
    return fit_many(jnp.asarray(noisy(300)), jnp.linspace(0.75, 0.85, 300))


def test_fit_agrees_with_scipy_least_squares():
    values = noisy(300)[0]
    known = optimize.least_squares(
        lambda p: ball(p) - values, TRUTH, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    covariance = np.linalg.inv(known.jac.T @ known.jac) * 2 * known.cost / (61 - 3)
    found = fit_ball(jnp.asarray(values), 0.75)
    assert found.names == ("gravity", "r", "x0")
    assert found.converged
    np.testing.assert_allclose(np.sum(np.asarray(found.residuals) ** 2), 2 * known.cost, rtol=1e-9)
    errors = np.sqrt(np.diag(covariance))
    assert np.max(np.abs(np.asarray(found.values) - known.x) / errors) < 1e-3
    np.testing.assert_allclose(found.standard_errors, errors, rtol=1e-4)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-3, atol=1e-12)


def test_fit_is_invariant_under_jit_and_vmap():
    many = replicates()
    alone = fit_ball(jnp.asarray(noisy(300)[0]), 0.75)
    for name in ("values", "standard_errors", "low", "high", "rms", "aic", "residuals"):
        np.testing.assert_allclose(
            getattr(many, name)[0], getattr(alone, name), rtol=1e-7, atol=1e-9, err_msg=name
        )


def test_interval_coverage():
    many = replicates()
    assert np.all(many.converged)
    inside = (many.low < TRUTH) & (many.high > TRUTH)
    expected = stats.binom(300, 0.95)
    for j, name in enumerate(many.names):
        count = int(np.sum(inside[:, j]))
        assert expected.ppf(1e-3) <= count <= expected.ppf(1 - 1e-3), (name, count)
    scores = (np.asarray(many.values) - TRUTH) / np.asarray(many.standard_errors)
    assert np.all(np.abs(scores.mean(axis=0)) < 3.3 / math.sqrt(300))
    assert np.all(np.abs(scores.std(axis=0) - 1) < 3.3 / math.sqrt(600))
    np.testing.assert_allclose(np.mean(many.rms**2 * 61 / 58), NOISE**2, rtol=0.04)


def test_failing_fit_does_not_change_others():
    values, starts = jnp.asarray(noisy(300)), jnp.linspace(0.75, 0.85, 300)
    broken = fit_many(values.at[5].set(jnp.nan), starts)
    others = np.arange(300) != 5
    np.testing.assert_array_equal(
        np.asarray(broken.values)[others], np.asarray(replicates().values)[others]
    )
    assert not broken.converged[5]


# A list of impact times, whose closed form is a geometric series.


def test_impact_times_give_restitution_in_closed_form():
    r, speed, start, gravity = 0.8, 1.5, 0.3, 9.80665
    times = start + 2 * speed / gravity * (1 - r ** np.arange(9)) / (1 - r)
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.7)))
    found = ij.fit(
        ij.Experiment(
            model, ij.ImpactTimes(jnp.asarray(times)), ij.InitialState(0.0, 1.4), simulation=SMALL
        )
    )
    assert found.names == ("r", "x_dot0", "t0")
    np.testing.assert_allclose(found.values, [r, speed, start], rtol=1e-7)
    assert found.rms < 1e-9


# Which parameters a record tells: a damped swing that never reaches its stop.


@pytest.mark.parametrize(
    ("name", "verdict", "word"),
    [
        ("omega_n", ij.Verdict.IDENTIFIED, "identified"),
        ("x0", ij.Verdict.IDENTIFIED, "identified"),
        ("zeta", ij.Verdict.ONE_SIDED, "one-sided"),
        ("r", ij.Verdict.NOT_IDENTIFIED, "not identified"),
        ("mass", ij.Verdict.FIXED, "fixed"),
        ("x_dot0", ij.Verdict.FIXED, "fixed"),
    ],
)
def test_all_verdicts_occur(name, verdict, word):
    found = swing().verdict(name)
    assert found is verdict
    assert str(found) == word


def test_open_interval_ends_at_range_or_infinity():
    found = swing()
    zeta, r = found.names.index("zeta"), found.names.index("r")
    assert found.low[zeta] == 0
    assert 1e-4 < found.high[zeta] < 0.05
    assert (found.low[r], found.high[r]) == (0, 1)
    assert np.isinf(found.standard_error("r"))
    assert abs(float(found.value("omega_n")) - 5) < 3 * float(found.standard_error("omega_n"))
    assert 0 < float(found.value("r")) < 1


def test_value_of_unfitted_parameter_raises():
    with pytest.raises(ValueError, match="`foo` was not fitted; omega_n, zeta, r, x0 were"):
        swing().value("foo")


def test_fixed_parameters_keep_their_values():
    found = swing()
    assert float(found.system.initial.velocity) == 0
    assert float(found.system.model.oscillator.mass) == 1
    lower = found.system.model.lower
    assert lower is not None
    assert float(lower.gap) == 2


def test_estimate_prints_values_and_verdicts():
    lines = str(swing()).splitlines()
    assert lines[0].startswith("omega_n = ")
    assert "± " in lines[0]
    assert lines[0].endswith("rad/s (identified)")
    assert lines[-1].startswith("rms residual 0.0")
    assert lines[-1].endswith(", converged")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"fixed": ("x9",)}, "no parameter `x9`; there are mass, x0"),
        ({"free": ("r",)}, "no parameter `r`"),
        ({"fixed": "mass"}, "`fixed` must be a list of names"),
        ({"fixed": ("mass",), "free": ("mass",)}, "`mass` is in both `fixed` and `free`"),
        ({"free": ("x0",), "ties": {"x0": lambda at: at["mass"]}}, "in both `free` and `ties`"),
        ({"ties": {"x0": lambda at: at["x0"]}}, "tie of `x0` asks for 'x0', which is no parameter"),
        ({"ties": {"x0": lambda at: at["foo"]}}, "asks for 'foo', which is no parameter"),
        ({"ties": {"x0": lambda at: jnp.ones(2)}}, "gives shape .2,., not one number"),
        ({"free": ("gain", "offset", "mass", "t0")}, "4 observations, too few for 6 parameters"),
    ],
)
def test_impossible_fits_are_refused(arguments, words):
    recording = ij.Recording(jnp.arange(4.0), jnp.arange(4.0), ij.Displacement())
    with pytest.raises((TypeError, ValueError), match=words):
        ij.fit(
            ij.Experiment(
                ij.ImpactOscillator(ij.FreeMass()), recording, ij.InitialState(0.0), **arguments
            )
        )


def test_velocity_of_launch_from_stop_is_bounded():
    # Faster is expected from lower, and lower is inside the stop: that is no reason to give up.
    ts = np.linspace(0.0, 0.7, 71)
    flies = 2 * 1.5 / 9.81
    after = ts - flies
    height = np.where(after < 0, 1.5 * ts - 9.81 * ts**2 / 2, 1.2 * after - 9.81 * after**2 / 2)
    height = np.maximum(height, 0) + 5e-4 * np.random.default_rng(0).standard_normal(71)
    recording = ij.Recording(jnp.asarray(ts[:50]), jnp.asarray(height[:50]), ij.Displacement())
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(ij.Restitution(0.7)))
    start = ij.InitialState(1e-4, 1.5)
    found = ij.profiled(ij.fit(ij.Experiment(model, recording, start, simulation=SMALL)))
    assert found.verdict("x_dot0") == ij.Verdict.IDENTIFIED
    low, high = (float(ends[found.names.index("x_dot0")]) for ends in (found.low, found.high))
    assert low < 1.5 < high < 1.51


@pytest.mark.parametrize(
    ("quantity", "words"),
    [
        (ij.Angle(), "A record of angle does not suit a FreeMass"),
        (ij.ContactForce(), "no contact force"),
    ],
)
def test_record_of_missing_quantity_is_refused(quantity, words):
    recording = ij.Recording(jnp.arange(4.0), jnp.arange(4.0), quantity)
    model = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.Restitution(0.5)))
    with pytest.raises(ValueError, match=words):
        ij.fit(ij.Experiment(model, recording, ij.InitialState(1.0)))


def test_scale_compatible_with_zero_has_no_linearised_bound():
    """Stiffness beyond what the samples resolve: the small-error interval would end above only."""
    found = ij.fit(
        ij.Experiment(
            ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.KelvinVoigt(4e4, 0.05))),
            ij.ImpactTimes(0.1 + 2 * 1.5 / 9.80665 * (1 - 0.8 ** np.arange(9)) / 0.2),
            ij.InitialState(0.0, 1.5),
            simulation=ij.Simulation(max_steps=128, max_impacts=16),
        )
    )
    place = found.names.index("omega0")
    if float(found.standard_error("omega0")) > float(found.value("omega0")):
        assert found.verdict("omega0") is ij.Verdict.NOT_IDENTIFIED
        assert (float(found.low[place]), float(found.high[place])) == (0, math.inf)


def test_fit_without_free_parameters_is_refused():
    recording = ij.Recording(jnp.arange(3.0), jnp.arange(3.0), ij.Displacement())
    model, start = ij.ImpactOscillator(ij.FreeMass()), ij.InitialState(0.0, 1.0)
    with pytest.raises(ValueError, match="all are fixed"):
        ij.fit(ij.Experiment(model, recording, start, fixed=("x0", "x_dot0")))
