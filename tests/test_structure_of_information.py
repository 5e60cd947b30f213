"""Structural identifiability, against what theory says of laws and of records."""

import dataclasses

import jax.numpy as jnp
import pytest

import impactjax as ij
from laws import MASS

SPEEDS = jnp.array([0.1, 0.3, 0.73])
NEVER, BADLY, TOLD = ij.Told.NEVER, ij.Told.NOT_BY_THIS_RECORDING, ij.Told.DETERMINED


def rebounds(law):
    return SPEEDS * law.equivalents(SPEEDS, MASS).restitution


@pytest.mark.parametrize(
    ("law", "told"),
    [
        (ij.Walton(1e4, 1e3), {"k": NEVER, "c": NEVER}),
        (ij.KelvinVoigt(600.0, 0.2), {"omega0": NEVER, "gamma": TOLD}),
        (ij.HuntCrossley(1e6, 0.3, 1.4), {"k": NEVER, "c": TOLD}),
    ],
)
def test_rebound_speeds_never_tell_the_stiffness(law, told):
    found = ij.structure_in(rebounds, law, 1e-3)
    assert {name: found[name] for name in found.names} == told
    assert found.ranks.tolist() == [1] * 9
    assert "rank 1 of 2, at 9 points" in str(found)


def test_noise_makes_a_parameter_uncertain_but_not_structurally_unknown():
    found = ij.structure_in(rebounds, ij.KelvinVoigt(600.0, 0.2), 1.0)
    assert (found["omega0"], found["gamma"]) == (NEVER, BADLY)
    with pytest.raises(KeyError, match="no parameter `k`"):
        found["k"]


def test_contact_duration_makes_the_stiffness_known():
    def both(law):
        return jnp.append(rebounds(law) / 1e-3, law.equivalents(0.73, MASS).duration / 1e-4)

    found = ij.structure_in(both, ij.Walton(1e4, 1e3), 1.0)
    assert (found["k"], found["c"]) == (TOLD, TOLD)


def test_mass_is_never_told_by_a_motion_and_little_damping_not_by_a_short_one():
    ball = ij.ImpactOscillator(
        ij.LinearOscillator(12.0, 0.002, mass=0.5), ij.Stop(ij.Restitution(0.7))
    )
    plan = ij.Experiment(
        ball,
        ij.planned(jnp.linspace(0.0, 1.0, 101), ij.Displacement()),
        ij.InitialState(0.1),
        ij.Sensor(sigma=5e-3),
        free=("mass",),
        simulation=ij.Simulation(max_steps=64, max_impacts=16),
    )
    found = ij.structure(plan)
    assert found["mass"] is NEVER
    assert found["zeta"] is BADLY
    assert (found["omega_n"], found["r"], found["x0"], found["x_dot0"]) == (TOLD,) * 4
    assert ij.structure(dataclasses.replace(plan, sensor=ij.Sensor(sigma=1e-6)))["zeta"] is TOLD
