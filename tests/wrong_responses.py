"""Arguments of the forced response that are wrong end in one sentence."""

PROGRAM = """
import jax, jax.numpy as jnp
import impactjax as ij

jax.config.update("jax_enable_x64", True)

class Mass(ij.HybridSystem):
    size: float
    many: jax.Array

    def flow(self, t, y, mode):
        return -y

    def transitions(self):
        return []

mass, start = Mass(1.0, jnp.ones(2)), ij.Start(0.0, 1.0)
own = lambda system: system.size

def single():
    jax.config.update("jax_enable_x64", False)
    try:
        ij.periodic_orbit(mass, start, 1.0)
    finally:
        jax.config.update("jax_enable_x64", True)

cases = {
    "single": single,
    "orbit": lambda: ij.follow(mass, own, (0.0, 1.0)),
    "doubled": lambda: ij.doubled(mass),
    "sweep": lambda: ij.diagram(mass, start, 1.0, own, [1.0], sweep="up"),
    "where": lambda: ij.diagram(mass, start, 1.0, lambda system: system.many, [1.0]),
    "computed": lambda: ij.diagram(mass, start, 1.0, lambda system: 2 * system.size, [1.0]),
    "function": lambda: ij.diagram(mass, start, 1.0, None, [1.0]),
    "values": lambda: ij.diagram(mass, start, 1.0, own, ["a"]),
    "keep": lambda: ij.diagram(mass, start, 1.0, own, [1.0], keep=1),
    "angle": lambda: ij.diagram(ij.ImpactOscillator(ij.Pendulum(13.0)), 0.3, 1.0, own, [1.0]),
    "of lyapunov": lambda: ij.lyapunov(mass, start, 0.0),
    "count": lambda: ij.lyapunov(mass, start, 1.0, count=1),
    "exponents": lambda: ij.lyapunov(1.0, start, 1.0),
    "system": lambda: ij.periodic_orbit(start, start, 1.0),
    "start": lambda: ij.periodic_orbit(mass, 1.0, 1.0),
    "period": lambda: ij.periodic_orbit(mass, start, 0.0),
    "no period": lambda: ij.periodic_orbit(mass, start, lambda system: None),
    "multiple": lambda: ij.periodic_orbit(mass, start, 1.0, multiple=0),
}
"""

SENTENCES = {
    "single": "ValueError: Periodic orbits need double precision: set `jax_enable_x64`.",
    "orbit": "TypeError: Argument `orbit` must be an Orbit, such as ",
    "doubled": "TypeError: Argument `orbit` must be an Orbit, such as ",
    "sweep": "TypeError: Argument `sweep` must be a Sweep, such as `WithMemory()`, but it is 'up'",
    "where": "ValueError: Argument `where` must select one real number of the system, such as ",
    "computed": "ValueError: Argument `where` must select one real number of the system, such as ",
    "function": "TypeError: Argument `where` must be a function, but it is None.",
    "values": "TypeError: Argument `values` must be made of real numbers, but it is ['a'].",
    "keep": "ValueError: Argument `keep` must be at least 2, but it is 1.",
    "angle": "TypeError: Argument `start` must be an InitialState, such as `InitialState(0.3)`",
    "of lyapunov": "ValueError: Argument `period` must be positive and finite, but it is 0.0.",
    "count": "ValueError: Argument `count` must be at least 4, but it is 1.",
    "exponents": "TypeError: Argument `system` must be a HybridSystem, such as ",
    "system": "TypeError: Argument `system` must be a HybridSystem, such as ",
    "start": "TypeError: Argument `start` must be a Start, such as `Start(t=0.0, y=y0)`, but it ",
    "period": "ValueError: Argument `period` must be positive and finite, but it is 0.0.",
    "no period": "TypeError: Argument `period` must return one number, but it returns a NoneType.",
    "multiple": "ValueError: Argument `multiple` must be at least 1, but it is 0.",
}
