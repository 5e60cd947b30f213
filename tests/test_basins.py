"""Basins of attraction against closed forms and another integrator."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactjax as ij
from forced_systems import Below
from impactjax._response.attractors import attractor_of_each
from impactjax._response.portions import in_portions
from tiers import quick, thorough

OMEGA = 1.5
A = 0.9 * np.sqrt((1 - OMEGA**2) ** 2 + (0.1 * OMEGA) ** 2)  # 0.9 of what grazes the stop
PERIOD = 2 * np.pi / OMEGA
SYSTEM = Below(jnp.array(A), jnp.array(OMEGA))
X, V = (each.ravel() for each in np.meshgrid(np.linspace(-2, 0.9, 6), [-1.0, 0.0, 1.0]))


@pytest.fixture(scope="module")
def found():
    return ij.basins(SYSTEM, ij.Start(0.0, (X, V)), Below.period, skip=100)


def later(x, v, time):
    """The state at a later time, by an integrator that starts anew at each impact."""

    def flow(t, y):
        return [y[1], A * np.cos(OMEGA * t) - 0.1 * y[1] - y[0]]

    def stop(t, y):
        return y[0] - 1

    stop.terminal = True  # pyright: ignore[reportFunctionMemberAccess]  as SciPy asks
    stop.direction = 1  # pyright: ignore[reportFunctionMemberAccess]
    t, y = 0.0, np.array([x, v])
    while t < time:
        run = solve_ivp(flow, (t, time), y, method="DOP853", rtol=1e-9, atol=1e-11, events=stop)
        t, y = run.t[-1], run.y[:, -1]
        if run.status == 1:
            y = np.array([1.0, -0.8 * y[1]])
    return y


def test_motion_without_impacts_is_the_closed_form(found):
    """Re A exp(iωt) / (1 − ω² + 0.1iω), which touches 0.9."""
    response = A / (1 - OMEGA**2 + 0.1j * OMEGA)
    expected = [response.real, (1j * OMEGA * response).real]
    assert [each.period for each in found.attractors] == [1, 1]
    np.testing.assert_allclose(np.ravel(found.attractors[1].states), expected, atol=1e-6)


def test_motions_approach_what_another_integrator_finds(found):
    ends = [np.ravel(each.states) for each in found.attractors]
    for x, v, name in zip(X, V, found.attractor, strict=True):
        np.testing.assert_allclose(later(x, v, 60 * PERIOD), ends[name], atol=1e-4)


def test_shares_are_those_of_the_starts(found):
    shares = [np.mean(found.attractor == name) for name in range(2)]
    assert [each.share for each in found.attractors] == shares
    assert shares[0] > shares[1] > 0


@thorough
def test_basins_of_an_oscillator():
    """A pendulum at a frequency at which it has motions with and without impacts."""
    base = ij.HarmonicMotion(4e-3, 2 * np.pi * 6)
    pendulum = ij.Pendulum(13.47, zeta=0.1, length=0.071, base=base)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.Restitution(0.8), gap=0.2))
    angles = np.linspace(-0.1, 1.2, 4)
    found = ij.basins(model, ij.InitialState(angles), 1 / 6, skip=100)
    assert {each.period for each in found.attractors} == {1, 2}
    for angle, name in zip(angles, found.attractor, strict=True):
        times, start = np.arange(1.0, 101) / 6, ij.InitialState(angle)
        run = ij.simulate(model, start, times, t0=0.0, max_steps=8192, max_impacts=2048)
        states = found.attractors[name].states["position"]
        assert np.min(np.abs(states - run.position[-1])) < 1e-5


@quick
def test_attractors_are_told_apart_in_any_phase():
    """Three motions of period 2 in both phases, two of period 1, and one of no period."""
    rows = np.array([[1, 2, 1, 2], [2, 1, 2, 1], [5, 5, 5, 5], [2, 1, 2, 1], [1, 7, 3, 9], [6] * 4])
    names = attractor_of_each(rows[:, :, None] * 1.0, np.array([2, 2, 1, 2, 0, 1]), 1e-3)
    np.testing.assert_array_equal(names, [0, 0, 1, 0, -1, 2])


@quick
@pytest.mark.parametrize(
    ("starts", "words"),
    [
        (ij.Start(0.0, (-1.0, 0.0)), "arrays of one axis"),
        (ij.Start(0.0, (np.zeros(3), np.zeros(2))), "different shapes"),
    ],
)
def test_starts_that_are_no_rows_are_refused(starts, words):
    with pytest.raises(ValueError, match=words):
        ij.basins(SYSTEM, starts, Below.period)


@quick
def test_angles_in_degrees_are_refused():
    model = ij.ImpactOscillator(ij.Pendulum(13.47), ij.Stop(ij.Restitution(0.8)))
    with pytest.raises(ValueError, match="are degrees meant"):
        ij.basins(model, ij.InitialState(np.array([0.1, 30.0])), 1 / 6)


def test_portions_are_put_together_in_order():
    """More lanes than a portion has, and no whole number of portions."""
    lanes = {"a": jnp.linspace(0.0, 1.0, 250), "b": jnp.ones((250, 3))}
    program = jax.jit(lambda factor, each: (factor * each["a"], each["b"][:, 0]))
    first, second = in_portions(program, jnp.array(2.0), lanes)
    np.testing.assert_array_equal(first, 2 * lanes["a"])
    assert second.shape == (250,)


@quick
def test_unknown_numbers_are_refused():
    with pytest.raises(ValueError, match="outside of `jit`"):
        jax.eval_shape(
            lambda x: ij.basins(SYSTEM, ij.Start(0.0, (x, x)), Below.period).result,
            jnp.zeros(3),
        )
