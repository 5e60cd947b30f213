"""Diagrams of impact oscillators: the samples of long runs of `simulate`."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from laws import LAWS
from tiers import mostly_thorough

KEEP, SKIP = 8, 21
SERIES = ij.TaylorStep(order=8)  # compiles faster than the usual one
OWN = {"rigid": ij.Restitution(0.6), "memory": LAWS["maxwell"].law}


def frequency(model):
    return model.oscillator.base.frequency


def period(model):
    return 2 * np.pi / frequency(model)


def forced(law, omega):
    base = ij.HarmonicMotion(3e-3, omega)
    pendulum = ij.Pendulum(13.47, zeta=0.0017, length=0.071, mass=0.1, base=base)
    return ij.ImpactOscillator(pendulum, ij.Stop(law))


def states_of(model, start):
    """Position and velocity after the periods that a diagram keeps."""
    omega = frequency(model)
    numbers = np.arange(SKIP + 1.0, SKIP + KEEP + 1)
    times = jnp.zeros(()) + 2 * np.pi / omega * numbers
    run = simulated(model, start, times, 1e-8)
    return run.position, run.velocity


def simulated(model, start, times, tolerance):
    return ij.simulate(
        model,
        start,
        times,
        t0=0.0,
        step=SERIES,
        tolerance=tolerance,
        max_steps=8192,
        max_impacts=2048,
    )


@pytest.mark.parametrize("law", mostly_thorough(OWN, "rigid"))
def test_states_are_those_of_one_run(law):
    model, values = forced(OWN[law], 30.0), jnp.array([30.0, 55.0])
    start = ij.InitialState(0.3)
    found = ij.diagram(model, start, period, frequency, values, keep=KEEP, skip=SKIP, step=SERIES)
    assert np.all(found.result == ij.RESULTS.successful)
    for number, omega in enumerate(values):
        position, velocity = states_of(forced(OWN[law], omega), start)
        np.testing.assert_allclose(found.states["position"][number], position, atol=1e-12)
        np.testing.assert_allclose(found.states["velocity"][number], velocity, atol=1e-10)


def test_sweep_with_memory_goes_on_from_the_value_before():
    """At the same value again, the motion of one long run."""
    model = forced(OWN["rigid"], 30.0)
    found = ij.diagram(
        model,
        ij.InitialState(0.3),
        period,
        frequency,
        [30.0, 30.0],
        sweep=ij.WithMemory(),
        keep=KEEP,
        skip=24 - KEEP,  # the periods of three whole portions
        tolerance=1e-11,
        step=SERIES,
    )
    numbers = np.concatenate([np.arange(25 - KEEP, 25), np.arange(49 - KEEP, 49)])
    times = 2 * np.pi / 30.0 * numbers
    run = simulated(model, ij.InitialState(0.3), times, 1e-11)
    positions = found.states["position"].ravel()
    np.testing.assert_allclose(positions, run.position, rtol=0, atol=1e-9)


def test_start_inside_a_stop_has_its_code():
    model = eqx.tree_at(lambda m: m.lower.gap, forced(OWN["rigid"], 30.0), jnp.array(-0.5))
    start = ij.InitialState(np.float32(0.3))  # counts as double: the model is
    found = ij.diagram(model, start, period, frequency, [30.0], keep=2, skip=0, step=SERIES)
    assert np.all(found.result == ij.RESULTS.starts_inside_stop)
    assert np.all(np.isnan(found.states["position"]))
