"""Importing is silent, computes nothing and changes nothing."""

import json
import os
import subprocess
import sys
from pathlib import Path

import diffrax
import pytest

import impactjax as ij
from tiers import quick

pytestmark = quick

PROGRAM = """
import json, sys
import jax

before = dict(jax.config.values)
import impactjax

after = dict(jax.config.values)
changed = sorted(name for name in after if after[name] != before.get(name))
print(json.dumps({"changed": changed, "modules": sorted(sys.modules)}))
"""

FIT = """
import contextlib, json, sys
from impactjax._cli.compiler_flags import prepare
from impactjax._cli.main import app

prepare()
with contextlib.redirect_stdout(None):
    app([*sys.argv[1:], "--law", "kelvin-voigt"], standalone_mode=False)
print(json.dumps(sorted(sys.modules)))
"""

RECORDING = Path(__file__).parent.parent / "data" / "kelvin_voigt.csv"
SELDOM = {
    *("diffrax", "h5py", "matplotlib", "numpyro", "optax", "pandas", "scipy.signal"),
    *("scipy.stats", "xarray"),
}


def in_a_new_process(program: str, *arguments: str, **environment: str) -> str:
    """Output of a program for which any warning is an error; it must write nothing to stderr."""
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", program, *arguments],
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
    heavy = {*SELDOM, "scipy.optimize", "typer", "rich", "jinja2"}
    assert not heavy & set(found["modules"])


def test_fit_of_a_table_imports_only_needed_modules():
    found = json.loads(in_a_new_process(FIT, "fit", str(RECORDING)))
    assert "impactjax" in found
    assert not SELDOM & set(found)


def test_late_imports_are_available():
    assert "Taylor" in dir(ij)
    assert issubclass(ij.Taylor, diffrax.AbstractSolver)
    with pytest.raises(AttributeError, match="no attribute 'Tailor'"):
        _ = ij.Tailor


def test_import_test_can_fail():
    program = "import jax.numpy as jnp\ntry: jnp.zeros(1)\nexcept RuntimeError: print('caught')"
    assert in_a_new_process(program, JAX_PLATFORMS="nowhere") == "caught\n"


def test_command_import_loads_no_heavy_modules():
    assert in_a_new_process("import impactjax._cli.main", JAX_PLATFORMS="nowhere") == ""
