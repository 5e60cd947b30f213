"""Importing is silent, computes nothing and changes nothing."""

import json
import os
import subprocess
import sys

PROGRAM = """
import json, sys
import jax

before = dict(jax.config.values)
import impactjax

after = dict(jax.config.values)
changed = sorted(name for name in after if after[name] != before.get(name))
print(json.dumps({"changed": changed, "modules": sorted(sys.modules)}))
"""


def in_a_new_process(program: str, **environment: str) -> str:
    """Output of a program for which any warning is an error; it must write nothing to stderr."""
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )
    assert (run.returncode, run.stderr) == (0, "")
    return run.stdout


def test_import_changes_no_setting_and_computes_nothing():
    """A platform that does not exist would fail with the first array."""
    found = json.loads(in_a_new_process(PROGRAM, JAX_PLATFORMS="nowhere"))
    assert found["changed"] == []
    heavy = {"matplotlib", "scipy.signal", "scipy.optimize", "pandas", "typer", "rich", "jinja2"}
    assert not heavy & set(found["modules"])


def test_the_test_above_can_fail():
    program = "import jax.numpy as jnp\ntry: jnp.zeros(1)\nexcept RuntimeError: print('caught')"
    assert in_a_new_process(program, JAX_PLATFORMS="nowhere") == "caught\n"


def test_the_command_starts_as_quietly():
    assert in_a_new_process("import impactjax._cli.main", JAX_PLATFORMS="nowhere") == ""
