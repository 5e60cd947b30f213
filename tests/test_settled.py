"""A compliant stop that catches the mass: its end, against closed forms and scipy's Radau."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactjax as ij
from tiers import mostly_thorough, thorough

G, TIMES = 9.81, np.linspace(0.0, 3.0, 31)


def drop(law, times=TIMES, height=0.1, **limits):
    model = ij.ImpactOscillator(ij.BouncingBall(G), ij.Stop(law))
    return ij.simulate(model, ij.InitialState(height), times, t0=0.0, max_impacts=128, **limits)


LAWS = {
    "Hertz with dashpot": (lambda: ij.HertzDashpot(1e8, 2e3), (1e8, 1.5, 2e3)),
    "Kelvin-Voigt": (lambda: ij.KelvinVoigt(2000.0, 0.3), (4e6, 1.0, 1200.0)),
    "overdamped": (lambda: ij.KelvinVoigt(500.0, 3.0), (2.5e5, 1.0, 3000.0)),
}


@pytest.mark.parametrize("name", mostly_thorough(LAWS, "Kelvin-Voigt"))
def test_settling_needs_few_steps(name):
    law, (k, n, _) = LAWS[name]
    run = drop(law(), max_steps=512)
    assert run.result == ij.RESULTS.successful
    assert run.stats.steps < 300
    equilibrium = -((G / k) ** (1 / n))
    assert abs(run.position[-1] - equilibrium) <= 1e-9 * 0.1
    assert run.velocity[-1] == 0
    assert not run.impacts.complete[run.impacts.count - 1]


def test_settling_motion_agrees_with_scipy():
    run = drop(ij.HertzDashpot(1e8, 2e3), np.linspace(0.14, 0.16, 41), max_steps=512)
    touch = np.sqrt(2 * 0.1 / G)

    def rates(_, y):
        depth = max(-y[0], 0.0)
        return [y[1], -G + 1e8 * depth**1.5 - 2e3 * y[1]]

    later = np.linspace(0.14, 0.16, 41) > touch
    reference = solve_ivp(
        rates,
        (touch, 0.16),
        [0.0, -G * touch],
        "Radau",
        rtol=1e-11,
        atol=1e-14,
        t_eval=np.linspace(0.14, 0.16, 41)[later],
    )
    np.testing.assert_allclose(run.position[later], reference.y[0], atol=1e-9)
    np.testing.assert_allclose(run.velocity[later], reference.y[1], atol=1e-7)


@thorough
def test_settled_derivatives_are_those_of_equilibrium():
    def place(omega0, gravity):
        model = ij.ImpactOscillator(ij.BouncingBall(gravity), ij.Stop(ij.KelvinVoigt(omega0, 0.3)))
        run = ij.simulate(
            model, ij.InitialState(0.1), TIMES, t0=0.0, max_steps=512, max_impacts=128
        )
        return run.position[-1]  # -g / omega0²

    forward = jax.jit(jax.jacfwd(place, (0, 1)))(2000.0, G)
    reverse = jax.jit(jax.grad(place, (0, 1)))(2000.0, G)
    expected = 2 * G / 2000.0**3, -1 / 2000.0**2
    np.testing.assert_allclose(forward, expected, rtol=1e-6)
    np.testing.assert_allclose(reverse, expected, rtol=1e-6)


@thorough
def test_shaken_mass_does_not_settle():
    base = ij.HarmonicMotion(1e-4, 30.0)
    model = ij.ImpactOscillator(ij.BouncingBall(G, base=base), ij.Stop(ij.KelvinVoigt(200.0, 0.5)))
    run = ij.simulate(model, ij.InitialState(0.01), TIMES, t0=0.0, max_steps=2048)
    assert run.result == ij.RESULTS.successful
    # x″ + 200 x′ + 200² x = −g + a Ω² sin Ω t in the long run
    response = 1e-4 * 30.0**2 / (200.0**2 - 30.0**2 + 1j * 200.0 * 30.0)
    expected = np.imag(response * np.exp(1j * 30.0 * TIMES[20:])) - G / 200.0**2
    np.testing.assert_allclose(run.position[20:], expected, atol=1e-9)


@pytest.mark.parametrize("p", mostly_thorough([0.25, 0.5], 0.25))
def test_force_vanishing_at_surface_ends_settled_contact_once(p):
    law = ij.PowerLaw(1e5, 30.0, 1.0, p, 1.0, separation=ij.AtZeroForce())
    run = drop(law, max_steps=2048)
    assert run.result == ij.RESULTS.successful
    count = int(run.impacts.count)
    # The dashpot hardly matters: half a swing on a spring of 1e5 N/m.
    half = np.pi / np.sqrt(1e5)
    np.testing.assert_allclose(run.impacts.duration[:count], half, rtol=0.03)
    flights = np.diff(np.asarray(run.impacts.time[:count])) - half
    speeds = np.asarray(run.impacts.separation_speed[: count - 1])
    np.testing.assert_allclose(flights, 2 * speeds / G, rtol=1e-2)


def restitution_by_scipy(k, alpha, q, speed):
    def rates(_, y):
        depth = max(-y[0], 0.0)
        damping = 1 - alpha * np.sign(y[1]) * abs(y[1]) ** q
        return [y[1], -G + k * depth**1.5 * damping]

    def height(_, y):
        return y[0]

    vars(height).update(terminal=True, direction=1)
    start = [0.0, -speed]
    contact = solve_ivp(
        rates, (0, 1), start, "DOP853", events=height, rtol=1e-10, atol=1e-14, max_step=1e-4
    )
    return contact.y_events[0][0][1] / speed


@jax.jit
@jax.vmap
def on_a_kink(k, alpha, q):
    return drop(ij.PustPeterka(k, alpha, q), np.linspace(0.0, 1.0, 6), max_steps=4096)


@thorough
def test_contact_force_with_kink_in_rate_agrees_with_scipy():
    k, alpha = np.array([1e5, 1e6, 5e7, 3e5]), np.array([0.02, 0.1, 0.02, 0.9])
    q = np.array([0.5, 0.25, 0.25, 0.5])
    run = on_a_kink(k, alpha, q)
    assert np.all(run.result == ij.RESULTS.successful)
    for i in range(4):
        r = restitution_by_scipy(k[i], alpha[i], q[i], np.sqrt(2 * G * 0.1))
        np.testing.assert_allclose(run.impacts.restitution[i, 0], r, rtol=1e-6)


def test_zero_restitution_is_critical_damping():
    np.testing.assert_allclose(ij.KelvinVoigt.from_restitution(100.0, 0.0).gamma, 1.0)
    np.testing.assert_allclose(ij.Maxwell.from_restitution(100.0, 0.0).gamma, 1.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda r: ij.KelvinVoigt.from_restitution(100.0, r, separation=ij.AtZeroForce()),
        lambda r: ij.Walton.from_restitution(1e4, r, 1.0),
        lambda r: ij.Simon.from_restitution(1e4, r, 1.0),
        lambda r: ij.HuntCrossley.from_restitution(1e4, r, 1.0),
    ],
)
@pytest.mark.parametrize("r", [0.0, 1.2, -0.1])
def test_unreachable_restitution_is_refused(make, r):
    with pytest.raises(ValueError, match="Argument `r` must be above 0 and at most 1"):
        make(r)


def test_force_law_outside_range_gives_result_code():
    run = drop(ij.KelvinVoigtLinearRestitution(200.0, 0.9, 0.5), height=0.3)
    assert run.result == ij.RESULTS.restitution_out_of_range


@pytest.mark.parametrize("p", mostly_thorough([0.25, 0.5], 0.25))
def test_force_vanishing_at_surface_lets_the_mass_go(p):
    """Contact and flight inside the indentation both end at the surface, where the force has an
    infinite slope.
    """

    def finished(height):
        law = ij.PowerLaw(1e5, 300.0, 1.0, p, 1.0, separation=ij.AtZeroForce())
        run = drop(law, height=height, max_steps=2048)
        return run.result == ij.RESULTS.successful

    assert np.all(jax.jit(jax.vmap(finished))(np.linspace(0.05, 0.2, 16)))
