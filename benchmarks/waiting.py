"""How long people wait: a Markdown table of wall and CPU seconds, medians of fresh processes.

    python benchmarks/waiting.py [--runs 3] [--only hertz --only simulate]

Each run is a process with a folder of its own for compiled programs, empty at first; "warm" comes
right after the same in the same folder. CPU seconds are those of the process and of all that it
started, in user and system. What is asked in Python counts from the end of the imports, without any
folder, under JAX's own options.
"""

import argparse
import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

RECORD = Path(__file__).parent.parent / "data" / "kelvin_voigt.csv"
FEWER = 10  # samples of the record of another length

PROLOGUE = """
import json, sys, time
from pathlib import Path
import jax
jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp
import impactjax as ij

recording = ij.io.read_recording(Path(sys.argv[1])).recording
sensor = ij.Sensor(low_pass=ij.Butterworth(50.0))
initial, ts = ij.InitialState(0.78), jnp.linspace(0.0, 1.4, 1401)

def system(omega0):
    pendulum = ij.Pendulum(omega_n=13.0, zeta=0.002, length=0.071)
    return ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(omega0=omega0, gamma=0.2)))

def position(omega0):
    return ij.simulate(system(omega0), initial, ts, t0=0.0).position

begin = time.perf_counter(), time.process_time()
"""
EPILOGUE = """
jax.block_until_ready(found)
end = time.perf_counter(), time.process_time()
print(json.dumps([end[0] - begin[0], end[1] - begin[1]]))
"""
FIT = "found = ij.fit(ij.Experiment(system(600.0), recording, initial, sensor))"


class Waiting(NamedTuple):
    """Seconds."""

    wall: float
    cpu: float


class Row(NamedTuple):
    """Something to wait for: a program, or the laws of a fit; `after` is what ran before in the
    same folder, by the number of samples that its record lacks.
    """

    name: str
    what: str
    laws: tuple[str, ...] = ()
    program: str = ""
    after: tuple[int, ...] = ()

    def run(self, folder: Path) -> Waiting:
        """Once, with the folder for all that is written."""
        for fewer in self.after:
            _fit(self.laws, _record(folder, fewer), folder)
        if self.program:
            return _in_python(self.program, folder)
        return _fit(self.laws, RECORD, folder)


KELVIN_VOIGT, HERTZ, HUNT_CROSSLEY = ("kelvin-voigt",), ("hertz",), ("hunt-crossley",)

TABLE = (
    Row("kelvin-voigt", "fit, Kelvin-Voigt, empty cache", KELVIN_VOIGT),
    Row("kelvin-voigt-warm", "the same, warm", KELVIN_VOIGT, after=(0,)),
    Row("length", "after a record of another length", KELVIN_VOIGT, after=(FEWER,)),
    Row("usual", "usual laws, empty cache"),
    Row("usual-warm", "the same, warm", after=(0,)),
    Row("hertz", "fit, Hertz, empty cache", HERTZ),
    Row("hertz-warm", "the same, warm", HERTZ, after=(0,)),
    Row("hunt-crossley", "fit, Hunt-Crossley, empty cache", HUNT_CROSSLEY),
    Row("hunt-crossley-warm", "the same, warm", HUNT_CROSSLEY, after=(0,)),
    Row("fit", "first `ij.fit` of Kelvin-Voigt in Python", program=FIT),
    Row("simulate", "first `ij.simulate`", program="found = position(600.0)"),
    Row("jacobian", "the same with Jacobian", program="found = jax.jacfwd(position)(600.0)"),
)


def _record(folder: Path, fewer: int) -> Path:
    """The record without its last samples, with its sidecar."""
    if not fewer:
        return RECORD
    lines = RECORD.read_text().splitlines(keepends=True)
    path = folder / f"{fewer}_fewer.csv"
    path.write_text("".join(lines[:-fewer]))
    shutil.copy(RECORD.with_suffix(".toml"), path.with_suffix(".toml"))
    return path


def _fit(laws: tuple[str, ...], record: Path, folder: Path) -> Waiting:
    asked = [word for law in laws for word in ("--law", law)]
    own = {"JAX_COMPILATION_CACHE_DIR": str(folder / "cache"), "XDG_CACHE_HOME": str(folder)}
    command = [sys.executable, "-m", "impactjax", "fit", str(record), *asked]
    before, begin = _cpu(), time.perf_counter()
    subprocess.run(
        [*command, "--out", str(folder / "out"), "--force"],
        env={**_environment(), **own},
        check=True,
        capture_output=True,
    )
    return Waiting(time.perf_counter() - begin, _cpu() - before)


def _in_python(program: str, folder: Path) -> Waiting:
    run = subprocess.run(
        [sys.executable, "-c", PROLOGUE + program + EPILOGUE, str(RECORD)],
        env={**_environment(), "XDG_CACHE_HOME": str(folder)},
        check=True,
        capture_output=True,
        text=True,
    )
    return Waiting(*json.loads(run.stdout))


def _environment() -> dict[str, str]:
    """Without what would choose another folder or other options."""
    settings = ("JAX_COMPILATION_CACHE_DIR", "XLA_FLAGS")
    return {name: value for name, value in os.environ.items() if name not in settings}


def _cpu() -> float:
    """Of all that has ended, with what it started."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _median(row: Row, runs: int) -> Waiting:
    found = []
    for _ in range(runs):
        with tempfile.TemporaryDirectory() as folder:
            found.append(row.run(Path(folder)))
    walls, cpus = zip(*found, strict=True)
    return Waiting(statistics.median(walls), statistics.median(cpus))


def main() -> None:
    parser = argparse.ArgumentParser(description="How long people wait.")
    parser.add_argument("--runs", type=int, default=3, help="of which to take the medians")
    names = [row.name for row in TABLE]
    parser.add_argument("--only", action="append", choices=names, help="a row; several times")
    arguments = parser.parse_args()
    print("| what | wall [s] | CPU [s] |\n|---|---|---|")
    for row in TABLE:
        if row.name in (arguments.only or names):
            wall, cpu = _median(row, arguments.runs)
            print(f"| {row.what} | {wall:.1f} | {cpu:.1f} |", flush=True)


if __name__ == "__main__":
    main()
