"""Magnification of errors near grazing, and precision far from the origin of time."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from mpmath import mp, mpf

import impactjax as ij
from tiers import mostly_thorough, thorough

OMEGA, R, GAP, TOLERANCE = 8.0, 0.9, 0.5, 1e-8


@jax.jit
def onto_grazing(last):
    """An undamped oscillator decays onto the orbit that grazes its stop."""
    model = ij.ImpactOscillator(ij.LinearOscillator(OMEGA), ij.Stop(ij.Restitution(R), GAP))
    return ij.simulate(
        model, ij.InitialState(1.0), last[None], t0=0.0, max_steps=4096, max_impacts=256
    )


def exact_position(last):
    """Position by the recursion of amplitudes: v² = omega² (a² − gap²) before each impact."""
    with mp.workdps(40):
        omega, r, gap, a, top = mpf(OMEGA), mpf(R), mpf(GAP), mpf(1), mpf(0)
        while True:
            impact = top + mp.acos(-gap / a) / omega
            if impact > last:
                return float(a * mp.cos(omega * (last - top)))
            a = mp.sqrt(gap**2 + r**2 * (a**2 - gap**2))
            top = impact + mp.acos(-gap / a) / omega


def test_errors_are_tolerance_times_magnification():
    numbers: list[float] = []
    for last in (5.0, 20.0, 40.0, 60.0, 90.0):
        run = onto_grazing(jnp.asarray(last))
        error = abs(float(run.position[0]) - exact_position(last))
        assert error <= 10 * TOLERANCE * run.magnification
        numbers.append(float(run.magnification))
    assert numbers == sorted(numbers)
    assert numbers[0] < 10
    assert numbers[-1] > 1e4


def test_magnification_of_impact_in_closed_form():
    # Dropped without speed from a to the stop at -gap: v² = omega² (a² − gap²), V = omega a before.
    model = ij.ImpactOscillator(ij.LinearOscillator(OMEGA), ij.Stop(ij.Restitution(R), 0.99))
    run = ij.simulate(model, ij.InitialState(1.0), jnp.array([0.6]), t0=0.0, tolerance=1e-10)
    assert run.impacts.count == 1
    v, pull = OMEGA * np.sqrt(1 - 0.99**2), OMEGA**2 * 0.99
    # the steps end where they end, so width and greatest speed are known to a factor
    estimate = (1 + R) * pull * 1.99 / (v * OMEGA)
    assert estimate * 0.9 < run.magnification < estimate * 1.5


def test_chatter_and_hard_impacts_do_not_magnify():
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(ij.Restitution(0.8)))
    run = ij.simulate(model, ij.InitialState(0.3), jnp.array([6.0]), t0=0.0)
    assert run.rests.count == 1
    np.testing.assert_allclose(run.magnification, 1.0)


def test_near_miss_magnifies():
    model = ij.ImpactOscillator(ij.LinearOscillator(OMEGA), ij.Stop(ij.Restitution(R), 1.0 + 1e-6))
    run = ij.simulate(model, ij.InitialState(1.0), jnp.array([2.0]), t0=0.0)
    np.testing.assert_allclose(run.nearest_miss, 1e-6, rtol=1e-3)
    np.testing.assert_allclose(run.magnification, np.sqrt(2 / 1e-6), rtol=0.1)


@pytest.mark.parametrize(("t0", "fine"), [(0.0, True), (2.0**20, True), (2.0**31, False)])
def test_coarse_time_resolution_gives_result_code(t0, fine):
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(ij.Restitution(0.8)))
    run = ij.simulate(model, ij.InitialState(0.1), t0 + jnp.linspace(0, 0.5, 6))
    expected = ij.RESULTS.successful if fine else ij.RESULTS.time_too_coarse
    assert run.result == expected


def test_too_many_rests_give_result_code():
    # At 1 Hz and 1.5 g the mass rests once a period.
    base = ij.HarmonicMotion(1.5 * 9.81 / (2 * np.pi) ** 2, 2 * np.pi)
    model = ij.ImpactOscillator(ij.BouncingBall(9.81, base=base), ij.Stop(ij.Restitution(0.0)))
    run = ij.simulate(model, ij.InitialState(0.0), jnp.array([6.2]), t0=0.0, max_impacts=4)
    assert run.result == ij.RESULTS.max_impacts_reached
    assert run.rests.count == 4


@thorough
@pytest.mark.parametrize("shift", mostly_thorough([0.0, 1e-12, 1e-6], 0.0))
def test_run_may_end_at_release(shift):
    """With g = a Omega² sin(Omega t + phase) at the end."""
    random = np.random.default_rng(1)
    frequency, gravity = random.uniform(1, 30, 16), random.uniform(1, 10, 16)
    ratio = random.uniform(0.1, 0.9, 16)

    def ends(frequency, gravity, ratio):
        base = ij.HarmonicMotion(gravity / ratio / frequency**2, frequency)
        model = ij.ImpactOscillator(
            ij.BouncingBall(gravity, base=base), ij.Stop(ij.Restitution(0.5))
        )
        released = jnp.arcsin(ratio) / frequency
        return ij.simulate(
            model, ij.InitialState(0.0), (released + shift)[None], t0=0.0, max_steps=64
        )

    run = jax.jit(jax.vmap(ends))(frequency, gravity, ratio)
    assert np.all(run.result == ij.RESULTS.successful)
    assert np.all(run.rests.count == 1)
