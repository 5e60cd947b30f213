"""Compares impactjax with other tools on the tasks of `rivals/tasks.py`: a JSON line each.

    python benchmarks/peers.py [--quick] [--task T2] [--peer heyoka] [--cores 1]

Needs mpmath and SciPy for the reference. The peers are optional: what is not installed is said in
its line. Times are per trajectory (in T5 per fit), compilation excluded; `ratio` is ours over
theirs, below 1 where impactjax is faster. `status` is "ours not implemented" while `ours.py` lacks
a task.
"""

import argparse
import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from typing import NamedTuple

OF_JAX = "diffrax"  # under our compiler options JAX aborts: a process of its own, without them
PEERS = ("heyoka", "numba", "scipy", "pydiffsol", OF_JAX)
LAWS = ("restitution", "kelvin-voigt")
FORCED_LAWS = ("kelvin-voigt",)


class Task(NamedTuple):
    """A row of the table; a rival's function may be a variant of ours."""

    task: str
    part: str
    function: str
    laws: tuple[str, ...] = LAWS
    variant: str = ""

    @property
    def rival_function(self) -> str:
        return self.function + self.variant


TABLE = (
    Task("T1", "one trajectory", "t1"),
    Task("T2", "batch", "t2"),
    Task("T3", "one trajectory, derivatives", "t3"),
    Task("T3", "batch, derivatives", "t3_batch"),
    Task("T4", "forced record", "t4", FORCED_LAWS),
    Task("T4", "forced sweep", "t4_sweep", FORCED_LAWS),
    Task("T5", "fit", "t5"),
    Task("T5", "fit", "t5", variant="_compiled"),
)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Compare impactjax with its peers.")
    parser.add_argument("--quick", action="store_true", help="few repetitions")
    parser.add_argument("--task", choices=sorted({row.task for row in TABLE}))
    parser.add_argument("--peer", choices=PEERS)
    parser.add_argument("--cores", type=int, default=1, help="cores this process may use")
    return parser.parse_args()


def _bind(cores: int) -> int:
    """Binds the process to so many cores: libraries size their thread pools by it."""
    if not hasattr(os, "sched_setaffinity"):
        return os.cpu_count() or 1
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-cores:])
    return len(os.sched_getaffinity(0))


def _chosen(arguments: argparse.Namespace) -> Iterator[tuple[Task, str, str]]:
    """The comparisons asked for: row, law, peer."""
    for row in TABLE:
        for law in row.laws:
            for peer in PEERS:
                asked = arguments.peer == peer or (arguments.peer is None and peer != OF_JAX)
                if asked and arguments.task in (None, row.task):
                    yield row, law, peer


def main() -> None:
    arguments = _arguments()
    if arguments.peer == OF_JAX:
        os.environ.setdefault("XLA_FLAGS", "")
    cores = _bind(arguments.cores)
    # only now: numerical libraries count the cores when they are loaded
    compare = importlib.import_module("compare")
    for row, law, peer in _chosen(arguments):
        line = compare.line(row, law, peer, arguments.quick)
        if line is not None:
            print(json.dumps({**line, "cores": cores}), flush=True)
    if arguments.peer is None:
        without = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
        subprocess.run([sys.executable, *sys.argv, "--peer", OF_JAX], env=without, check=True)


if __name__ == "__main__":
    main()
