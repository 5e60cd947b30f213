"""Fits of systems of one's own, against closed forms and records made with SciPy."""

from typing import Any, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import optimize
from scipy.integrate import solve_ivp

import impactjax as ij

TIMES = np.linspace(0.0, 2.0, 201)
SIGMA = 1e-3


class Decay(eqx.Module):
    """An exponential with a zero that is usually known."""

    size: jax.Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("V"))
    rate: jax.Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("1/s", above=0))
    zero: jax.Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("V", known=True))


def decay(part):
    return part.size * jnp.exp(-part.rate * TIMES) + part.zero


def decayed(size=2.0, rate=1.5, seed=0):
    noise = SIGMA * np.random.default_rng(seed).standard_normal(TIMES.size)
    return size * np.exp(-rate * TIMES) + 0.3 + noise


GUESS = Decay(1.0, 1.0, 0.3)


def test_fit_of_a_function_agrees_with_scipy():
    found = ij.fit_data(decay, GUESS, decayed(), sigma=SIGMA)

    def curve(t, size, rate):
        return size * np.exp(-rate * t) + 0.3

    values, covariance = optimize.curve_fit(
        curve, TIMES, decayed(), [1.0, 1.0], sigma=np.full(TIMES.size, SIGMA), absolute_sigma=True
    )
    assert found.names == ("size", "rate")
    assert found.units == ("V", "1/s")
    np.testing.assert_allclose(found.values, values, rtol=1e-7)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-4)
    assert found.verdict("rate") is ij.Verdict.IDENTIFIED
    np.testing.assert_allclose(decay(found.system), decayed(), atol=5 * SIGMA)


def test_noise_of_a_function_is_estimated_and_data_that_are_missing_do_not_count():
    record = decayed()
    whole = ij.fit_data(decay, GUESS, record, noise=ij.WhiteNoise())
    assert float(whole.rms) == pytest.approx(SIGMA, rel=0.15)
    record[::7] = np.nan
    rest = ij.fit_data(decay, GUESS, record, noise=ij.WhiteNoise())
    assert int(rest.problem.observations) == TIMES.size - 29
    np.testing.assert_allclose(rest.values, whole.values, rtol=2e-3)
    assert 1.0 < float(rest.standard_errors[0] / whole.standard_errors[0]) < 1.4


def test_priors_and_bounds_of_a_function():
    """A prior frees a known parameter, and counts as one more datum of it."""
    prior = ij.Normal(0.3, 1e-9)
    known = ij.fit_data(decay, GUESS, decayed(), sigma=SIGMA)
    found = ij.fit_data(decay, GUESS, decayed(), sigma=SIGMA, priors={"zero": prior})
    assert found.names == ("size", "rate", "zero")
    np.testing.assert_allclose(found.values[:2], known.values, rtol=1e-6)
    np.testing.assert_allclose(found.standard_errors[:2], known.standard_errors, rtol=1e-4)
    held = ij.fit_data(decay, GUESS, decayed(), sigma=SIGMA, bounds={"rate": (0.5, 1.2)})
    assert float(held.value("rate")) == pytest.approx(1.2, rel=1e-6)


def both(part):
    """An exponential and its rate, of very different size."""
    own = part.size * jnp.exp(-part.rate * TIMES)
    return jnp.stack([own, -1e3 * part.rate * own], axis=1)


def test_columns_of_a_record_have_their_own_noise():
    """The weighted fit of two columns, against SciPy's of both in one list."""
    random = np.random.default_rng(1)
    sizes, truth = np.array([1e-3, 5.0]), 2.0 * np.exp(-1.5 * TIMES)
    record = np.stack([truth, -1500.0 * truth], axis=1)
    record = record + sizes * random.standard_normal(record.shape)
    found = ij.fit_data(both, Decay(1.5, 1.2, 0.0), record, sigma=sizes)

    def scaled(p):
        return np.ravel((np.asarray(both(Decay(p[0], p[1], 0.0))) - record) / sizes)

    expected = optimize.least_squares(scaled, [1.5, 1.2], xtol=1e-12, x_scale=[1, 1])
    np.testing.assert_allclose(found.values, expected.x, rtol=1e-6)
    covariance = np.linalg.inv(expected.jac.T @ expected.jac)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-3)
    assert float(found.rms) == pytest.approx(1.0, rel=0.1)


def test_many_records_are_fitted_by_vmap():
    records = jnp.asarray([decayed(seed=seed) for seed in range(4)])
    found = jax.jit(jax.vmap(lambda each: ij.fit_data(decay, GUESS, each, sigma=SIGMA)))(records)
    for i in range(4):
        alone = ij.fit_data(decay, GUESS, records[i], sigma=SIGMA)
        np.testing.assert_allclose(found.values[i], alone.values, rtol=1e-6)


class TwoMasses(ij.AbstractMechanism):
    """Masses of 1 kg and 2 kg on springs, and a wall; the first one is launched."""

    stiffness: jax.Array = eqx.field(
        converter=ij.as_parameter, metadata=ij.parameter("N/m", above=0)
    )
    between: ij.Restitution
    wall: ij.Restitution
    speed: jax.Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("m/s"))

    def mass_matrix(self, q):
        return jnp.diag(jnp.array([1.0, 2.0]))

    def potential(self, t, q):
        return self.stiffness * (q @ q) / 2

    def force(self, t, q, v):
        return jnp.zeros(2)

    def contacts(self):
        gap = ij.Contact(lambda q: 0.1 + q[1] - q[0], self.between)
        return [gap, ij.Contact(lambda q: q[0] + 0.1, self.wall)]


TRUTH = {"stiffness": 100.0, "speed": 4.0, "between_r": 0.8, "wall_r": 0.7}


def places(masses):
    system = ij.MechanicalSystem(masses)
    start = system.start(0.0, jnp.zeros(2), masses.speed * jnp.array([1.0, 0.0]))
    step = ij.TaylorStep(order=8)  # compiles faster than the usual one
    return ij.solve(system, start, jnp.asarray(TIMES), step=step).ys.q


def record_of_masses(seed):
    """Both places, by SciPy, restarted at each impact."""

    def rates(t, y):
        return [y[2], y[3], -100.0 * y[0], -50.0 * y[1]]

    def gap(t, y):
        return 0.1 + y[1] - y[0]

    def wall(t, y):
        return y[0] + 0.1

    for event in (gap, wall):
        vars(event).update(terminal=True, direction=-1)
    t, y, found = 0.0, np.array([0.0, 0.0, 4.0, 0.0]), np.zeros((TIMES.size, 2))
    while t < TIMES[-1]:
        run = solve_ivp(
            rates,
            (t, 2.0),
            y,
            "DOP853",
            rtol=1e-11,
            atol=1e-12,
            events=[gap, wall],
            dense_output=True,
        )
        inside = (t <= TIMES) & (run.t[-1] >= TIMES)
        found[inside] = run.sol(TIMES[inside])[:2].T
        t, y = run.t[-1], run.y[:, -1].copy()
        if run.status == 1 and run.t_events[0].size:
            impulse = -1.8 * (y[3] - y[2]) / 1.5
            y[2:] += impulse * np.array([-1.0, 0.5])
        elif run.status == 1:
            y[2] *= -0.7
    return found + SIGMA * np.random.default_rng(seed).standard_normal(found.shape)


def test_fit_of_a_mechanism_finds_its_parameters_by_name():
    """Three records, one program: each value within its error, intervals by profiles as well."""
    guess = TwoMasses(102.0, ij.Restitution(0.7), ij.Restitution(0.6), 3.9)
    fits = [ij.fit_data(places, guess, record_of_masses(i), sigma=SIGMA) for i in range(3)]
    for found in fits:
        assert set(found.names) == set(TRUTH)
        assert bool(found.usable)
        for name, truth in TRUTH.items():
            assert abs(found[name].value - truth) < 4 * found[name].standard_error, name
        assert found.verdict("wall_r") is ij.Verdict.IDENTIFIED
        assert float(found.rms) == pytest.approx(SIGMA, rel=0.1)
    told, profiled = ij.identifiability(fits[0]), ij.profiled(fits[0])
    assert told.names == fits[0].names
    np.testing.assert_allclose(told.bounds, fits[0].standard_errors, rtol=1e-3)
    np.testing.assert_allclose(profiled.low, fits[0].low, rtol=1e-3)


class Both(eqx.Module):
    """Two parts, and a field that is called as a parameter of one of them."""

    wall: ij.Restitution
    between: ij.Restitution
    wall_r: jax.Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("1"))


def test_two_parameters_of_one_name_are_refused():
    both = Both(ij.Restitution(0.5), ij.Restitution(0.6), 0.7)
    with pytest.raises(ValueError, match="Two parameters are called `wall_r`"):
        ij.fit_data(lambda both: both.wall_r * TIMES, both, TIMES)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"record": np.zeros((2, 2, 2))}, "a list of numbers, or of rows of them"),
        ({"record": [1.0, 2.0]}, "2 data, too few for 2 parameters"),
        ({"record": decayed()[:-1]}, r"must return the shape of the record, \(200,\)"),
        ({"sigma": -1.0}, "`sigma` must be positive"),
        ({"sigma": [1.0, 2.0]}, "one number, one for each column or one for each datum"),
        ({"part": Decay(1.0, -1.0, 0.3)}, "`rate` must be finite and greater than 0"),
        ({"fixed": ["size", "rate"]}, "no parameter that is left free"),
        ({"fixed": ["sizes"]}, "no parameter `sizes`"),
        ({"fixed": ["zero"], "free": ["zero"]}, "`zero` is in `fixed` and is to be fitted"),
        ({"bounds": {"rate": (2.0, 3.0)}}, "starts at 1, outside its bounds"),
        ({"bounds": {"zero": (0.0, 1.0)}}, "no parameter `zero`"),
    ],
)
def test_wrong_request_is_one_sentence(changed, sentence):
    arguments = {"part": GUESS, "record": decayed(), **changed}
    with pytest.raises(ValueError, match=sentence):
        ij.fit_data(decay, **arguments)


def test_data_that_cannot_be_computed_are_not_simulated():
    found = ij.fit_data(lambda part: part.size * jnp.sqrt(-part.rate) * TIMES, GUESS, decayed())
    assert found.cause == "not simulated: the residuals are not finite"


def test_prediction_of_a_function():
    """The zero of the exponential's tangent at the start: size/rate, by its profile."""
    found = ij.fit_data(decay, GUESS, decayed(), sigma=SIGMA)
    profile = ij.predicted(found, lambda part: part.size / part.rate, points=9)
    size, rate = found.values
    slopes = np.array([1 / rate, -size / rate**2])
    error = np.sqrt(slopes @ found.covariance @ slopes)
    assert profile.value == pytest.approx(size / rate, rel=1e-9)
    assert profile.high - profile.low == pytest.approx(2 * 1.96 * error, rel=1e-3)


def test_estimate_of_data_is_refused_where_a_recording_is_needed(tmp_path):
    found = ij.fit_data(decay, GUESS, decayed(), sigma=SIGMA)
    with pytest.raises(ValueError, match="tested for one recording fitted by `fit`"):
        ij.left_out(cast(Any, found))
    with pytest.raises(ValueError, match="saved if `fit` has fitted one recording"):
        ij.io.save(tmp_path / "a.npz", cast(Any, found))
