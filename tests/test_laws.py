"""The contact laws: members of the power law, ranges, steps, and what each adds of its own."""

import functools
import math

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactjax as ij
from impactjax._model.power import odd_power, power
from impactjax._simulate.default_step import natural_step
from laws import ANALYTIC, AS_POWER_LAWS, FORCES, MASS
from tiers import thorough

SPEED = 0.73
MEMBERS = {
    name: (FORCES[name].law, ij.PowerLaw(*same))
    for name, same in AS_POWER_LAWS.items()
    if name != "power-law"
} | {
    "pust-peterka, q < 1": (
        ij.PustPeterka(1e6, 0.3, 0.5),
        ij.PowerLaw(1e6, 3e5, 1.5, 1.5, 0.5),
    ),
}


def model(law, oscillator=None):
    return ij.ImpactOscillator(oscillator or ij.FreeMass(MASS), ij.Stop(law))


@pytest.mark.parametrize("name", MEMBERS)
def test_members_are_power_laws(name):
    law, general = MEMBERS[name]
    rng = np.random.default_rng(1)
    penetration = jnp.asarray(rng.uniform(1e-6, 1e-3, 50))
    rate = jnp.asarray(rng.uniform(-2, 2, 50))
    found = law.force(penetration, rate, (), jnp.asarray(MASS))
    expected = general.force(penetration, rate, (), jnp.asarray(MASS))
    np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_power_law_force_formula():
    law = ij.PowerLaw(3.0, 5.0, 1.5, 0.25, 0.5)
    force = law.force(jnp.asarray(0.04), jnp.asarray(-0.09), (), jnp.asarray(1.0))
    with mpmath.workdps(30):
        delta, rate = mpmath.mpf("0.04"), mpmath.mpf("0.09")
        expected = 3 * delta**1.5 - 5 * mpmath.root(delta, 4) * mpmath.sqrt(rate)
    assert abs(float(force) / float(expected) - 1) < 1e-14


@pytest.mark.parametrize("name", ANALYTIC)
def test_analytic_laws_take_a_taylor_step(name):
    assert isinstance(natural_step(model(ANALYTIC[name].law), 1e-8), ij.TaylorStep)


@pytest.mark.parametrize("name", [name for name in MEMBERS if name not in ANALYTIC])
def test_other_laws_take_a_runge_kutta_step(name):
    law, general = MEMBERS[name]
    assert isinstance(natural_step(model(law), 1e-8), ij.RungeKutta)
    assert isinstance(natural_step(model(general), 1e-8), ij.RungeKutta)


@pytest.mark.parametrize("x", [0.0, -1e-3])
def test_power_derivatives_vanish_outside_contact(x):
    def function(x, n):
        return power(x, n)

    for _ in range(4):
        assert float(function(jnp.asarray(x), jnp.asarray(1.5))) == 0
        assert float(jax.grad(function, argnums=1)(jnp.asarray(x), jnp.asarray(1.5))) == 0
        function = jax.grad(function)


@pytest.mark.parametrize("function", [power, odd_power])
@pytest.mark.parametrize(("exponent", "slope"), [(0.5, 0), (1.0, 1), (1.5, 0), (2.0, 0)])
def test_slope_of_a_power_at_zero(function, exponent, slope):
    for known in (exponent, jnp.asarray(exponent)):
        found = jax.value_and_grad(function)(jnp.asarray(0.0), known)
        assert [float(each) for each in found] == [0, slope]


def test_power_derivatives_in_contact():
    third = jax.grad(jax.grad(jax.grad(power)))(jnp.asarray(0.04), jnp.asarray(1.5))
    assert abs(float(third) / (1.5 * 0.5 * -0.5 * 0.04**-1.5) - 1) < 1e-13


@pytest.mark.parametrize(
    "make",
    [
        lambda: ij.Walton(-1.0, 1.0),
        lambda: ij.Simon(1.0, -1.0),
        lambda: ij.HuntCrossley(1.0, 1.0, 0.0),
        lambda: ij.PustPeterka(1.0, 1.0, 0.0),
        lambda: ij.PowerLaw(1.0, 1.0, 1.0, -0.5, 1.0),
        lambda: ij.HertzDashpot(math.nan, 1.0),
        lambda: ij.Hertz(0.0),
        lambda: ij.Maxwell(0.0, 0.1),
        lambda: ij.KelvinVoigtLinearRestitution(700.0, 1.1, 0.0),
        lambda: ij.PowerRestitution(0.6, -0.1),
    ],
)
def test_impossible_law_parameters_are_refused(make):
    with pytest.raises(ValueError, match="must be"):
        make()


def test_hertz_from_material():
    E, nu, R = 0.025426e9, 0.5, 0.0127
    plane = ij.Hertz.from_material(E, nu, R)
    np.testing.assert_allclose(plane.k, 4 / 3 * E / (1 - nu**2) * math.sqrt(R), rtol=1e-15)
    twins = ij.Hertz.from_material(E, nu, R, E_other=E, nu_other=nu, R_other=R)
    np.testing.assert_allclose(twins.k, plane.k / 2 / math.sqrt(2), rtol=1e-15)


def test_power_restitution_never_exceeds_one():
    law = ij.PowerRestitution(0.6, 0.25)
    speeds = jnp.array([0.0, 1e-300, 0.6**4 / 2, 0.6**4 * 2, 1.0, 16.0])
    expected = [1.0, 1.0, 1.0, 2**-0.25, 0.6, 0.3]
    np.testing.assert_allclose(law.restitution(speeds), expected, rtol=1e-14)
    slopes = jax.vmap(jax.grad(law.restitution))(speeds)
    expected = [0, 0, 0, -0.25 * 2**-0.25 / (0.6**4 * 2), -0.25 * 0.6, -0.25 * 0.3 / 16]
    np.testing.assert_allclose(slopes, expected, rtol=1e-13)
    constant = ij.PowerRestitution(0.6, 0.0).restitution(speeds)
    np.testing.assert_allclose(constant, 0.6, rtol=1e-15)
    by_law = jax.grad(lambda law: law.restitution(jnp.asarray(0.0)))(law)
    assert (float(by_law.r0), float(by_law.alpha)) == (0, 0)


@thorough
def test_power_restitution_slows_to_elastic_speed():
    law = ij.PowerRestitution(0.6, 0.25)
    run = ij.simulate(
        model(law, ij.BouncingBall()), ij.InitialState(0.05), np.array([0.0, 1.4]), max_impacts=128
    )
    assert run.result == ij.RESULTS.successful
    speeds = run.impacts.approach_speed[: int(run.impacts.count)]
    # r v = 0.6 v^(3/4) falls towards 0.6^4, below which nothing is lost.
    assert np.all(np.diff(speeds) <= 1e-9)
    np.testing.assert_allclose(speeds[-1], 0.6**4, rtol=1e-3)


@functools.cache
def tuned():
    """Kelvin-Voigt of the thesis's new law on a pendulum, a fast and a slow impact."""
    law = ij.KelvinVoigtLinearRestitution(2000.0, 0.65, 0.25)
    pendulum = ij.Pendulum(13.47, 0.0017, length=0.071, mass=MASS)
    return ij.simulate(
        model(law, pendulum), ij.InitialState(0.7), np.array([0.0, 0.6]), tolerance=1e-12
    )


@thorough
def test_damping_follows_approach_speed():
    log = tuned().impacts
    count = int(log.count)
    assert count >= 3
    r = 0.65 - 0.25 * log.approach_speed[:count]
    # Gravity acts during contact too: it changes r by about (omega_n/omega0)^2.
    np.testing.assert_allclose(log.restitution[:count], r, atol=1e-4)


def test_damping_out_of_range_gives_result_code():
    law = ij.KelvinVoigtLinearRestitution(700.0, 0.6, 1.0)
    run = ij.simulate(model(law), ij.InitialState(0.1, -0.7), np.array([0.0, 1.0]))
    assert run.result == ij.RESULTS.restitution_out_of_range


@thorough
def test_maxwell_leaves_a_residual_indentation():
    omega0, gamma = 700.0, 0.2
    end = math.pi / (omega0 * math.sqrt(1 - gamma**2))
    r = math.exp(-math.pi * gamma / math.sqrt(1 - gamma**2))
    run = ij.simulate(
        model(ij.Maxwell(omega0, gamma)),
        ij.InitialState(0.0, -SPEED),
        np.array([0.0, end, 2 * end]),
        tolerance=1e-12,
    )
    residual = 2 * gamma * SPEED * (1 + r) / omega0
    np.testing.assert_allclose(-run.position[1], residual, rtol=1e-11)
    np.testing.assert_allclose(run.velocity[1:], r * SPEED, rtol=1e-11)


@thorough
def test_maxwell_contact_resumes_at_indentation():
    """A ball whose rebound does not leave the indentation: SciPy, restarted where it separates."""
    omega0, gamma, gravity, speed = 700.0, 0.6, 9.81, 2.0

    def touching(t, y):
        stretch = y[0] - y[2]
        return [y[1], gravity - omega0**2 * stretch, 2 * gamma * omega0 * stretch]

    def slack(t, y):
        return y[0] - y[2] + (t < 1e-9)

    vars(slack).update(terminal=True, direction=-1)
    contact = solve_ivp(
        touching, (0, 1), [0.0, speed, 0.0], method="DOP853", rtol=1e-13, atol=1e-16, events=slack
    )
    left, (depth, rate, _) = float(contact.t_events[0][0]), contact.y_events[0][0]
    back = left - 2 * rate / gravity
    assert rate**2 / (2 * gravity) < depth
    after = solve_ivp(
        touching, (0, 1e-3), [depth, -rate, depth], method="DOP853", rtol=1e-13, atol=1e-16
    )

    found = ij.simulate(
        model(ij.Maxwell(omega0, gamma), ij.BouncingBall(gravity)),
        ij.InitialState(0.0, -speed),
        np.array([0.0, left, back, back + 1e-3]),
        tolerance=1e-12,
    )
    assert found.result == ij.RESULTS.successful
    depths, rates = -np.asarray(found.position[1:]), -np.asarray(found.velocity[1:])
    np.testing.assert_allclose(depths, [depth, depth, after.y[0, -1]], rtol=1e-9)
    np.testing.assert_allclose(rates, [rate, -rate, after.y[1, -1]], rtol=1e-9)


@thorough
def test_lossless_spring_at_zero_force_is_elastic():
    """Its force and its indentation vanish at one time: after the one event, the other comes sooner
    than time can resolve.
    """
    law = ij.KelvinVoigt(100.0, 0.0, separation=ij.AtZeroForce())
    model = ij.ImpactOscillator(ij.FreeMass(1.0), ij.Stop(law))
    speeds = jnp.linspace(0.05, 1.0, 200)

    def back(speed):
        start = ij.InitialState(0.01, -speed)
        return ij.simulate(model, start, jnp.array([0.0, 1.0]), step=ij.RungeKutta(), max_steps=64)

    run = jax.jit(jax.vmap(back))(speeds)
    assert jnp.all(run.result == ij.RESULTS.successful)
    np.testing.assert_allclose(run.velocity[:, 1], speeds, rtol=1e-7)
