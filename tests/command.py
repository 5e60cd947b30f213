"""The command `impactjax`, with standard type promotion as it sets up itself."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import jax
from typer.testing import CliRunner

from impactjax._cli.main import app


class Run(NamedTuple):
    """Output of a run of the command."""

    status: int
    stdout: str
    stderr: str


def impactjax(*arguments: str | Path) -> Run:
    """Runs the command in this process; an exception that it lets out comes out here."""
    with jax.numpy_dtype_promotion("standard"):
        run = CliRunner().invoke(app, [str(each) for each in arguments])
    if run.exception is not None and not isinstance(run.exception, SystemExit):
        raise run.exception
    return Run(run.exit_code, run.stdout, run.stderr)


def impactjax_in_its_own_process(*arguments: str | Path) -> Run:
    """Runs the command under its own options of the compiler: faster where it computes for long."""
    environment = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    words = [sys.executable, "-m", "impactjax", *map(str, arguments)]
    run = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    return Run(run.returncode, run.stdout, run.stderr)


class Fitted(NamedTuple):
    """Output and files of a fit."""

    stdout: str
    document: dict[str, Any]
    page: str

    @property
    def best(self) -> dict[str, Any]:
        return self.document["fits"][0]

    def parameter(self, name: str) -> dict[str, Any]:
        return self.best["parameters"][name]


def fitted(out: Path, *arguments: str | Path) -> Fitted:
    """Runs a fit that must succeed, quietly, since a test is no terminal."""
    run = impactjax("fit", *arguments, "--out", out)
    assert (run.status, run.stderr) == (0, "")
    document = json.loads((out / "fit.json").read_text(), parse_constant=_no_constant)
    return Fitted(run.stdout, document, (out / "report.html").read_text())


def _no_constant(name: str) -> float:
    raise AssertionError(f"{name} is not JSON")
