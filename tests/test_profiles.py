"""Profiles as curves, against closed forms and SciPy."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import optimize, special

import impactjax as ij
from closed_form import ANY, FROM_ZERO, POSITIVE, fitted
from estimates import TS, line
from tiers import thorough

T = np.linspace(0.2, 2.0, 10)
SIGMA = 0.05
SINCE = TS - TS[0]  # times since the start of the recording
LIMIT = special.ndtri(0.975)


def decaying(p):
    return p[0] * jnp.exp(-p[1] * T)


DECAY = 0.5 * np.exp(-1.5 * T) + SIGMA * np.random.default_rng(5).standard_normal(len(T))


def squares_of_decay(rate):
    """The lowest sum of squares at a rate of decay, by linear least squares for the amplitude."""
    shape = np.exp(-rate * T)
    return DECAY @ DECAY - (shape @ DECAY) ** 2 / (shape @ shape)


@pytest.fixture(scope="module")
def decay():
    return fitted(decaying, [ANY, ANY], DECAY, SIGMA, [0.5, 1.5])


def test_profile_of_linear_parameters_is_a_parabola():
    values, found = line()
    design = np.stack([np.ones_like(SINCE), SINCE], axis=1)
    best, squares, *_ = np.linalg.lstsq(design, values, rcond=None)
    covariance = squares[0] / (len(TS) - 2) * np.linalg.inv(design.T @ design)
    curves = ij.profiles(found)
    assert list(curves) == ["x0", "x_dot0"]
    own = ij.profiled(found)
    for j, each in enumerate(curves.values()):
        expected = (each.at - best[j]) ** 2 / covariance[j, j]
        inflation = max(float(found.inflation[j]), 1.0)
        np.testing.assert_allclose(each.rise * inflation**2, expected, rtol=1e-4, atol=1e-5)
        assert each.at.shape == each.rise.shape == (41,)
        assert (np.diff(each.at) > 0).all()
        assert each.shape is ij.ProfileShape.BOUNDED
        half = np.sqrt(each.threshold * covariance[j, j]) * inflation
        np.testing.assert_allclose([each.low, each.high], best[j] + np.array([-half, half]), 1e-3)
        ends = [float(own.low[j]), float(own.high[j])]
        np.testing.assert_allclose([each.low, each.high], ends, atol=0.02 * half)
        np.testing.assert_allclose(each.values[:, j], each.at)


def test_profile_of_nonlinear_parameter(decay):
    """The amplitude is fitted in closed form."""
    each = ij.profiles(decay, "p1")["p1"]
    best: Any = optimize.minimize_scalar(squares_of_decay, bracket=(1.0, 2.0), tol=1e-12)

    def rise(rate):
        return (squares_of_decay(rate) - best.fun) / SIGMA**2

    expected = np.array([rise(rate) for rate in each.at])
    np.testing.assert_allclose(each.rise, expected, atol=2e-3, rtol=2e-3)
    ends: list[Any] = [
        optimize.brentq(lambda rate: rise(rate) - LIMIT**2, best.x, end) for end in (0.0, 20.0)
    ]
    low, high = ends
    assert high - best.x > 1.25 * (best.x - low)  # far from a parabola
    np.testing.assert_allclose([each.low, each.high], [low, high], atol=2e-3 * (high - low))
    shape = np.exp(-each.at[:, None] * T)
    amplitude = (shape @ DECAY) / (shape**2).sum(axis=1)
    np.testing.assert_allclose(each.values[:, 0], amplitude, rtol=1e-2)
    found = ij.profiled(decay)
    ends = [float(found.low[1]), float(found.high[1])]
    np.testing.assert_allclose([each.low, each.high], ends, atol=0.01 * (high - low))


def test_profile_is_continued(decay):
    few = ij.profiles(decay, "p1", points=11)
    many = ij.profiles(decay, "p1", points=31, known=few)
    assert len(few["p1"].at) == 11
    assert len(many["p1"].at) == 31
    places = np.searchsorted(many["p1"].at, few["p1"].at)
    np.testing.assert_array_equal(many["p1"].at[places], few["p1"].at)
    np.testing.assert_array_equal(many["p1"].rise[places], few["p1"].rise)


@thorough
def test_profile_of_product_is_flat():
    data = 2.0 * T + SIGMA * np.random.default_rng(1).standard_normal(len(T))
    found = fitted(lambda p: p[0] * p[1] * T, [POSITIVE, POSITIVE], data, SIGMA, [1.0, 2.0])
    for each in ij.profiles(found, points=9).values():
        assert each.shape is ij.ProfileShape.FLAT
        assert (each.low, each.high) == (0.0, np.inf)
        np.testing.assert_allclose(each.rise, 0.0, atol=1e-3)
        np.testing.assert_allclose(each.values.prod(axis=1), (data @ T) / (T @ T), rtol=1e-3)
        assert each.at[-1] / each.at[0] > 1e3


def test_profile_at_end_of_range_is_open():
    """A slope that would be negative, if it were not bounded by zero."""
    data = 1.0 - 0.03 * T + SIGMA * np.random.default_rng(2).standard_normal(len(T))
    found = fitted(lambda p: p[0] + p[1] * T, [ANY, FROM_ZERO], data, SIGMA, [1.0, 0.1])
    each = ij.profiles(found, "p1")["p1"]
    assert each.shape is ij.ProfileShape.OPEN_BELOW
    assert each.low == 0.0
    centred = T - T.mean()

    def squares(slope):
        return np.sum((data - data.mean() - slope * centred) ** 2)

    high = optimize.brentq(lambda x: (squares(x) - squares(0.0)) / SIGMA**2 - LIMIT**2, 0.0, 1.0)
    assert each.high == pytest.approx(high, rel=1e-3)


@pytest.mark.parametrize("slope", [0.1, 0.02])
@pytest.mark.parametrize(
    "allowed",
    [POSITIVE._replace(fades=True, power=-1.0), POSITIVE._replace(power=-0.4)],
    ids=["fades", "stiffness"],
)
def test_profile_of_parameter_with_straight_power(allowed, slope):
    """The data are linear in a power, and tell from zero whether the larger one is."""
    data = slope * T + SIGMA * np.random.default_rng(4).standard_normal(len(T))
    data += (slope - (data @ T) / (T @ T)) * T
    power, begin = allowed.power, 0.125 ** (1 / allowed.power)
    found = fitted(lambda p: T * p[0] ** power + 0 * p[1], [allowed, ANY], data, SIGMA, [begin, 0])
    each = ij.profiles(found, "p0", points=21)["p0"]
    error = SIGMA / np.sqrt(T @ T)
    assert (np.diff(each.at) > 0).all()
    np.testing.assert_allclose(each.rise, ((each.at**power - slope) / error) ** 2, atol=1e-3)
    assert each.low**power == pytest.approx(slope + LIMIT * error, rel=1e-3)
    assert found.low[0] ** power == pytest.approx(slope + LIMIT * error, rel=1e-2)  # linearised
    if slope > LIMIT * error:
        assert each.high**power == pytest.approx(slope - LIMIT * error, rel=5e-3)
        assert each.shape is ij.ProfileShape.BOUNDED
    else:
        assert each.high == np.inf
        assert each.shape is ij.ProfileShape.OPEN_ABOVE


def test_profile_with_two_minima():
    """The square of a parameter, whose sign the data do not tell."""
    data = SIGMA * np.random.default_rng(3).standard_normal(len(T))
    data += 0.025 - data.mean()

    def function(p):
        return p[0] ** 2 + p[1] * (T - T.mean())

    each = ij.profiles(fitted(function, [ANY, ANY], data, SIGMA, [0.2, 0.0]), "p0")["p0"]
    error = SIGMA / np.sqrt(len(T))
    expected = ((each.at**2 - 0.025) / error) ** 2
    np.testing.assert_allclose(each.rise, expected, rtol=1e-2, atol=1e-2)
    assert each.shape is ij.ProfileShape.SEVERAL_MINIMA
    end = np.sqrt(0.025 + LIMIT * error)
    np.testing.assert_allclose([each.low, each.high], [-end, end], rtol=5e-3)


def test_profile_of_estimate_above_another_minimum():
    """The estimate is the higher one of two minima."""

    def function(p):
        return jnp.stack([p[0] ** 2, 0.03 * p[0], p[1]])

    found = fitted(function, [ANY, ANY], [0.015, -0.02, 0.0], 0.01, [0.2, 0.0])
    each = ij.profiles(found, "p0", points=15)["p0"]
    assert each.shape is ij.ProfileShape.SEVERAL_MINIMA
    assert np.nanmin(each.rise) < -1
    assert np.isnan([each.low, each.high]).all()


def test_profile_where_fits_fail_is_undecided():
    def function(p):
        return jnp.where(p[1] < 1.6, decaying(p), jnp.nan)

    found = fitted(function, [ANY, ANY], DECAY, SIGMA, [0.5, 1.5])
    each = ij.profiles(found, "p1", points=21)["p1"]
    assert each.shape is ij.ProfileShape.UNDECIDED
    assert np.isnan(each.high)
    assert np.isfinite(each.low)
    assert np.isnan(each.rise[-1])
    assert np.isfinite(each.rise[:-1]).all()
    assert "?" in str(each)


def test_points_above_neighbours_are_fitted_again(decay):
    """A point that a search left in the wrong place."""
    from impactjax._fit.refits import refits_of
    from impactjax._fit.search import Search
    from impactjax._identify.begun import held_parameters
    from impactjax._identify.curves import mended

    knots = ij.profiles(decay, "p1", points=15)["p1"].knots
    spoiled = knots.cost.copy()
    spoiled[[4, 5]] += 40.0 * SIGMA**2
    spoiled[7] = np.inf
    curves = held_parameters(decay, refits_of(decay, ij.LevenbergMarquardt(), Search()), ["p1"])
    (again,) = mended(curves, [knots._replace(cost=spoiled)])
    np.testing.assert_allclose(again.cost, knots.cost, atol=1e-3 * SIGMA**2)


def test_requests_without_a_profile_are_refused(decay):
    _, found = line()
    with pytest.raises(ValueError, match="`gap` was not fitted"):
        ij.profiles(found, "gap")
    with pytest.raises(ValueError, match="at least 5"):
        ij.profiles(found, points=4)
    with pytest.raises(ValueError, match="named once"):
        ij.ridge(found, "x0", "x0")
    failed = dataclasses.replace(found, outcome=jnp.int32(ij.Outcome.MAX_ITERATIONS))
    with pytest.raises(ValueError, match="took all its evaluations"):
        ij.profiles(failed)
    scattered = eqx.tree_at(lambda e: e.scatter, found, 1.0, is_leaf=lambda x: x is None)
    with pytest.raises(ValueError, match="refits would have none"):
        ij.profiles(scattered)
    with pytest.raises(ValueError, match="holds 2 fits"):
        ij.profiles(jax.tree.map(lambda x: jnp.stack([x, x]), found))
    with pytest.raises(ValueError, match="of one recording"):
        ij.predicted(decay, lambda system: jnp.zeros(()))
    with pytest.raises(ValueError, match="does not depend"):
        ij.predicted(found, lambda system: jnp.ones(()))
    with pytest.raises(ValueError, match="not finite"):
        ij.predicted(found, lambda system: system.initial.position * jnp.nan)
    with pytest.raises(ValueError, match="one number"):
        ij.predicted(found, lambda system: jnp.ones(2) * system.initial.position)


def test_prediction_of_linear_function_is_a_parabola():
    """The position at a later time, against the textbook's error of a straight line."""
    values, found = line()
    design = np.stack([np.ones_like(SINCE), SINCE], axis=1)
    best, squares, *_ = np.linalg.lstsq(design, values, rcond=None)
    covariance = squares[0] / (len(TS) - 2) * np.linalg.inv(design.T @ design)
    row = np.array([1.0, 3.0])

    def later(system):
        return system.initial.position + 3.0 * system.initial.velocity

    each = ij.predicted(found, later, name="x(3)", unit="m", points=15)
    expected = (each.at - row @ best) ** 2 / (row @ covariance @ row)
    np.testing.assert_allclose(each.rise, expected, rtol=1e-3, atol=1e-4)
    assert each.value == pytest.approx(row @ best, rel=1e-6)
    half = np.sqrt(each.threshold * (row @ covariance @ row))
    np.testing.assert_allclose([each.low, each.high], row @ best + np.array([-half, half]), 1e-3)
    np.testing.assert_allclose(each.values @ row, each.at, rtol=1e-6)
    assert str(each).startswith("x(3): ")


def test_prediction_of_nonlinear_function():
    """A power of the parameters' quotient, against SciPy's search over one of them."""
    values, found = line()

    def quotient(system):
        return system.initial.position / system.initial.velocity**2

    def squares(quotient):
        def at(velocity):
            return np.sum((values - quotient * velocity**2 - velocity * SINCE) ** 2)

        found: Any = optimize.minimize_scalar(at, bracket=(0.5, 0.8), tol=1e-12)
        return found.fun

    each = ij.predicted(found, quotient, points=11)
    lowest = squares(each.value)
    expected = [(squares(v) - lowest) / (lowest / (len(TS) - 2)) for v in each.at]
    np.testing.assert_allclose(each.rise, expected, rtol=5e-3, atol=5e-3)
    assert each.shape is ij.ProfileShape.BOUNDED


def test_known_profile_of_another_parameter_is_refused(decay):
    known = ij.profiles(decay, "p1", points=5)
    with pytest.raises(ValueError, match="has the profile of `p1` as `p0`"):
        ij.profiles(decay, "p0", points=7, known={"p0": known["p1"]})
    moved = eqx.tree_at(lambda each: each.values, decay, decay.values * 1.01)
    with pytest.raises(ValueError, match="is one of another estimate"):
        ij.profiles(moved, "p1", points=7, known=known)


def test_part_of_a_joint_estimate_has_no_profile(decay):
    """Its costs are those of the joint fit, in other units."""
    part = eqx.tree_at(lambda each: each.start_costs, decay, 400 * decay.start_costs)
    with pytest.raises(ValueError, match="a part of a joint one"):
        ij.profiles(part)
