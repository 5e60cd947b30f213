"""The command, tried with the fast options of the compiler first."""

import os
import signal
import sys
import threading
from collections.abc import Callable

from impactjax._cli.compiler_flags import FAST, SAFE

_NOTE = (
    "impactjax: JAX's compiler failed (its report is above); trying again without the option that "
    "makes it fast."
)


def attempted(command: Callable[[], None]) -> None:
    """Runs the command in a child process with fast options; if the compiler aborts that, here
    without them. What the environment says of XLA is kept, and then there is one attempt only.

    To be called before JAX computes anything.
    """
    if "XLA_FLAGS" in os.environ or sys.platform == "win32":
        _run_and_leave(command)
        return
    lifeline, held = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(held)
        threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
        os.environ["XLA_FLAGS"] = FAST
        _run_and_leave(command)
    os.close(lifeline)
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # the child is told, and this one waits
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    signal.signal(signal.SIGINT, before)
    if status != -signal.SIGABRT:
        sys.exit(status if status >= 0 else 128 - status)
    print(_NOTE, file=sys.stderr)
    os.environ["XLA_FLAGS"] = SAFE
    _run_and_leave(command)


def _run_and_leave(command: Callable[[], None]) -> None:
    """Runs what ends with a status, and ends this process without taking all of it to pieces first,
    which takes a second, or waiting for its threads.
    """
    try:
        command()
    except SystemExit as end:
        if not isinstance(end.code, int):
            raise
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(end.code)


def _end_with(lifeline: int) -> None:
    """Ends this process when the one that holds the other end is gone, even if it was killed."""
    os.read(lifeline, 1)
    os._exit(1)
