"""Motions of the base: sweeps of the frequency, and motions of one's own."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array
from scipy.integrate import solve_ivp

import impactjax as ij

CHIRP = ij.Chirp(2e-3, 8.0, 6.0, 0.4)
OMEGA, ZETA, GAP, R = 13.0, 0.02, 1e-3, 0.7
TS = np.linspace(0.0, 3.0, 61)


class Shock(ij.AbstractBaseMotion):
    """Base that settles by x = height exp(−rate t)."""

    height: Array = eqx.field(converter=jnp.asarray)
    rate: Array = eqx.field(converter=jnp.asarray)

    def inertia(self, t):
        return -self.height * self.rate**2 * jnp.exp(-self.rate * t)


def model(base):
    oscillator = ij.LinearOscillator(OMEGA, ZETA, base=base)
    return ij.ImpactOscillator(oscillator, ij.Stop(ij.Restitution(R), gap=GAP))


def in_scipy(push):
    """Positions by DOP853, begun anew at each impact, and the number of impacts."""

    def rates(t, y):
        return [y[1], push(t) - OMEGA**2 * y[0] - 2 * ZETA * OMEGA * y[1]]

    def touches(t, y):
        return y[0] + GAP

    vars(touches).update(terminal=True, direction=-1)
    t, y, found, impacts = 0.0, [0.0, 0.0], np.zeros_like(TS), 0
    while True:
        run = solve_ivp(
            rates,
            (t, TS[-1]),
            y,
            "DOP853",
            rtol=1e-12,
            atol=1e-15,
            events=touches,
            dense_output=True,
            max_step=0.02,
        )
        within = (run.t[-1] >= TS) & (t <= TS)
        found[within] = run.sol(TS[within])[0]
        if run.status == 0:
            return found, impacts
        t, impacts = run.t[-1], impacts + 1
        y = [-GAP, -R * run.y[1, -1]]


@pytest.mark.parametrize(
    ("base", "push"),
    [
        (
            CHIRP,
            lambda t: (
                2e-3 * (8 + 6 * t) ** 2 * np.sin(8 * t + 3 * t**2 + 0.4)
                - 2e-3 * 6 * np.cos(8 * t + 3 * t**2 + 0.4)
            ),
        ),
        (Shock(0.1, 2.5), lambda t: -0.1 * 2.5**2 * np.exp(-2.5 * t)),
    ],
    ids=["chirp", "own"],
)
def test_motion_with_impacts_is_that_of_scipy(base, push):
    run = ij.simulate(model(base), ij.InitialState(0.0), TS, tolerance=1e-11)
    expected, impacts = in_scipy(push)
    assert run.result == ij.RESULTS.successful
    assert int(run.impacts.count) == impacts > 3
    np.testing.assert_allclose(run.position, expected, rtol=0, atol=1e-9 * np.max(np.abs(expected)))


def test_inertia_is_minus_the_acceleration_of_the_base():
    def place(t):
        return 2e-3 * jnp.sin(8.0 * t + 3.0 * t**2 + 0.4)

    for t in jnp.array([0.0, 0.7, 2.0]):
        np.testing.assert_allclose(CHIRP.inertia(t), -jax.grad(jax.grad(place))(t), rtol=1e-12)


def test_chirp_at_constant_frequency_is_a_harmonic_motion():
    ts = jnp.linspace(0.0, 1.0, 7)
    steady, harmonic = ij.Chirp(2e-3, 8.0, 0.0, 0.4), ij.HarmonicMotion(2e-3, 8.0, 0.4)
    np.testing.assert_allclose(steady.inertia(ts), harmonic.inertia(ts), rtol=1e-14)


def test_base_of_another_kind_is_refused():
    with pytest.raises(TypeError, match="`base` must be a BaseMotion, such as"):
        ij.LinearOscillator(OMEGA, base=0.1)  # pyright: ignore[reportArgumentType]
