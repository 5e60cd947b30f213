"""Simulation inside `jax.shard_map`, whose types tell what varies from device to device."""

import os
import subprocess
import sys

from tiers import thorough

SCRIPT = """
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, PartitionSpec
import impactjax as ij

jax.config.update("jax_enable_x64", True)

def last(r, height):
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(ij.{law}))
    run = ij.simulate(
        model, ij.InitialState(height), jnp.array([0.26]), t0=0.0, max_steps=64,
        max_impacts=8, step={step},
    )
    return run.position[0]

def lanes(r, height):
    return jax.vmap(jax.value_and_grad(last))(r, height)

r, height = jnp.linspace(0.5, 0.8, 4), jnp.linspace(0.1, 0.3, 4)
mesh = Mesh(np.array(jax.devices()), ("lanes",))
spec = PartitionSpec("lanes")
split = jax.jit(jax.shard_map(lanes, mesh=mesh, in_specs=(spec, spec), out_specs=spec))
values, slopes = split(r, height)
fall = np.sqrt(2 * np.asarray(height) / 9.81)
since = 0.26 - fall
exact = np.asarray(r) * 9.81 * fall * since - 9.81 * since**2 / 2
{check}
print("right")
"""

RIGID = """
np.testing.assert_allclose(values, exact, rtol=1e-10)
np.testing.assert_allclose(slopes, 9.81 * fall * since, rtol=1e-10)
"""
CHECKS = {
    "rigid": ("Restitution(r)", "None", RIGID),
    "Runge-Kutta": ("Restitution(r)", "ij.RungeKutta()", RIGID),
    "compliant": ("KelvinVoigt(300.0, 0.5 * r)", "None", "assert np.all(np.isfinite(values))"),
}


def run(name: str) -> str:
    law, step, check = CHECKS[name]
    script = SCRIPT.format(law=law, step=step, check=check)
    flags = {"XLA_FLAGS": f"{os.environ['XLA_FLAGS']} --xla_force_host_platform_device_count=2"}
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | flags,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


def test_shard_map_with_rigid_stops():
    assert run("rigid").endswith("right\n")


@thorough
def test_shard_map_with_runge_kutta_steps():
    assert run("Runge-Kutta").endswith("right\n")


@thorough
def test_shard_map_with_compliant_stops():
    assert run("compliant").endswith("right\n")
