"""Periodic orbits and their branches at closed forms."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.figure import Figure

import impactjax as ij
from forced_systems import (
    GRAVITY,
    MODEL_V,
    OMEGA,
    REST,
    TRACED,
    Below,
    Circle,
    Kicked,
    ModelV,
    Table,
)
from impactjax._response.linear import linearised
from model_v import closed_form


def amplitude(system):
    return system.amplitude


def in_order(multipliers):
    """Multipliers in an order that rounding does not change."""
    return np.array(sorted(multipliers, key=lambda each: (round(each.real, 6), each.imag)))


def special(branch, kind):
    return [each for each in branch.special if each.kind == kind]


@functools.cache
def orbit_of_model_v(omega, amplitude):
    system = ModelV(jnp.array(amplitude), jnp.array(omega))
    return ij.periodic_orbit(system, REST, ModelV.period, multiple=2, settle=300)


@functools.cache
def branch_of_model_v(omega, first):
    return ij.follow(orbit_of_model_v(omega, first), amplitude, (0.3, 0.45))


@pytest.fixture(scope="module")
def ladder():
    """The branch from its grazing over a period doubling to larger amplitudes."""
    return branch_of_model_v(0.81, 0.36)


@pytest.mark.parametrize(("omega", "first"), [(0.81, 0.36), (0.799, 0.363)])
def test_orbit_and_its_multipliers(omega, first):
    exact = closed_form(str(omega), 2)
    found = orbit_of_model_v(omega, first)
    assert found.result == ij.RESULTS.successful
    assert found.stability == "stable"
    assert found.residual < 1e-13
    np.testing.assert_array_equal(found.events.transition, [0])
    speed = found.events.before["v"][0]
    np.testing.assert_allclose(exact.amplitude(speed), first, rtol=1e-12)
    reference = in_order(exact.multipliers(speed))
    np.testing.assert_allclose(in_order(found.multipliers), reference, atol=1e-10)


def test_multipliers_against_differences():
    orbit = orbit_of_model_v(0.81, 0.36)
    begin = np.asarray(orbit.start.t) + orbit.period / 4  # away from the impact
    at = ij.solve(MODEL_V, orbit.start, begin[None], tolerance=1e-12).ys
    size, weights = 2e-3, {1: 2 / 3, 2: -1 / 12}

    def after(x, v):
        start = ij.Start(begin, {"x": at["x"][0] + x, "v": at["v"][0] + v})
        run = ij.solve(MODEL_V, start, begin[None] + orbit.period, tolerance=1e-12)
        return np.array([run.ys["x"][0], run.ys["v"][0]])

    columns = [
        sum(w * (after(*(n * step)) - after(*(-n * step))) for n, w in weights.items()) / size
        for step in size * np.eye(2)
    ]
    found = np.linalg.eigvals(np.column_stack(columns))
    np.testing.assert_allclose(in_order(orbit.multipliers), in_order(found), atol=1e-8)


@pytest.mark.parametrize(("omega", "first"), [(0.81, 0.36), (0.80089, 0.365)])
def test_period_doubling_and_grazing_of_model_v(omega, first):
    exact, found = closed_form(str(omega), 2), branch_of_model_v(omega, first)
    (doubling,) = special(found, "period doubling")
    speed = exact.doubling()
    np.testing.assert_allclose(doubling.parameter, exact.amplitude(speed), rtol=1e-12)
    np.testing.assert_allclose(doubling.orbit.events.before["v"], [float(speed)], rtol=1e-9)
    np.testing.assert_allclose(doubling.orbit.multipliers, exact.multipliers(speed), atol=1e-9)
    assert not special(found, "fold")
    assert found.special[0].kind == "grazing"
    np.testing.assert_allclose(found.special[0].parameter, exact.amplitude(0), rtol=1e-12)
    assert found.complete


@pytest.mark.parametrize(("omega", "first"), [(0.799, 0.363), (0.799741, 0.365)])
def test_fold_and_grazing_of_model_v(omega, first):
    exact, found = closed_form(str(omega), 2), branch_of_model_v(omega, first)
    (fold,) = special(found, "fold")
    speed = exact.fold()
    np.testing.assert_allclose(fold.parameter, exact.amplitude(speed), rtol=1e-12)
    np.testing.assert_allclose(fold.orbit.events.before["v"], [float(speed)], rtol=1e-10)
    np.testing.assert_allclose(fold.orbit.multipliers, exact.multipliers(speed), atol=1e-10)
    assert not special(found, "period doubling")
    np.testing.assert_allclose(found.special[0].parameter, exact.amplitude(0), rtol=1e-12)


def test_points_of_a_branch(ladder):
    exact = closed_form("0.81", 2)
    speeds = ladder.before["v"][:, 0]
    amplitudes = [exact.amplitude(speed) for speed in speeds]
    np.testing.assert_allclose(ladder.parameter, amplitudes, rtol=1e-12)
    (doubling,) = special(ladder, "period doubling")
    assert not ladder.stable[: doubling.place].any()
    assert ladder.stable[doubling.place + 1 :].all()
    assert ladder.orbit(3).result == ij.RESULTS.successful


def test_figure_of_a_branch(ladder):
    """A dashed line up to the period doubling, then a solid one; two kinds of markers."""
    ax = Figure().subplots()
    ij.plot.branch(ax, ladder, ladder.before["v"][:, 0])
    (doubling,) = special(ladder, "period doubling")
    solid, dashed = ax.lines[:2]
    assert np.nanmin(solid.get_xdata()) == doubling.parameter
    assert np.nanmax(dashed.get_xdata()) == doubling.parameter
    assert ax.get_legend_handles_labels()[1] == ["grazing", "period doubling"]


def test_doubled_orbit_leads_back_to_the_period_doubling(ladder):
    (doubling,) = special(ladder, "period doubling")
    orbit = ij.doubled(doubling.orbit)
    assert orbit.result == ij.RESULTS.successful
    assert orbit.multiple == 4
    assert np.ptp(orbit.events.before["v"]) > 1e-3
    branch = ij.follow(orbit, amplitude, (0.3, 0.45))
    back = branch.special[-1]
    assert back.kind == "period doubling"
    np.testing.assert_allclose(back.parameter, doubling.parameter, rtol=1e-10)
    times = orbit.start.t + orbit.period * np.array([0.2, 1.2])
    run = ij.solve(orbit.system, orbit.start, times, tolerance=1e-12)
    np.testing.assert_allclose(run.ys["v"][0], run.ys["v"][1], atol=1e-9)


def test_values_and_parameters_cause_no_retrace(ladder):
    before = len(TRACED)
    again = branch_of_model_v(0.8, 0.37)
    ij.follow(again.orbit(5), lambda system: system.frequency, (0.79, 0.82))
    assert len(TRACED) == before


def test_jacobian_against_differences(ladder):
    """By times, states, durations and the frequency, on which the period depends."""
    branch = ij.follow(ladder.orbit(9), lambda system: system.frequency, (0.8, 0.82))
    linear = branch.points[4].linear
    size, columns = 1e-5, []
    for step in size * np.eye(linear.unknowns.size):
        ends = [linearised(linear.cycle, linear.unknowns + sign * step) for sign in (1, -1)]
        columns.append((ends[0].residual - ends[1].residual) / (2 * size))
    np.testing.assert_allclose(linear.jacobian(), np.column_stack(columns), atol=1e-5)


def test_ball_on_a_vibrating_table():
    """Holmes, J. Sound Vib. 84 (1982) 173: period 1 between a fold and a period doubling."""
    system = Table(jnp.array(0.008))
    orbit = ij.periodic_orbit(system, ij.Start(0.0, {"h": 0.01, "v": 8.0}), 1 / 60, settle=300)
    lag = np.pi * GRAVITY * (1 - 0.5) / (1 + 0.5)
    phase = OMEGA * orbit.events.t[0]
    np.testing.assert_allclose(0.008 * OMEGA**2 * np.cos(phase), lag, rtol=1e-12)
    branch = ij.follow(orbit, amplitude, (0.005, 0.012))
    (fold,), (doubling,) = special(branch, "fold"), special(branch, "period doubling")
    np.testing.assert_allclose(fold.parameter, lag / OMEGA**2, rtol=1e-12)
    across = 2 * GRAVITY * (1 + 0.5**2) / (1 + 0.5) ** 2
    np.testing.assert_allclose(doubling.parameter, np.hypot(lag, across) / OMEGA**2, rtol=1e-12)


def test_neimark_sacker_of_the_delayed_logistic_map():
    orbit = ij.periodic_orbit(
        Kicked(jnp.array(1.8)), ij.Start(0.0, jnp.array([0.4, 0.4])), 1.0, settle=100
    )
    branch = ij.follow(orbit, lambda system: system.rate, (1.1, 3.0))
    assert [each.kind for each in branch.special][1:-1] == ["Neimark-Sacker"]
    found = branch.special[1]
    np.testing.assert_allclose(found.parameter, 2.0, rtol=1e-12)
    np.testing.assert_allclose(np.real(found.orbit.multipliers), [0.5, 0.5], atol=1e-12)
    np.testing.assert_allclose(branch.before[:, 0, 0], 1 - 1 / branch.parameter, rtol=1e-12)


def test_closed_branch():
    """Fixed points on the circle y² + a² = 1, with folds at a = ±1."""
    orbit = ij.periodic_orbit(Circle(jnp.array(0.5)), ij.Start(0.0, -0.8), 1.0)
    branch = ij.follow(orbit, lambda system: system.a, (-2.0, 2.0), longest=0.2)
    assert branch.complete
    assert sorted(each.kind for each in branch.special) == ["fold", "fold"]
    folds = [each.parameter for each in branch.special]
    np.testing.assert_allclose(np.sort(folds), [-1.0, 1.0], rtol=1e-12)
    around = np.unwrap(np.arctan2(branch.before[:, 0], branch.parameter))
    np.testing.assert_allclose(branch.before[:, 0] ** 2 + branch.parameter**2, 1.0, rtol=1e-12)
    assert abs(around[-1] - around[0]) > 2 * np.pi - 0.2


def test_grazing_of_the_linear_oscillator():
    """The amplitude of the oscillation reaches 1 at A = |(1 − ω²) + 0.1 iω|."""
    start = ij.Start(0.0, (0.0, 0.0))
    orbit = ij.periodic_orbit(Below(jnp.array(0.05), jnp.array(1.0)), start, Below.period)
    assert orbit.events.t.size == 0
    np.testing.assert_allclose(np.abs(orbit.multipliers), np.exp(-0.05 * 2 * np.pi), rtol=1e-12)
    grazing = ij.follow(orbit, amplitude, (0.01, 0.5)).special[-1]
    assert grazing.kind == "grazing"
    np.testing.assert_allclose(grazing.parameter, 0.1, rtol=1e-12)
    orbit = ij.periodic_orbit(Below(jnp.array(0.2), jnp.array(0.6)), start, Below.period)
    grazing = ij.follow(orbit, lambda system: system.frequency, (0.4, 1.0)).special[-1]
    o = grazing.parameter
    np.testing.assert_allclose(np.hypot(1 - o**2, 0.1 * o), 0.2, rtol=1e-12)


def test_square_root_beyond_a_grazing():
    """Above the grazing, the impact speed on the oscillation a sin t is √(a² − 1)."""
    excess = np.logspace(-8, -2, 13)

    def impact(amplitude):
        system, start = Below(amplitude, jnp.array(1.0)), ij.Start(0.0, (0.0, 10 * amplitude))
        run = ij.solve(system, start, jnp.array([1.8]), tolerance=1e-13)
        return run.events.before[1][0], run.events.after[1][0]

    before, after = jax.jit(jax.vmap(impact))(0.1 * (1 + jnp.asarray(excess)))
    speeds = np.sqrt(excess * (2 + excess))
    np.testing.assert_allclose(before, speeds, rtol=1e-7)
    np.testing.assert_allclose(after, -0.8 * speeds, rtol=1e-7)
    exponents = np.diff(np.log(before)) / np.diff(np.log(excess))
    np.testing.assert_allclose(exponents, 0.5, atol=2e-3)
    np.testing.assert_allclose(exponents[:8], 0.5, atol=1e-4)


@pytest.mark.parametrize(
    ("omega", "amplitude", "result"),
    [(0.81, 0.3452, "another_itinerary"), (0.799, 0.3625, "no_orbit_found")],
)
def test_orbits_that_are_not_found(omega, amplitude, result):
    """Below the grazing, where impact speeds would be negative, and before the fold."""
    system = ModelV(jnp.array(amplitude), jnp.array(omega))
    start = ij.Start(0.0, {"x": -0.5, "v": 0.05})
    found = ij.periodic_orbit(system, start, ModelV.period, multiple=2)
    assert found.events.t.size == 1
    assert ij.RESULTS[found.result] == ij.RESULTS[getattr(ij.RESULTS, result)]
    with pytest.raises(ValueError, match="`orbit` was not found"):
        ij.follow(found, lambda system: system.amplitude, (0.3, 0.4))


def test_branches_refuse_wrong_arguments(ladder):
    orbit = ladder.orbit(10)
    with pytest.raises(ValueError, match="`between` must be a range around"):
        ij.follow(orbit, amplitude, (0.1, 0.2))
    with pytest.raises(ValueError, match="`between` must be two finite numbers"):
        ij.follow(orbit, amplitude, (0.3, np.inf))
    with pytest.raises(ValueError, match="`where` must select one real number"):
        ij.follow(orbit, lambda system: system, (0.1, 0.2))
    with pytest.raises(ValueError, match="must be the orbit of a period doubling"):
        ij.doubled(orbit)
    with pytest.raises(ValueError, match="`period` must be positive"):
        ij.periodic_orbit(MODEL_V, REST, -1.0)


def test_period_that_is_not_of_the_system_is_refused(ladder):
    orbit = ladder.orbit(3)
    with pytest.raises(ValueError, match="`period` is not that of the system"):
        ij.periodic_orbit(orbit.system, orbit.start, 0.9 * orbit.period)
