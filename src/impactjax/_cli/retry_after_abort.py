"""Second attempt of the command, without fast compiler options, if the compiler aborts."""

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
    """Runs the command in a child process with the fast options of XLA. If the compiler aborts the
    child, the command runs in this process without them.

    If the environment sets XLA_FLAGS, they are kept and there is one attempt only. Call it before
    JAX computes anything.
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
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # the child gets the signal as well
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    signal.signal(signal.SIGINT, before)
    if status != -signal.SIGABRT:
        sys.exit(status if status >= 0 else 128 - status)
    print(_NOTE, file=sys.stderr)
    os.environ["XLA_FLAGS"] = SAFE
    _run_and_leave(command)


def _run_and_leave(command: Callable[[], None]) -> None:
    """Runs a command that ends with a status, and exits at once: without the interpreter's cleanup,
    which takes a second, and without waiting for threads.
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
    """Ends this process when the process at the other end of the pipe has ended or was killed."""
    os.read(lifeline, 1)
    os._exit(1)
