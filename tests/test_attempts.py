"""The command survives a compiler that aborts."""

import os
import signal
import subprocess
import sys

import pytest

PROGRAM = """
import os, sys, threading, time
from impactjax._cli.retry_after_abort import attempted
from impactjax._cli.compiler_flags import FAST, SAFE

def command():
    flags = os.environ["XLA_FLAGS"]
    print({FAST: "fast", SAFE: "safe"}.get(flags, flags), flush=True)
    if flags == FAST and sys.argv[1] == "abort":
        os.abort()
    if sys.argv[1] == "wait":
        print(os.getpid(), flush=True)
        time.sleep(600)
    if sys.argv[1] == "busy":
        threading.Thread(target=time.sleep, args=(600,)).start()
    print("end")  # in the buffer still
    sys.exit(3)

attempted(command)
"""


def run(how: str, **environment: str) -> subprocess.CompletedProcess[str]:
    unset = ("XLA_FLAGS", "PYTHONUNBUFFERED")
    clean = {name: value for name, value in os.environ.items() if name not in unset}
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, how],
        env={**clean, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@pytest.mark.skipif(sys.platform == "win32", reason="there is no fork")
@pytest.mark.parametrize(
    ("how", "tried"), [("work", ["fast", "end"]), ("abort", ["fast", "safe", "end"])]
)
def test_aborted_attempt_is_repeated_with_safe_flags(how, tried):
    found = run(how)
    assert (found.returncode, found.stdout.split()) == (3, tried)
    assert ("trying again" in found.stderr) == (how == "abort")


def test_xla_flags_of_the_environment_are_kept():
    found = run("abort", XLA_FLAGS="--xla_cpu_enable_fast_math=false")
    assert found.returncode == 3
    assert found.stdout.split() == ["--xla_cpu_enable_fast_math=false", "end"]


@pytest.mark.parametrize("environment", [{}, {"XLA_FLAGS": "--xla_cpu_enable_fast_math=false"}])
def test_exit_does_not_wait_for_threads(environment):
    found = run("busy", **environment)
    assert (found.returncode, found.stdout.split()[-1]) == (3, "end")


@pytest.mark.skipif(sys.platform == "win32", reason="there is no fork")
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_child_ends_when_the_command_is_killed(how):
    clean = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "wait"], env=clean, stdout=subprocess.PIPE, text=True
    ) as command:
        assert command.stdout is not None
        assert command.stdout.readline() == "fast\n"
        working = int(command.stdout.readline())
        assert working != command.pid
        command.send_signal(how)
        assert command.stdout.read() == ""  # ends only when the child has let go of it too
