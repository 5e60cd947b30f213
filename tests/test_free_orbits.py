"""Periodic orbits of systems without a force, at closed forms and against SciPy."""

import functools

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import impactjax as ij
from forced_systems import MODEL_V, REST
from free_systems import Delayed, Escapement, Logistic, Rings, Roessler, VanDerPol

ZETA = 0.05


def firing(system, own):
    start = ij.Start(0.0, {"phase": 0.0, "own": jnp.array(own)})
    return ij.periodic_orbit(system, start, ij.AtTransition(0), settle=100)


def rate(system):
    return system.rate


def special(branch, kind):
    return [each for each in branch.special if each.kind == kind]


def test_van_der_pol():
    """Period by Taylor series of mpmath with 40 digits; the multiplier is that of the area,
    exp ∮ (1 − x²) dt.
    """
    start = ij.Start(0.0, {"x": 2.0, "v": 0.0})
    surface = ij.Through(lambda t, y, mode: y["x"])
    orbit = ij.periodic_orbit(VanDerPol(), start, surface, settle=3)
    period = 6.6632868593231301896996820305
    assert orbit.period == pytest.approx(period, rel=1e-13)
    assert orbit.stability == "stable"
    assert orbit.events.t.size == 0

    def rates(t, y):
        return [y[1], (1 - y[0] ** 2) * y[1] - y[0], 1 - y[0] ** 2]

    begin = [float(orbit.start.y["x"]), float(orbit.start.y["v"]), 0.0]
    run = solve_ivp(rates, (0, period), begin, "DOP853", rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(run.y[:2, -1], begin[:2], atol=1e-11)
    np.testing.assert_allclose(orbit.multipliers, [1.0, np.exp(run.y[2, -1])], rtol=1e-10)
    np.testing.assert_allclose(np.linalg.det(orbit.linear.monodromy()), np.exp(run.y[2, -1]))


class Clock:
    """Closed form of the escapement: its speed after a kick is multiplied by ρ in a period."""

    def __init__(self, zeta):
        self.rate = np.sqrt(1 - zeta**2)
        self.period = 2 * np.pi / self.rate
        self.square = np.exp(-2 * zeta * self.period)  # ρ², the multiplier too
        top = np.arctan2(self.rate, zeta) / self.rate
        self.reach = np.exp(-zeta * top)  # highest place, in units of the speed after a kick


@functools.cache
def escapement():
    system = Escapement(jnp.array(ZETA), jnp.array(0.1))
    start = ij.Start(0.0, {"x": -0.3, "v": 0.0})
    return ij.periodic_orbit(system, start, ij.AtTransition(1), settle=2)


def test_clock_with_a_kick():
    orbit, exact = escapement(), Clock(ZETA)
    assert orbit.result == ij.RESULTS.successful
    np.testing.assert_array_equal(orbit.events.transition, [1])
    assert orbit.period == pytest.approx(exact.period, rel=1e-13)
    speed = np.sqrt(0.1 / (1 - exact.square))
    np.testing.assert_allclose(orbit.events.after["v"], speed, rtol=1e-12)
    np.testing.assert_allclose(orbit.multipliers, [1.0, exact.square], rtol=1e-12)
    along = np.array([-speed * 2 * ZETA, speed])  # rates of v and x after the kick
    np.testing.assert_allclose(orbit.linear.monodromy() @ along, along, rtol=1e-11, atol=1e-12)


def test_clock_grazes_its_stop():
    exact = Clock(ZETA)
    branch = ij.follow(escapement(), lambda system: system.gain, (0.01, 1.0))
    (grazing,) = special(branch, "grazing")
    gain = (1 - exact.square) / exact.reach**2
    assert grazing.parameter == pytest.approx(gain, rel=1e-12)
    assert branch.special[-1].place == grazing.place
    assert branch.stable.all()
    np.testing.assert_allclose(branch.period, exact.period, rtol=1e-13)


def test_period_over_a_parameter():
    branch = ij.follow(escapement(), lambda system: system.zeta, (0.05, 0.5))
    exact = Clock(branch.parameter)
    assert branch.complete
    np.testing.assert_allclose(branch.period, exact.period, rtol=1e-13)
    np.testing.assert_allclose(np.min(np.abs(branch.multipliers), axis=1), exact.square, rtol=1e-11)
    np.testing.assert_allclose(branch.t, 0.0, atol=1e-13)


@functools.cache
def ring():
    system = Rings(jnp.array(-0.2), jnp.array(1.0))
    surface = ij.Through(lambda t, y, mode: -y[1])
    orbit = ij.periodic_orbit(system, ij.Start(0.0, jnp.array([1.0, 0.0])), surface, settle=2)
    return ij.follow(orbit, lambda system: system.a, (-0.3, -0.1))


def test_fold_of_a_smooth_system():
    """Circles a = r⁴ − r², with a fold at a = −1/4 behind which they are unstable."""
    branch = ring()
    (fold,) = special(branch, "fold")
    assert fold.parameter == pytest.approx(-0.25, rel=1e-12)
    np.testing.assert_allclose(fold.orbit.multipliers, [1.0, 1.0], atol=1e-7)
    square = np.sum(branch.before**2, axis=(1, 2))
    np.testing.assert_allclose(branch.parameter, square**2 - square, rtol=1e-11)
    np.testing.assert_allclose(branch.period, 2 * np.pi / (1 + square), rtol=1e-12)
    other = np.exp(branch.period * (2 * square - 4 * square**2))
    found = np.sort(np.abs(branch.multipliers), axis=1)
    np.testing.assert_allclose(found, np.sort([np.ones_like(other), other], axis=0).T, rtol=1e-9)
    np.testing.assert_array_equal(branch.stable, other < 1)
    ends = branch.orbit(0), branch.orbit(len(square) - 1)
    assert sorted(each.stability for each in ends) == ["stable", "unstable"]


def test_folds_in_two_parameters():
    (fold,) = special(ring(), "fold")
    found = ij.special_curve(fold, lambda system: system.b, (0.8, 1.3), (-0.6, -0.1))
    assert found.complete
    np.testing.assert_allclose(found.first, -(found.second**2) / 4, rtol=1e-11)


def test_period_doublings_of_a_firing_system():
    """The logistic map doubles its period at 3, and again at 1 + √6."""
    branch = ij.follow(firing(Logistic(jnp.array(2.8)), [0.6]), rate, (2.0, 3.2))
    own = 1 - 1 / branch.parameter
    np.testing.assert_allclose(branch.period, 1 / (1 + own / 2), rtol=1e-12)
    (doubling,) = special(branch, "period doubling")
    assert doubling.parameter == pytest.approx(3.0, rel=1e-12)
    np.testing.assert_allclose(np.sort_complex(doubling.orbit.multipliers), [-1, 1], atol=1e-9)
    double = ij.follow(ij.doubled(doubling.orbit), rate, (2.9, 3.6))
    ends = [each.parameter for each in special(double, "period doubling")]
    np.testing.assert_allclose(sorted(ends), [3.0, 1 + np.sqrt(6)], rtol=1e-10)
    a, own = double.parameter, double.after["own"][:, :, 0]
    np.testing.assert_allclose(np.sum(own, axis=1), (1 + a) / a, rtol=1e-10)
    np.testing.assert_allclose(double.period, np.sum(1 / (1 + own / 2), axis=1), rtol=1e-10)


def test_neimark_sacker_of_a_firing_system():
    """The delayed logistic map, whose multipliers reach exp(±iπ/3) at 2."""
    branch = ij.follow(firing(Delayed(jnp.array(1.8)), [0.4, 0.4]), rate, (1.1, 3.0))
    assert [each.kind for each in branch.special][1:-1] == ["Neimark-Sacker"]
    found = branch.special[1]
    assert found.parameter == pytest.approx(2.0, rel=1e-12)
    turns = sorted(found.orbit.multipliers, key=np.imag)
    np.testing.assert_allclose(turns, np.exp([-1j * np.pi / 3, 0, 1j * np.pi / 3]), atol=1e-9)


def roessler_doubling():
    """Parameter, state and period at which a multiplier is −1, by SciPy."""

    def rates(t, y, c):
        x, own, z = y[:3]
        slopes = np.array([[0, -1, -1], [1, 0.2, 0], [z, 0, x - c]])
        state = [-own - z, x + 0.2 * own, 0.2 + z * (x - c)]
        return np.concatenate([state, (slopes @ y[3:].reshape(3, 3)).ravel()])

    def errors(p):
        x, z, period, c = p
        begin = np.concatenate([[x, 0.0, z], np.eye(3).ravel()])
        run = solve_ivp(rates, (0, period), begin, "DOP853", rtol=1e-12, atol=1e-13, args=(c,))
        end = run.y[:, -1]
        flip = np.linalg.det(end[3:].reshape(3, 3) + np.eye(3))
        return [*(end[:3] - begin[:3]), flip]

    found = root(errors, [-3.2, 0.035, 5.8, 2.83], tol=1e-12)
    assert found.success
    return found.x


def test_period_doubling_of_a_smooth_system():
    surface = ij.Through(lambda t, y, mode: y["y"])
    start = ij.Start(0.0, {"x": -3.0, "y": 0.0, "z": 0.03})
    orbit = ij.periodic_orbit(Roessler(jnp.array(2.6)), start, surface, settle=60)
    branch = ij.follow(orbit, lambda system: system.c, (2.5, 3.0))
    (doubling,) = special(branch, "period doubling")
    *_, period, c = roessler_doubling()
    assert doubling.parameter == pytest.approx(c, rel=1e-9)
    assert doubling.orbit.period == pytest.approx(period, rel=1e-9)
    double = ij.doubled(doubling.orbit)
    assert double.result == ij.RESULTS.successful
    assert double.period == pytest.approx(2 * period, rel=1e-2)
    run = ij.solve(double.system, double.start, double.period * jnp.array([0.5, 1.0]))
    half, whole = np.abs(run.ys["x"] - double.start.y["x"])
    assert half > 1e-3 > 1e-6 > whole


def test_wrong_surface_is_one_sentence():
    with pytest.raises(ValueError, match="rates of the system change with time: give the period"):
        ij.periodic_orbit(MODEL_V, REST, ij.AtTransition(0), multiple=1)
    start = ij.Start(0.0, jnp.array([0.3, 0.0]))
    never = ij.Through(lambda t, y, mode: 5 - y[0])
    with pytest.raises(ValueError, match="does not return to the surface given as `period`"):
        ij.periodic_orbit(Rings(jnp.array(-0.1), jnp.array(1.0)), start, never)
