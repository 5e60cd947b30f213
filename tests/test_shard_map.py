"""Simulations and solutions inside `jax.shard_map`, whose types tell what varies."""

import os
import subprocess
import sys

import pytest

from tiers import thorough

SCRIPT = """
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, PartitionSpec
import impactjax as ij

jax.config.update("jax_enable_x64", True)

{last}
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

SIMULATED = """
def last(r, height):
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(ij.{law}))
    run = ij.simulate(
        model, ij.InitialState(height), jnp.array([0.26]), t0=0.0, max_steps=64,
        max_impacts=8, step={step},
    )
    return run.position[0]
"""

SOLVED = """
class Ball(ij.HybridSystem):
    r: jax.Array

    def flow(self, t, y, mode):
        return {{"x": y["v"], "v": jnp.full_like(y["v"], -9.81)}}

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: y["x"], self.bounce)]

    def bounce(self, t, y, mode):
        return {{**y, "v": -self.r * y["v"]}}, mode

def last(r, height):
    start = ij.Start(0.0, {{"x": height, "v": 0.0}})
    run = ij.solve(
        Ball(r), start, jnp.array([0.26]), max_steps=64, max_events=8, step={step}
    )
    return run.ys["x"][0]
"""

RIGID = """
np.testing.assert_allclose(values, exact, rtol=1e-10)
np.testing.assert_allclose(slopes, 9.81 * fall * since, rtol=1e-10)
"""
FINITE = "assert np.all(np.isfinite(values))"
CHECKS = {
    "rigid": (SIMULATED.format(law="Restitution(r)", step="None"), RIGID),
    "Runge-Kutta": (SIMULATED.format(law="Restitution(r)", step="ij.RungeKutta()"), RIGID),
    "compliant": (SIMULATED.format(law="KelvinVoigt(300.0, 0.5 * r)", step="None"), FINITE),
    "solved": (SOLVED.format(step="None"), RIGID),
    "solved by Runge-Kutta": (SOLVED.format(step="ij.RungeKutta()"), RIGID),
}


def run(name: str) -> str:
    last, check = CHECKS[name]
    script = SCRIPT.format(last=last, check=check)
    flags = {"XLA_FLAGS": f"{os.environ['XLA_FLAGS']} --xla_force_host_platform_device_count=2"}
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | flags,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


def test_simulation_inside_shard_map():
    assert run("rigid").endswith("right\n")


@thorough
@pytest.mark.parametrize("name", list(CHECKS)[1:])
def test_other_systems_inside_shard_map(name):
    assert run(name).endswith("right\n")
