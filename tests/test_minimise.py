"""The optimiser in its own coordinates: its starts, and what it does where data leave a choice."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import line, swing
from impactjax._optimise.bounds import to_range, to_unbounded
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.minimiser import Bounds, Minimiser, Objective, Point, Quadratic
from impactjax._parameter import Range
from tiers import thorough

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
    back = to_range(allowed, to_unbounded(allowed, jnp.asarray(value)))
    assert float(back) == pytest.approx(value, rel=1e-9, abs=1e-11)


def test_step_changes_large_value_by_a_factor():
    """Or the search would never get anywhere in units in which the value is large."""
    u = to_unbounded(RANGES["at least 2"], jnp.asarray(1e6))
    assert float(to_range(RANGES["at least 2"], u + 1)) == pytest.approx(math.e * 1e6, rel=1e-5)


@pytest.mark.parametrize("xp", [np, jnp], ids=["NumPy", "JAX"])
@pytest.mark.parametrize("slope", [3e-4, 3e-3, 1.0])
def test_lm_bounds_jointly_identified_parameters(slope, xp):
    """One equation, u₀ + s u₁ = 1: scaled by curvature alone u₁ would be 1/2 s."""
    row = xp.asarray([1.0, slope])

    def around(u, left, part):
        return Quadratic(left**2 / 2, left * row, row[:, None] * row[None, :])

    nothing = Quadratic(xp.asarray(xp.inf), xp.zeros(2), xp.zeros((2, 2)))
    minimiser = Minimiser(
        LevenbergMarquardt(),
        Objective(around, lambda u: u, xp.asarray([1e-8])),
        Bounds(xp.ones(2, bool), xp.full(2, xp.inf), xp.ones(2)),
        Point(xp.zeros(2), xp.zeros(()), nothing),
    )
    with np.errstate(all="ignore"):
        state = minimiser.begin(xp.zeros(2))
        while not state.ended:
            state = minimiser.told(state, xp.asarray(row @ state.trial - 1))
    found = state.minimum
    assert isinstance(found.u, np.ndarray if xp is np else jax.Array)
    assert bool(found.converged)
    assert float(row @ found.u) == pytest.approx(1.0, abs=1e-3)
    assert np.all(np.abs(found.u) < 4)


@thorough
def test_scattered_starts_are_inside_ranges():
    """Not at the end of a range, where the search would stay; the first is the model's own."""
    problem = swing().problem
    lanes = np.asarray(ij.Starts(64).lanes(problem))
    r = np.array([float(problem.values(jnp.asarray(u))[problem.names.index("r")]) for u in lanes])
    assert r[0] == pytest.approx(0.5)
    assert (r > 0.01).all()
    assert (r < 0.99).all()
    assert np.ptp(r) > 0.7


def test_fit_of_constants_inside_jit():
    """The search is part of the program, and finds what it finds outside."""
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
        np.testing.assert_allclose(found, known, rtol=1e-12, atol=1e-14)
