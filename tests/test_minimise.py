"""The optimiser in its own coordinates: its starts, and what it does where data leave a choice."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import linalg, optimize

import impactjax as ij
from estimates import line, swing
from impactjax._fit.search import bounds_of
from impactjax._optimise.bounds import to_range, to_unbounded
from impactjax._optimise.coordinates import limits, slope, to_coordinate, to_value
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.linearisation import Linearisation, linearise
from impactjax._optimise.minimiser import Bounds, Minimiser, Objective, Point
from impactjax._parameter import Range
from tiers import quick, thorough

RANGES = {
    "any": Range("1", -math.inf, math.inf, False, False),
    "positive": Range("1", 0.0, math.inf, True, False),
    "at least 2": Range("1", 2.0, math.inf, False, False),
    "at most 2": Range("1", -math.inf, 2.0, False, False),
    "share": Range("1", 0.0, 1.0, False, False),
}


@pytest.mark.parametrize("name", RANGES)
@pytest.mark.parametrize("distance", [1e-12, 1e-3, 0.3, 1e4, 1e12])
def test_bounds_round_trip(name, distance):
    allowed = RANGES[name]
    if math.isfinite(allowed.high) and math.isfinite(allowed.low):
        distance = distance / (1 + distance)
    value = allowed.low + distance if math.isfinite(allowed.low) else -distance
    for there, back in ((to_unbounded, to_range), (to_coordinate, to_value)):
        again = back(allowed, there(allowed, jnp.asarray(value)))
        assert float(again) == pytest.approx(value, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("name", RANGES)
@pytest.mark.parametrize("distance", [1e-3, 0.3, 0.9])
def test_slope_of_coordinate(name, distance):
    """Against JAX; at the end of a closed range it is 1, so that a search can leave it."""
    allowed = RANGES[name]
    value = allowed.low + distance if math.isfinite(allowed.low) else -distance
    u = to_coordinate(allowed, jnp.asarray(value))
    expected = jax.grad(lambda u: to_value(allowed, u))(u)
    assert float(slope(allowed, u)) == pytest.approx(float(expected), rel=1e-12)
    if not allowed.excludes_low:
        ends = [x for x in (limits(allowed).low, limits(allowed).high) if math.isfinite(x)]
        assert [float(slope(allowed, np.float64(x))) for x in ends] == [1.0] * len(ends)


@pytest.mark.parametrize("name", RANGES)
def test_limits_of_coordinate_are_those_of_range(name):
    allowed, found = RANGES[name], limits(RANGES[name])
    with np.errstate(over="ignore"):
        low, high = (float(to_value(allowed, np.float64(x))) for x in (found.low, found.high))
    assert (low, high) == (allowed.low, allowed.high)


def test_excluded_end_of_a_range_is_infinitely_far():
    assert to_coordinate(RANGES["positive"], np.array(0.0)) == -np.inf


def test_step_changes_large_value_by_a_factor():
    """Or the search would never get anywhere in units in which the value is large."""
    allowed = RANGES["at least 2"]
    u = to_coordinate(allowed, jnp.asarray(1e6))
    assert float(to_value(allowed, u + 1)) == pytest.approx(math.e * 1e6, rel=1e-5)


def unbounded(count, xp):
    """Parameters without limits."""
    far = xp.full(count, xp.inf)
    return Bounds(xp.ones(count, bool), -far, far, far, far)


@pytest.mark.parametrize("xp", [np, jnp], ids=["NumPy", "JAX"])
@pytest.mark.parametrize("slope", [3e-4, 3e-3, 1.0])
def test_lm_bounds_jointly_identified_parameters(slope, xp):
    """One equation, u₀ + s u₁ = 1: scaled by curvature alone u₁ would be 1/2 s."""
    row = xp.asarray([1.0, slope])

    def around(u, left, part):
        return linearise(left**2 / 2, left[None], row[None])

    nothing = Linearisation(xp.asarray(xp.inf), xp.zeros(2), xp.zeros((2, 2)))
    minimiser = Minimiser(
        LevenbergMarquardt(),
        Objective(around, xp.asarray([1e-8])),
        unbounded(2, xp)._replace(usual=xp.ones(2)),
        Point(xp.zeros(2), xp.zeros(()), nothing),
    )
    with np.errstate(all="ignore"):
        state = minimiser.init(xp.zeros(2))
        while not state.done:
            state = minimiser.step(state, xp.asarray(row @ state.trial - 1))
    found = state.minimum
    assert isinstance(found.u, np.ndarray if xp is np else jax.Array)
    assert bool(found.converged)
    assert float(row @ found.u) == pytest.approx(1.0, abs=1e-3)
    assert np.all(np.abs(found.u) < 4)


@quick
@pytest.mark.parametrize("least", [-4e-14, 1e-3, 1e-90, 5e-324])
@pytest.mark.parametrize("power", [1, 2], ids=["line", "parabola"])
def test_a_parameter_without_limits_may_begin_near_zero(power, least):
    """A slope that begins at about zero; against SciPy's minimum."""
    ts = np.linspace(0.0, 1.0, 30)
    record = 0.3 + 0.7 * ts + 0.05 * np.random.default_rng(2).standard_normal(30)
    begun = np.array([1.0, least])

    def residuals(u):
        return u[0] ** power + u[1] * ts - record

    def around(u, left, part):
        slopes = np.stack([power * u[0] ** (power - 1) * np.ones(30), ts], axis=1)
        return linearise(left @ left / 2, left, slopes)

    bounds = bounds_of([RANGES["any"]] * 2, begun, np.ones(2, bool))
    nothing = Linearisation(np.asarray(np.inf), np.zeros(2), np.zeros((2, 2)))
    point = Point(np.zeros(2), np.zeros(30), nothing)
    objective = Objective(around, np.asarray([1e-10]))
    minimiser = Minimiser(LevenbergMarquardt(reduction=1e-10), objective, bounds, point)
    with np.errstate(all="ignore"):
        state = minimiser.init(begun)
        while not state.done:
            state = minimiser.step(state, residuals(state.trial))
    expected = optimize.least_squares(residuals, begun, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert bool(state.minimum.converged)
    np.testing.assert_allclose(state.minimum.u, expected.x, atol=1e-4)


@pytest.mark.parametrize("xp", [np, jnp], ids=["NumPy", "JAX"])
@pytest.mark.parametrize("seed", range(20))
def test_search_ends_at_minimum_within_bounds(seed, xp):
    """Linear residuals with correlated columns, where some of six parameters end at a bound;
    against SciPy's solution. The search takes a few steps, as without bounds.
    """
    random = np.random.default_rng(seed)
    jacobian = random.standard_normal((20, 6)) @ random.standard_normal((6, 6))
    record = jacobian @ random.standard_normal(6) + random.standard_normal(20)
    low, high = -random.uniform(0, 1, 6), random.uniform(0, 1, 6)
    expected = optimize.lsq_linear(jacobian, record, (low, high), tol=1e-14)

    def around(u, left, part):
        return linearise(left @ left / 2, left, xp.asarray(jacobian))

    far = xp.full(6, xp.inf)
    bounds = Bounds(xp.ones(6, bool), xp.asarray(low), xp.asarray(high), far, far)
    nothing = Linearisation(xp.asarray(xp.inf), xp.zeros(6), xp.zeros((6, 6)))
    objective = Objective(around, xp.asarray([1e-10]))
    point = Point(xp.zeros(6), xp.zeros(20), nothing)
    minimiser = Minimiser(LevenbergMarquardt(reduction=1e-10), objective, bounds, point)
    with np.errstate(all="ignore"):
        state = minimiser.init(xp.zeros(6))
        while not state.done:
            state = minimiser.step(state, xp.asarray(jacobian @ state.trial - record))
    found = state.minimum
    assert bool(found.converged)
    assert int(found.iterations) <= 25
    assert float(found.cost) == pytest.approx(expected.cost, rel=1e-8)
    np.testing.assert_allclose(found.u, expected.x, atol=1e-4)
    assert np.all((found.u >= low) & (found.u <= high))


@pytest.mark.parametrize("xp", [np, jnp], ids=["NumPy", "JAX"])
@pytest.mark.parametrize("damping", [0.0, 1e-3, 10.0])
def test_damped_step_solves_augmented_least_squares(damping, xp):
    """With two nearly parallel columns, one without effect and one held; against SciPy's SVD."""
    random = np.random.default_rng(3)
    jacobian = random.standard_normal((30, 5))
    jacobian[:, 1] = jacobian[:, 0] + 1e-3 * jacobian[:, 1]
    jacobian[:, 3] = 0.0
    residuals = random.standard_normal(30)
    lengths = np.linalg.norm(jacobian, axis=0)
    weights = np.where(np.arange(5) == 4, 0.0, lengths)
    model = linearise(xp.asarray(0.0), xp.asarray(residuals), xp.asarray(jacobian))
    moves = [0, 1, 2]
    below = np.sqrt(damping + 1e-12) * np.diag(lengths[moves])
    augmented = np.concatenate([jacobian[:, moves], below])
    expected = linalg.pinv(augmented, rtol=1e-15) @ -np.append(residuals, np.zeros(3))
    step = model.step(xp.asarray(weights), damping)
    np.testing.assert_allclose(step[np.array(moves)], expected, rtol=1e-8)
    np.testing.assert_array_equal(step[np.array([3, 4])], 0.0)
    if damping > 0:
        found = model.gradient_after(xp.asarray(weights), damping)
        floor = 1e-6 * float(np.max(np.abs(model.gradient)))
        np.testing.assert_allclose(found, -damping * weights**2 * step, atol=floor)
        np.testing.assert_allclose(found[:3], model.moved(step).gradient[:3], atol=floor)
    left = residuals + jacobian @ np.asarray(step)
    floor = 1e-12 * np.sum((lengths * np.asarray(step)) ** 2)
    gain = (residuals @ residuals - left @ left - floor) / 2
    assert float(model.decrease(step)) == pytest.approx(gain, rel=1e-8)


def searched(around, evaluate, start=0.0, most=150, reduction=1e-8):
    """The minimum of a function of one number."""
    nothing = Linearisation(np.array(np.inf), np.zeros(1), np.zeros((1, 1)))
    minimiser = Minimiser(
        LevenbergMarquardt(max_iterations=most),
        Objective(around, np.array([reduction])),
        unbounded(1, np),
        Point(np.zeros(1), np.zeros(1), nothing),
    )
    with np.errstate(all="ignore"):
        state = minimiser.init(np.array([start]))
        while not state.done:
            state = minimiser.step(state, evaluate(state.trial))
    return state.minimum


@quick
def test_outcome_names_the_cause():
    def linear(u, left, part):
        return linearise(left @ left / 2, left, np.ones((1, 1)))

    def uphill(u, left, part):
        return linearise(left @ left / 2, left, -np.ones((1, 1)))

    def curved(u):
        return np.array([1.0]) + u**4

    found = {
        ij.Outcome.CONVERGED: searched(linear, lambda u: u - 1),
        ij.Outcome.MAX_ITERATIONS: searched(linear, curved, start=1.0, most=3),
        ij.Outcome.NO_DESCENT: searched(uphill, lambda u: u - 1, reduction=0.0),
        ij.Outcome.NOT_SIMULATED: searched(linear, lambda u: np.nan * u),
    }
    assert {code: int(each.outcome) for code, each in found.items()} == {c: int(c) for c in found}
    assert [code for code, each in found.items() if each.converged] == [ij.Outcome.CONVERGED]


@thorough
def test_scattered_starts_are_inside_ranges():
    """Not at the end of a range, where a law is a special one; the first is the model's own."""
    problem = swing().problem
    lanes = np.asarray(ij.Starts(64).lanes(problem))
    r = np.array([float(problem.at(jnp.asarray(u))[problem.names.index("r")]) for u in lanes])
    assert r[0] == pytest.approx(0.5)
    assert (r > 0.01).all()
    assert (r < 0.99).all()
    assert np.ptp(r) > 0.7


@thorough
def test_fit_of_constants_inside_jit():
    """The search is part of the program, and ends at the same minimum as outside, where a rough
    search comes first.
    """
    _, expected = line()
    problem = expected.problem

    @jax.jit
    def values():
        again = ij.fit(
            ij.Experiment(
                problem.system.model,
                problem.recording,
                problem.system.initial,
                simulation=problem.simulation,
            ),
            starts=ij.Starts(4),
        )
        return again.values, again.residuals

    for found, known in zip(values(), (expected.values, expected.residuals), strict=True):
        np.testing.assert_allclose(found, known, rtol=1e-9, atol=1e-9)
