"""Studies that are killed, find the disk full, or run on several devices or processes: their files
have the same bytes as those of an undisturbed run.
"""

import json
import os
import subprocess
import sys

import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from tiers import mostly_thorough, thorough

SETUP = """
import json, os, random, resource, signal, sys, time
from pathlib import Path
import jax
import jax.numpy as jnp
import scipy.stats.qmc
import impactjax as ij

jax.config.update("jax_enable_x64", True)
folder = Path(sys.argv[1])
design = ij.LatinHypercube({"x": (0.0, 1.0), "y": (1.0, 2.0)}, 3000)

def lane(x, y):
    return {"wave": jnp.sin(x * jnp.arange(20.0)) / y, "sum": x + y}

def run(progress=None):
    return ij.study(lane, design, folder, chunk=16, progress=progress)
"""

KILLED = """
def chunks():
    return {path.name for path in folder.glob("chunk-*.npy")}

def child(log):
    kept = []
    run(lambda now: kept or kept.append(log.write_text(str(now.done))))

log, draw, told = folder.with_suffix(".log"), random.Random(1), []
for _ in range(10):
    before = chunks()
    pid = os.fork()  # nothing has been computed yet, so that JAX has no threads
    if pid == 0:
        child(log)
        os._exit(0)
    while not os.waitpid(pid, os.WNOHANG)[0] and chunks() == before:
        time.sleep(0.001)
    time.sleep(draw.uniform(0.0, 0.04))
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    drafts = [path.name for path in folder.glob("*.partial")]
    told.append([len(before), int(log.read_text()), len(chunks()), before <= chunks(), drafts])
run()
print(json.dumps(told))
"""

FULL = """
pid = os.fork()
if pid == 0:
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
    try:
        run()
    except ij.StudyError as error:
        print(json.dumps([str(error), sorted(path.name for path in folder.iterdir())]))
        sys.stdout.flush()
    os._exit(0)
os.waitpid(pid, 0)
run()
"""


CLUSTER = """
from distributed import Client, LocalCluster

def kill(now):
    if workers and now.done > 400:
        os.kill(workers.pop(), signal.SIGKILL)

separate = sys.argv[2] == "processes"
cluster = LocalCluster(
    n_workers=2, threads_per_worker=1, processes=separate, dashboard_address=None, silence_logs=50
)
with cluster, Client(cluster) as client:
    before = set(client.run(os.getpid).values())
    workers = [*before] if separate else []
    found = ij.study(lane, design, folder, chunk=16, client=client, progress=kill)
    assert not workers or len(workers) == 1, workers
print(found.notes)
"""


CONSTANTS = """
def scaled(first):
    factors = jnp.arange(first, first + 50.0)
    return lambda x, y: factors * x + y

ij.study(scaled(0.0), design, folder)
try:
    ij.study(scaled(1.0), design, folder)
except ij.StudyError as error:
    print(error)
"""


def output(program, *arguments, **environment):
    done = subprocess.run(
        [sys.executable, "-c", SETUP + program, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "JAX_COMPILATION_CACHE_DIR": "", **environment},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "undisturbed"
    output("run()", folder)
    files = content(folder)
    assert len(files) == 189
    return files


def test_study_killed_at_any_moment_loses_one_chunk_and_no_byte(undisturbed, tmp_path):
    told = json.loads(output(KILLED, tmp_path / "store"))
    for before, kept, after, nothing_lost, drafts in told:
        assert kept == min(16 * before, 3000)
        assert nothing_lost
        assert len(drafts) <= 1
        assert after > before
    assert content(tmp_path / "store") == undisturbed


@pytest.mark.parametrize("limit", mostly_thorough([100, 2000], 2000))
def test_full_disk_is_said_and_leaves_no_part_of_a_file(limit, undisturbed, tmp_path):
    """A limit on the size of a file fails in the middle of writing, as a full disk does."""
    error, files = json.loads(output(FULL, tmp_path / "store", limit))
    name = "study.json" if limit == 100 else "chunk-000000.npy"
    assert f"{name} cannot be written (File too large); make room" in error
    assert files == ([] if limit == 100 else ["study.json"])
    assert content(tmp_path / "store") == undisturbed


def test_several_devices_write_the_same_bytes(undisturbed, tmp_path):
    flags = os.environ["XLA_FLAGS"] + " --xla_force_host_platform_device_count=4"
    printed = output("run(); print(len(jax.devices()))", tmp_path / "store", XLA_FLAGS=flags)
    assert printed == "4\n"
    assert content(tmp_path / "store") == undisturbed


@pytest.mark.parametrize("workers", mostly_thorough(["threads", "processes"], "threads"))
def test_cluster_writes_the_same_bytes(workers, undisturbed, tmp_path):
    """One of the two processes is killed on the way."""
    assert output(CLUSTER, tmp_path / "store", workers) == "()\n"
    assert content(tmp_path / "store") == undisturbed


@thorough
def test_constants_of_a_function_count_where_jax_hoists_them(tmp_path):
    """Later versions of JAX may keep what a function closes over outside its program."""
    printed = output(CONSTANTS, tmp_path / "store", JAX_USE_SIMPLIFIED_JAXPR_CONSTANTS="1")
    assert "holds a study of another function" in printed


def test_simulations_are_lanes(tmp_path):
    """A ball that falls from rest leaves the floor with r times √(2 g h)."""

    def lane(r, height):
        model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(ij.Restitution(r)))
        run = ij.simulate(
            model, ij.InitialState(height), jnp.array([0.5]), t0=0.0, max_steps=32, max_impacts=4
        )
        return {"speed": run.impacts.separation_speed[0], "result": run.result}

    grid = ij.Grid(r=[0.5, 0.9, 1.2], height=[0.2, 0.4])
    found = ij.study(lane, grid, tmp_path)
    expected = found["r"] * np.sqrt(2 * 9.81 * found["height"])
    np.testing.assert_allclose(found["speed"][:2], expected[:2], rtol=1e-10)
    np.testing.assert_array_equal(found.failed, [[False] * 2, [False] * 2, [True] * 2])
    (reason,) = found.reasons
    assert reason.startswith("A parameter is not finite or outside its range")
