"""An impact oscillator as a mechanism moves as in `simulate`, another engine."""

import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from tiers import mostly_thorough

BASE = ij.HarmonicMotion(4.6e-3, 2 * np.pi * 4.2, 0.3)
FORCED = ij.Pendulum(13.47, zeta=0.0017, length=0.071, mass=0.1, base=BASE)
STICKING = ij.Pendulum(13.47, length=0.071, mass=0.1, dry_friction=0.6)
LEANING = ij.Pendulum(13.47, length=0.071, mass=0.1)

MODELS = {
    "one stop": ij.ImpactOscillator(FORCED, ij.Stop(ij.KelvinVoigt(725.0, 0.16))),
    "two stops": ij.ImpactOscillator(
        FORCED, ij.Stop(ij.Restitution(0.6)), ij.Stop(ij.LinearRestitution(0.8, 0.05), gap=0.5)
    ),
    "no pull": ij.ImpactOscillator(
        FORCED, ij.Stop(ij.KelvinVoigt(725.0, 0.16, separation=ij.AtZeroForce()))
    ),
    "dry friction": ij.ImpactOscillator(STICKING, ij.Stop(ij.Restitution(0.6))),
    "chatter and rest": ij.ImpactOscillator(LEANING, ij.Stop(ij.Restitution(0.6), gap=-0.2)),
    "ball with drag": ij.ImpactOscillator(
        ij.BouncingBall(9.81, drag=0.5), ij.Stop(ij.Restitution(0.8))
    ),
}


@pytest.mark.parametrize("name", mostly_thorough(MODELS, "one stop"))
def test_motion_of_an_oscillator_as_a_mechanism(name):
    model, ts = MODELS[name], jnp.linspace(0, 1.5, 151)
    system = ij.MechanicalSystem(ij.OscillatorMechanism(model))
    found = ij.solve(system, system.start(0.0, [0.4], [0.0]), ts, tolerance=1e-11)
    expected = ij.simulate(model, ij.InitialState(0.4), ts, tolerance=1e-11)
    assert found.result == expected.result == ij.RESULTS.successful
    assert expected.impacts.count > 4
    np.testing.assert_allclose(found.ys.q[:, 0], expected.position, atol=1e-10)


def test_kind_of_model_is_checked():
    with pytest.raises(TypeError, match="model"):
        ij.OscillatorMechanism(FORCED)
