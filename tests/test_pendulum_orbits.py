"""Branch of the forced pendulum on a Kelvin-Voigt stop, whose numbers were found by stroboscopic
maps of `simulate`, another engine.
"""

import jax.numpy as jnp
import numpy as np

import impactjax as ij
from tiers import thorough

DAMPING_RATIO = -np.log(0.6) / np.hypot(np.pi, np.log(0.6))


def frequency(system):
    return system.mechanism.model.oscillator.base.frequency


@thorough
def test_period_doubling_of_the_forced_pendulum():
    base = ij.HarmonicMotion(5.2e-3, 2 * np.pi * 5.45)
    pendulum = ij.Pendulum(13.47, zeta=0.0017, length=0.071, base=base)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(725.0, DAMPING_RATIO)))
    system = ij.MechanicalSystem(ij.OscillatorMechanism(model))
    start = system.start(0.0, jnp.array([0.3]), jnp.array([0.0]))
    orbit = ij.periodic_orbit(system, start, lambda s: 2 * np.pi / frequency(s), settle=40)
    assert orbit.stability == "stable"
    branch = ij.follow(orbit, frequency, (2 * np.pi * 5.43, 2 * np.pi * 5.5), longest=0.3)
    (doubling,) = [each for each in branch.special if each.kind == "period doubling"]
    np.testing.assert_allclose(doubling.parameter / (2 * np.pi), 5.466183792555, rtol=0, atol=1e-11)
    np.testing.assert_allclose(doubling.orbit.multipliers[0], -1.0, atol=1e-9)
