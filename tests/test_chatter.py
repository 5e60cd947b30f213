"""Summed chatter against impacts that are followed one by one in closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from mpmath import findroot, mp, mpf

import impactjax as ij
from systems import Own
from tiers import thorough


def simulated(model, start, ts):
    return ij.simulate(model, start, ts, t0=0.0, max_steps=512, max_impacts=256)


@jax.jit
def on_its_stop(gap, omega_n, r):
    """A linear oscillator that is released at 0.1 m and whose spring presses it onto its stop."""
    model = ij.ImpactOscillator(ij.LinearOscillator(omega_n), ij.Stop(ij.Restitution(r), gap))
    return simulated(model, ij.InitialState(0.1), jnp.array([60.0]))


def rest_of_an_oscillator(c, omega_n, r):
    """All impacts at x = c: each flight from speed u lasts 2 atan(u/(omega_n c))/omega_n."""
    with mp.workdps(30):
        c, omega_n, r = mpf(c), mpf(omega_n), mpf(r)
        t, u = mp.acos(c / mpf(0.1)) / omega_n, r * omega_n * mp.sqrt(mpf(0.01) - c**2)
        while u > mpf(10) ** -30:
            t, u = t + 2 * mp.atan(u / (omega_n * c)) / omega_n, r * u
        return float(t)


@pytest.mark.parametrize("gap", [-5e-2, -1e-2, -1e-3, -1e-4, -1e-5])
def test_chatter_under_position_dependent_push(gap):
    run = on_its_stop(gap, 10.0, 0.8)
    assert run.result == ij.RESULTS.successful
    expected = rest_of_an_oscillator(-gap, 10.0, 0.8)
    assert abs(run.rests.begin[0] - expected) <= 1e-8 * expected


@pytest.mark.parametrize(("gap", "r", "speed"), [(1e-6, 0.8, 10.0), (1e-5, 0.9, 50.0)])
def test_chatter_does_not_pass_the_other_stop(gap, r, speed):
    law = ij.Stop(ij.Restitution(r))
    model = ij.ImpactOscillator(
        ij.BouncingBall(9.81), law, ij.Stop(ij.Restitution(r), jnp.asarray(gap))
    )
    ts = np.linspace(0.0, 0.05, 2001)
    run = simulated(model, ij.InitialState(gap / 2, speed), ts)
    assert run.result == ij.RESULTS.successful
    assert jnp.max(run.position) <= gap * (1 + 1e-6)
    assert jnp.min(run.position) >= -gap * 1e-6
    # Between the stops speed goes by r; after the last flight that reaches the upper one it is the
    # chatter of a ball: t = sum of flights, each to the other stop or up and down.
    with mp.workdps(30):
        g, gap, r, v, t = mpf(9.81), mpf(gap), mpf(r), mpf(speed), mpf(0)
        height, up = gap / 2, True
        for _ in range(400):
            if up:
                squared = v**2 - 2 * g * (gap - height)
                if squared < 0:
                    t, v, up = (
                        t + (v + mp.sqrt(v**2 + 2 * g * height)) / g,
                        mp.sqrt(v**2 + 2 * g * height),
                        True,
                    )
                    height, v = mpf(0), r * v
                else:
                    after = mp.sqrt(squared)
                    t, v, height, up = t + (v - after) / g, r * after, gap, False
            else:
                after = mp.sqrt(v**2 + 2 * g * height)
                t, v, height, up = t + (after - v) / g, r * after, mpf(0), True
        expected = float(t)
    assert abs(run.rests.begin[0] - expected) <= 1e-8 * expected


def rest_of_a_shaken_ball(g, r, amplitude, frequency, phase, height):
    """All impacts of a ball on a harmonic table, each found by mpmath."""
    with mp.workdps(40):
        g, r, a, w, p = (mpf(x) for x in (g, r, amplitude, frequency, phase))

        def table(t):
            return a * mp.sin(w * t + p)

        def table_speed(t):
            return a * w * mp.cos(w * t + p)

        t, x, v = mpf(0), table(0) + mpf(height), table_speed(0)
        for _ in range(200):
            push = g - a * w**2 * mp.sin(w * t + p)
            falls = 2 * (v - table_speed(t)) / push if t > 0 else mp.sqrt(2 * mpf(height) / push)
            s = findroot(lambda s, t=t, x=x, v=v: x + v * s - g * s**2 / 2 - table(t + s), falls)
            t = t + s
            relative = -(v - g * s - table_speed(t))
            if relative < mpf(10) ** -25:
                return float(t)
            x, v = table(t), table_speed(t) + r * relative
        raise AssertionError


@jax.jit
def shaken(phase):
    base = ij.HarmonicMotion(0.01, 20.0, phase)
    model = ij.ImpactOscillator(ij.BouncingBall(9.81, base=base), ij.Stop(ij.Restitution(0.5)))
    return simulated(model, ij.InitialState(0.02), jnp.array([0.5]))


@pytest.mark.parametrize("phase", np.linspace(1.5, 2.6, 12))
def test_chatter_under_time_dependent_push(phase):
    run = shaken(phase)
    expected = rest_of_a_shaken_ball(9.81, 0.5, 0.01, 20.0, phase, 0.02)
    assert abs(run.rests.begin[0] - expected) <= 1e-8 * expected


def coil(t, x, v):
    """A spring whose force is found by a loop, which has no bounds."""
    del t, v
    start = jnp.zeros_like(x)
    return -100.0 * jax.lax.fori_loop(0, 60, lambda _, force: force + (x - force) / 2, start)


def test_chatter_without_interval_bounds_is_not_summed():
    model = ij.ImpactOscillator(Own(law=coil), ij.Stop(ij.Restitution(0.4), -0.05))
    run = ij.simulate(
        model, ij.InitialState(0.1), jnp.array([2.0]), t0=0.0, max_steps=1024, max_impacts=256
    )
    assert run.result == ij.RESULTS.successful
    assert abs(run.rests.begin[0] - rest_of_an_oscillator(0.05, 10.0, 0.4)) <= 1e-7
    assert run.impacts.count > 15  # a sum that is bounded begins after nine


@thorough
def test_rest_after_plastic_impact_has_derivative_by_restitution():
    """The rest begins 2 r v / (g (1 − r)) after the impact, also where r is zero."""

    def begins(r):
        model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(ij.Restitution(r)))
        return simulated(model, ij.InitialState(0.2), jnp.array([1.0])).rests.begin[0]

    slope = jax.jit(lambda r: (jax.jacfwd(begins)(r), jax.jacrev(begins)(r)))(0.0)
    np.testing.assert_allclose(slope, 2 * np.sqrt(2 * 0.2 / 9.81), rtol=1e-12)
