"""Means over repeats, against integrals by SciPy, Student's t and simulated repeats."""

import numpy as np
import pytest
from scipy import integrate, stats

from impactjax._fit.random_effects import random_effects
from tiers import quick

pytestmark = quick

VALUES, ERRORS = np.array([0.70, 0.71, 0.695]), np.array([0.004, 0.005, 0.003])
LEVELS = np.array([0.025, 0.975])


def posterior(x: float, between: float) -> np.ndarray:
    """Density of the scatter between repeats, and the distribution of the mean at that scatter."""
    weights = 1 / (ERRORS**2 + between**2)
    mean = np.sum(weights * VALUES) / np.sum(weights)
    squares = np.sum(weights * (VALUES - mean) ** 2)
    likelihood = np.sqrt(np.prod(weights) / np.sum(weights)) * np.exp(-squares / 2)
    unit = np.sqrt(3 / np.sum(1 / ERRORS**2))
    below = stats.norm.cdf(x, mean, np.sum(weights) ** -0.5)
    return np.array([likelihood / (unit + between), below])


def distribution(x: float) -> float:
    """Distribution of the mean, integrated over the scatter."""

    def part(between: float) -> float:
        density, share = posterior(x, between)
        return density * share

    def whole(between: float) -> float:
        return posterior(x, between)[0]

    parts = [(0.0, 0.02), (0.02, 0.5), (0.5, np.inf)]
    above, below = (
        sum(integrate.quad(f, *ends, limit=200)[0] for ends in parts) for f in (part, whole)
    )
    return above / below


def test_interval_of_the_mean_integrates_over_the_scatter():
    found = random_effects(VALUES, ERRORS)
    shares = [distribution(end) for end in (found.low, found.high)]
    np.testing.assert_allclose(shares, LEVELS, atol=1e-5)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_repeats_without_errors_have_the_interval_of_student(count):
    values = np.random.default_rng(count).normal(3.0, 1.0, count)
    found = random_effects(values, np.full(count, 1e-5))
    error = np.std(values, ddof=1) / np.sqrt(count)
    ends = np.mean(values) + error * stats.t.ppf(LEVELS, count - 1)
    np.testing.assert_allclose([found.low, found.high], ends, rtol=1e-4, atol=1e-4 * error)
    one = error * stats.t.ppf(stats.norm.cdf(1.0), count - 1)
    np.testing.assert_allclose(found.standard_error, one, rtol=1e-2)
    between = np.std(values, ddof=1) * np.sqrt((count - 1) / stats.chi2.ppf(1 - LEVELS, count - 1))
    np.testing.assert_allclose([found.between_low, found.between_high], between, rtol=1e-2)


def test_many_equal_repeats_have_the_error_of_the_weighted_mean():
    found = random_effects(np.full(400, 2.0), np.full(400, 0.1))
    np.testing.assert_allclose([found.mean, found.standard_error], [2.0, 0.005], rtol=0.02)
    assert found.between_low == 0
    assert found.chance == 1


def test_chance_is_that_of_the_chi_squared_distribution():
    squares = np.sum((VALUES - np.average(VALUES, weights=ERRORS**-2.0)) ** 2 / ERRORS**2)
    np.testing.assert_allclose(random_effects(VALUES, ERRORS).chance, stats.chi2.sf(squares, 2))


@pytest.mark.parametrize("count", [2, 5])
@pytest.mark.parametrize("between", [0.0, 5.0])
def test_intervals_hold_the_mean_and_the_next_repeat(count, between):
    rng, draws = np.random.default_rng(7), 200
    held = next_held = 0
    for _ in range(draws):
        errors = rng.uniform(0.7, 1.4, count)
        found = random_effects(rng.normal(0.0, np.hypot(errors, between)), errors)
        held += found.low <= 0 <= found.high
        next_held += found.single_low <= rng.normal(0.0, between) <= found.single_high
    least = 0.95 * draws - 3 * np.sqrt(0.95 * 0.05 * draws)
    assert min(held, next_held) >= least


def test_units_do_not_matter():
    plain, scaled = random_effects(VALUES, ERRORS), random_effects(1e6 * VALUES, 1e6 * ERRORS)
    np.testing.assert_allclose(np.array(scaled[:-1]) / 1e6, plain[:-1], rtol=1e-6)


@pytest.mark.parametrize(
    ("values", "errors", "words"),
    [
        ([1.0], [0.1], "at least two"),
        ([1.0, 2.0], [0.1, 0.0], "positive and finite"),
        ([1.0, 2.0], [0.1, np.inf], "positive and finite"),
    ],
)
def test_results_without_errors_are_refused(values, errors, words):
    with pytest.raises(ValueError, match=words):
        random_effects(np.array(values), np.array(errors))
