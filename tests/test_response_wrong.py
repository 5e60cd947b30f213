"""Arguments of the forced response that are wrong end in one sentence.

In a process of its own: here types are checked at run time, which would come first.
"""

import json
import subprocess
import sys

import pytest

from tiers import quick

pytestmark = quick

PROGRAM = """
import json, sys
import jax, jax.numpy as jnp
import impactjax as ij

class Mass(ij.HybridSystem):
    size: float
    many: jax.Array

    def flow(self, t, y, mode):
        return -y

    def transitions(self):
        return []

mass, start = Mass(1.0, jnp.ones(2)), ij.Start(0.0, 1.0)
own = lambda system: system.size
cases = {
    "single": lambda: ij.periodic_orbit(mass, start, 1.0),
    "orbit": lambda: ij.follow(mass, own, (0.0, 1.0)),
    "doubled": lambda: ij.doubled(mass),
    "sweep": lambda: ij.diagram(mass, start, 1.0, own, [1.0], sweep="up"),
    "where": lambda: ij.diagram(mass, start, 1.0, lambda system: system.many, [1.0]),
    "values": lambda: ij.diagram(mass, start, 1.0, own, ["a"]),
    "keep": lambda: ij.diagram(mass, start, 1.0, own, [1.0], keep=1),
    "interval": lambda: ij.lyapunov(mass, start, 0.0),
    "count": lambda: ij.lyapunov(mass, start, 1.0, count=1),
    "exponents": lambda: ij.lyapunov(1.0, start, 1.0),
    "system": lambda: ij.periodic_orbit(start, start, 1.0),
    "start": lambda: ij.periodic_orbit(mass, 1.0, 1.0),
    "period": lambda: ij.periodic_orbit(mass, start, 0.0),
    "multiple": lambda: ij.periodic_orbit(mass, start, 1.0, multiple=0),
}
found = {}
for name, case in cases.items():
    jax.config.update("jax_enable_x64", name != "single")
    try:
        case()
    except (TypeError, ValueError) as error:
        found[name] = f"{type(error).__name__}: {error}"
json.dump(found, sys.stdout)
"""

SENTENCES = {
    "single": "ValueError: Periodic orbits need double precision: set `jax_enable_x64`.",
    "orbit": "TypeError: Argument `orbit` must be an Orbit, such as ",
    "doubled": "TypeError: Argument `orbit` must be an Orbit, such as ",
    "sweep": "TypeError: Argument `sweep` must be a Sweep, such as `WithMemory()`, but it is 'up'",
    "where": "ValueError: Argument `where` must select one real number of the system, such as ",
    "values": "TypeError: Argument `values` must be made of real numbers, but it is ['a'].",
    "keep": "ValueError: Argument `keep` must be at least 2, but it is 1.",
    "interval": "ValueError: Argument `interval` must be positive and finite, but it is 0.0.",
    "count": "ValueError: Argument `count` must be at least 4, but it is 1.",
    "exponents": "TypeError: Argument `system` must be a HybridSystem, such as ",
    "system": "TypeError: Argument `system` must be a HybridSystem, such as ",
    "start": "TypeError: Argument `start` must be a Start, such as `Start(t=0.0, y=y0)`, but it ",
    "period": "ValueError: Argument `period` must be positive and finite, but it is 0.0.",
    "multiple": "ValueError: Argument `multiple` must be at least 1, but it is 0.",
}


@pytest.fixture(scope="module")
def said() -> dict[str, str]:
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    return json.loads(run.stdout)


@pytest.mark.parametrize("case", SENTENCES)
def test_wrong_argument_is_refused_with_a_sentence(said, case):
    assert said[case].startswith(SENTENCES[case])


def test_every_case_is_refused(said):
    assert said.keys() == SENTENCES.keys()
