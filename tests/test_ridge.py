"""Profiles of two parameters, against closed forms; their figures, and those of one parameter."""

import equinox as eqx
import numpy as np
import pytest
from scipy import stats

import impactjax as ij
from closed_form import ANY, POSITIVE, fitted
from estimates import TS, line
from impactjax._identify.pair_inflation import PairInflation

T = np.linspace(0.2, 2.0, 10)
SIGMA = 0.05
DATA = 2.0 * T + SIGMA * np.random.default_rng(1).standard_normal(len(T))


@pytest.fixture(scope="module")
def product():
    """The ridge of two parameters of which the data tell the product."""
    estimate = fitted(lambda p: p[0] * p[1] * T, [POSITIVE, POSITIVE], DATA, SIGMA, [1.0, 2.0])
    return estimate, ij.ridge(estimate, "p0", "p1", points=(25, 15))


def test_ridge_of_product_is_a_hyperbola(product):
    _, found = product
    most_likely, error = (DATA @ T) / (T @ T), SIGMA / np.sqrt(T @ T)
    np.testing.assert_allclose(found.first * found.valley, most_likely, rtol=2e-3)
    assert found.first[-1] / found.first[0] > 1e3
    both = found.first[:, None] * found.second
    np.testing.assert_allclose(
        found.rise, ((both - most_likely) / error) ** 2, rtol=1e-2, atol=2e-2
    )
    assert found.rise.shape == (25, 15)
    assert (found.rise[:, [0, -1]] > found.threshold()).all()
    assert found.inside().any(axis=1).all()


def test_ridge_of_line_is_an_ellipse():
    values, estimate = line()
    since = TS - TS[0]
    design = np.stack([np.ones_like(since), since], axis=1)
    best, squares, *_ = np.linalg.lstsq(design, values, rcond=None)
    precision = design.T @ design * (len(TS) - 2) / squares[0]
    found = ij.ridge(estimate, "x0", "x_dot0", points=(23, 11))
    first = np.broadcast_to(found.first[:, None], found.second.shape)
    away = np.stack([first, found.second], axis=-1) - best
    expected = np.einsum("...i,ij,...j->...", away, precision, away)
    np.testing.assert_allclose(found.rise, expected, rtol=1e-3, atol=1e-4)
    freedom = float(estimate.freedom)
    for confidence in (0.683, 0.95):
        expected = 2 * stats.f.ppf(confidence, 2, freedom)
        assert found.threshold(confidence) == pytest.approx(expected, rel=1e-9)
    half = np.sqrt(found.threshold() * np.linalg.inv(precision)[0, 0])
    assert best[0] - 1.4 * half < found.first[0] < best[0] - half
    assert (found.rise[:, [0, -1]] > found.threshold()).all()


def test_ridge_is_continued(product):
    estimate, few = product
    many = ij.ridge(estimate, "p0", "p1", points=(31, 15), known=few)
    assert many.rise.shape == (31, 15)
    rows = np.searchsorted(many.first, few.first)
    np.testing.assert_array_equal(many.first[rows], few.first)
    np.testing.assert_array_equal(many.second[rows], few.second)
    np.testing.assert_array_equal(many.rise[rows], few.rise)
    error = SIGMA / np.sqrt(T @ T)
    expected = ((many.first[:, None] * many.second - (DATA @ T) / (T @ T)) / error) ** 2
    np.testing.assert_allclose(many.rise, expected, rtol=1e-2, atol=2e-2)


def test_ridge_at_a_bound_of_another_parameter():
    """Rows whose rise has a kink, where a third parameter reaches the end of its range."""
    from_zero = POSITIVE._replace(excludes_low=False)
    random = np.random.default_rng(0)
    mixed = [[1.0, 0.2, 0.9], [0.0, 1.0, 0.3], [0.0, 0.0, 0.4]]
    rows = random.standard_normal((12, 3)) @ mixed
    data = rows @ [1.0, 1.0, 0.05] + SIGMA * random.standard_normal(12)

    def function(p):
        return rows @ p

    found = fitted(function, [ANY, ANY, from_zero], data, SIGMA, [0.9, 0.9, 0.1])
    ridge = ij.ridge(found, "p0", "p1", points=(9, 9))
    first = np.broadcast_to(ridge.first[:, None], ridge.second.shape)
    left = data - first[..., None] * rows[:, 0] - ridge.second[..., None] * rows[:, 1]
    third = np.maximum(left @ rows[:, 2] / (rows[:, 2] @ rows[:, 2]), 0.0)
    squares = ((left - third[..., None] * rows[:, 2]) ** 2).sum(axis=-1)
    lowest = 2 * float(found.start_costs.min())
    np.testing.assert_allclose(ridge.rise, (squares - lowest) / SIGMA**2, rtol=1e-2, atol=1e-2)
    np.testing.assert_allclose(ridge.values[..., 2], third, atol=1e-3)
    assert (third == 0).any()
    assert (ridge.rise[1:-1, [0, -1]] > ridge.threshold()).all()


def test_correlated_residuals_widen_region_by_direction():
    """A quadratic rise becomes that of the covariance; of a smaller one than for independent
    residuals it stays.
    """
    plain = np.array([[4.0, 1.0], [1.0, 2.0]])
    covariance = np.linalg.inv(plain) @ np.diag([2.0, 5.0])
    covariance = (covariance + covariance.T) / 2 + 0.3 * np.eye(2)
    precision = np.linalg.inv(covariance)
    inflation = PairInflation(np.array([1.0, 2.0]), plain, precision, 1.0)
    angles = np.linspace(0, np.pi, 7)
    away = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    rise = np.einsum("ni,ij,nj->n", away, plain, away)
    expected = np.einsum("ni,ij,nj->n", away, precision, away)
    np.testing.assert_allclose(rise / inflation.at(away + inflation.centre), expected)
    assert inflation.largest >= (rise / expected).max()
    smaller = inflation._replace(precision=2 * plain)
    np.testing.assert_allclose(smaller.at(away + smaller.centre), 1.0)
    unknown = inflation._replace(precision=np.full((2, 2), np.nan), least=3.0)
    np.testing.assert_allclose(unknown.at(away), 3.0)


def test_inflated_estimate_has_wider_curves():
    _, estimate = line()
    wide = eqx.tree_at(
        lambda e: (e.covariance, e.standard_errors, e.inflation),
        estimate,
        (4 * estimate.covariance, 2 * estimate.standard_errors, 2 * estimate.inflation),
    )
    plain, wider = (ij.profiles(e, "x0", points=9)["x0"] for e in (estimate, wide))
    assert wider.high - wider.low == pytest.approx(2 * (plain.high - plain.low), rel=1e-2)

    def quantity(system):
        return system.initial.position

    told = ij.predicted(wide, quantity, points=9)
    np.testing.assert_allclose([told.low, told.high], [wider.low, wider.high], rtol=1e-2)
    ridge = ij.ridge(wide, "x0", "x_dot0", points=(7, 7))
    same = ij.ridge(estimate, "x0", "x_dot0", points=(7, 7))
    np.testing.assert_allclose(np.ptp(ridge.first), 2 * np.ptp(same.first), rtol=1e-2)


def test_figures_of_profiles(product):
    from matplotlib.figure import Figure

    _, estimate = line()
    figure = Figure()
    axes = figure.subplots(1, 3)
    each = ij.profiles(estimate, "x0", points=9)["x0"]
    ax = ij.plot.profile(axes[0], each)
    assert ax.get_xlabel() == "x0 [m]"
    assert ax.get_title() == "bounded"
    _, found = product
    ax = ij.plot.ridge(axes[1], found, theory=lambda first: 2.0 / first)
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    (low, high), region = ax.get_xlim(), found.first
    assert low < region[0] < region[-1] < high
    drawn = next(x for x in ax.lines if x.get_label() == "theory")
    x, y = map(np.asarray, drawn.get_data())
    np.testing.assert_allclose(x * y, 2.0)
    ij.plot.ridge(axes[2], ij.ridge(estimate, "x0", "x_dot0", points=(7, 7)))
    figure.savefig("/dev/null", format="png")
