"""A study of simulations that is killed, finds the disk full, and runs on a cluster and on devices.

    python benchmarks/study.py [--lanes 100000] [--kills 20] [--only NAME ...]

Lanes are motions of a Kelvin-Voigt pendulum, in chunks of 1024. Each row is one way to run the
study: seconds with starting Python and compiling, interruptions, the most chunks that one of them
lost, and whether the files have the bytes of the first, undisturbed run. Every second kill waits
for a file that is being written. The disk that is full is a file system in memory, which only the
superuser can mount; other users get a limit on the size of a file.
"""

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij

RANGES = {"omega0": ij.LogUniform(300.0, 1500.0), "gamma": (0.02, 0.6), "theta0": (0.3, 0.9)}
CHUNK = 1024


def lane(omega0, gamma, theta0):
    """Speeds after the first impacts of a pendulum that is released at rest."""
    pendulum = ij.Pendulum(omega_n=13.0, zeta=0.02, length=0.071)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(omega0, gamma)))
    run = ij.simulate(
        model, ij.InitialState(theta0), jnp.linspace(0.0, 1.4, 8), max_impacts=16, max_steps=384
    )
    return {
        "speed": run.impacts.separation_speed,
        "impacts": run.impacts.count,
        "angle": run.position,
        "result": run.result,
    }


def many_impacts(gamma, **_):
    """A light damping has more impacts before rest, and a soft contact takes longer steps."""
    return -gamma


def work(folder: Path, lanes: int, way: str) -> None:
    """One run of the study, in this process. It prints what each chunk took to be kept."""
    jax.config.update("jax_enable_x64", True)
    design = ij.LatinHypercube(RANGES, lanes, seed=1)
    if way == "limited":
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
    told = {"cost": many_impacts if way == "cost" else None, "chunk": CHUNK}
    clock: list[float] = []

    def tell(now: ij.Progress) -> None:
        if not clock:
            print(json.dumps({"kept": now.done}), flush=True)
        clock.append(time.perf_counter())

    try:
        if way == "dask":
            found = on_cluster(design, folder, told, tell)
        else:
            found = ij.study(lane, design, folder, progress=tell, **told)
    except ij.StudyError as error:
        print(json.dumps({"error": str(error)}))
        return
    rate = (len(clock) - 2) * CHUNK / (clock[-1] - clock[1]) if len(clock) > 2 else float("nan")
    print(json.dumps({"rate": rate, "failed": int(found.failed.sum())}))


def on_cluster(design, folder, told, tell):
    """The study on two processes, one of which is killed after a third of the lanes."""
    from distributed import Client, LocalCluster

    options: Any = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(**options, silence_logs=50) as cluster, Client(cluster) as client:
        processes: Any = client.run(os.getpid)
        workers = [*processes.values()]

        def kill(now: ij.Progress) -> None:
            tell(now)
            if len(workers) > 1 and now.done > now.lanes / 3:
                os.kill(workers.pop(), signal.SIGKILL)

        found = ij.study(lane, design, folder, client=client, progress=kill, **told)
        assert len(workers) == 1
        return found


def started(folder: Path, lanes: int, way: str, **environment: str) -> subprocess.Popen[str]:
    """A run in a process of its own."""
    return subprocess.Popen(
        [sys.executable, __file__, "--work", str(folder), "--lanes", str(lanes), "--way", way],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    )


def said(process: subprocess.Popen[str]) -> dict[str, object]:
    """All that a run has printed, when it has ended."""
    printed, _ = process.communicate()
    found: dict[str, object] = {}
    for line in printed.splitlines():
        found |= json.loads(line)
    return found


def chunks(folder: Path) -> int:
    return len([*folder.glob("chunk-*.npy")])


def wait_for_a_draft(folder: Path, process: subprocess.Popen[str]) -> None:
    """Waits until the next chunk of a run is being written, or the run has ended."""
    number = chunks(folder)
    while process.poll() is None:
        path = folder / f"chunk-{number:06d}.npy"
        if os.path.exists(f"{path}.partial"):
            return
        number += path.exists()


def killed(folder: Path, lanes: int, kills: int, seconds: float) -> str:
    """Kills a study at random moments, and completes it. Returns what was lost."""
    draw, most, writing = random.Random(3), 0, 0
    done = 0
    for number in range(kills):
        before = chunks(folder)
        process = started(folder, lanes, "plain")
        while process.poll() is None and chunks(folder) == before:
            time.sleep(0.002)
        time.sleep(draw.uniform(0.0, 1.2 * seconds / kills))
        if number % 2:
            wait_for_a_draft(folder, process)
        done += process.poll() is None
        process.kill()
        kept = said(process).get("kept", 0)
        writing += bool([*folder.glob("*.partial")])
        most = max(most, before + int(str(kept)) // -CHUNK)
    said(started(folder, lanes, "plain"))
    return f"{done} kills ({writing} while writing), {most} finished chunks lost"


def full_disk(folder: Path, lanes: int) -> str:
    """Fills a small file system, then makes it larger."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={70 * lanes}", "study", str(folder)]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        error = said(started(folder / "store", lanes, "limited"))["error"]
        said(started(folder / "store", lanes, "plain"))
        return f"limit: {error}"
    try:
        error = said(started(folder / "store", lanes, "plain"))["error"]
        kept, drafts = chunks(folder / "store"), [*(folder / "store").glob("*.partial")]
        assert not drafts
        subprocess.run(["mount", "-o", "remount,size=2g", str(folder)], check=True)
        again = said(started(folder / "store", lanes, "plain"))
        assert again["kept"] == kept * CHUNK
        shutil.copytree(folder / "store", folder.with_name("full-copy"))
    finally:
        subprocess.run(["umount", str(folder)], check=True)
    return f"{kept} chunks kept; {str(error).split('npy')[-1]}"


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def main() -> None:
    """Prints the table."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--lanes", type=int, default=100_000)
    arguments.add_argument("--kills", type=int, default=20)
    arguments.add_argument(
        "--only", nargs="*", default=["kills", "disk", "dask", "devices", "cost"]
    )
    arguments.add_argument("--work")
    arguments.add_argument("--way", default="plain")
    given = arguments.parse_args()
    if given.work:
        work(Path(given.work), given.lanes, given.way)
        return
    with tempfile.TemporaryDirectory() as name:
        root, lanes = Path(name), given.lanes
        begin = time.perf_counter()
        first = said(started(root / "first", lanes, "plain"))
        seconds = time.perf_counter() - begin
        row("undisturbed", seconds, f"{first['rate']:.0f} lanes/s; {first['failed']} failed")
        rest = lanes / float(str(first["rate"]))
        flags = "--xla_force_host_platform_device_count=4"
        ways: dict[str, Callable[[Path], str]] = {
            "kills": lambda folder: killed(folder, lanes, given.kills, rest),
            "disk": lambda folder: full_disk(folder, lanes),
            "dask": lambda folder: rate(said(started(folder, lanes, "dask"))),
            "devices": lambda folder: rate(said(started(folder, lanes, "plain", XLA_FLAGS=flags))),
            "cost": lambda folder: rate(said(started(folder, lanes, "cost"))),
        }
        expected = content(root / "first")
        for way in given.only:
            begin = time.perf_counter()
            told = ways[way](root / way)
            took = time.perf_counter() - begin
            if way == "cost":
                same = same_results(root / "first", root / way)
            else:
                own = root / (
                    "full-copy" if (root / "full-copy").exists() and way == "disk" else way
                )
                own = own / "store" if (own / "store").exists() else own
                same = content(own) == expected
            row(way, took, f"{told}; {'same bytes' if same else 'OTHER BYTES'}")


def rate(found: dict[str, object]) -> str:
    return f"{found['rate']:.0f} lanes/s"


def same_results(one: Path, other: Path) -> bool:
    a, b = ij.io.read_study(one), ij.io.read_study(other)
    return all(np.array_equal(a[name], b[name], equal_nan=True) for name in ("speed", "result"))


def row(name: str, seconds: float, told: str) -> None:
    print(f"{name:12} {seconds:7.1f} s  {told}", flush=True)


if __name__ == "__main__":
    main()
