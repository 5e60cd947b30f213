"""The command survives a compiler that aborts."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import os, sys
from impactjax._cli.attempts import attempted
from impactjax._cli.environment import FAST, SAFE

def command():
    flags = os.environ["XLA_FLAGS"]
    print({FAST: "fast", SAFE: "safe"}.get(flags, flags), flush=True)
    if flags == FAST and sys.argv[1] == "abort":
        os.abort()
    sys.exit(3)

attempted(command)
"""


def run(how: str, **environment: str) -> subprocess.CompletedProcess[str]:
    clean = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, how],
        env={**clean, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.skipif(sys.platform == "win32", reason="there is no fork")
@pytest.mark.parametrize(("how", "tried"), [("work", ["fast"]), ("abort", ["fast", "safe"])])
def test_an_aborted_attempt_is_made_again(how, tried):
    found = run(how)
    assert (found.returncode, found.stdout.split()) == (3, tried)
    assert ("trying again" in found.stderr) == (how == "abort")


def test_what_the_environment_says_is_kept():
    found = run("abort", XLA_FLAGS="--xla_cpu_enable_fast_math=false")
    assert (found.returncode, found.stdout.strip()) == (3, "--xla_cpu_enable_fast_math=false")
