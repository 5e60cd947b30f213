"""Records of a pendulum while the frequency of its base sweeps, made with SciPy."""

import numpy as np
import pytest

import impactjax as ij
from forced_pendulum import LENGTH, NOISE, OMEGA_N, ZETA, R
from impactjax._record.file_error import FileError
from impactjax._record.plan_file import read_plan
from reference import simulate_rigid
from tiers import quick

AMPLITUDE, FREQUENCY, SWEEP, PHASE = 4.6e-3, 25.0, 4.0, 0.7
TS = np.arange(1501) / 500
TRUTHS = {"omega_n": OMEGA_N, "zeta": ZETA, "phase": PHASE, "r": R}


def push(t, y):
    """Angular acceleration by the second derivative of the place of the base, A sin ψ."""
    now, angle = FREQUENCY + SWEEP * t, (FREQUENCY + SWEEP * t / 2) * t + PHASE
    base = AMPLITUDE * (SWEEP * np.cos(angle) - now**2 * np.sin(angle))
    return -base / LENGTH * np.cos(y)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A recording of three seconds with noise, and what is known of the base."""

    def flow(t, y):
        own = -2 * ZETA * OMEGA_N * y[1] - OMEGA_N**2 * np.sin(y[0])
        return np.array([y[1], push(t, y[0]) + own])

    run = simulate_rigid(flow, [0.5, 0.0], TS, lambda speed: R, 5e-3)
    assert len(run.impact_times) > 8
    angles = run.position + NOISE * np.random.default_rng(2).standard_normal(len(TS))
    folder = tmp_path_factory.mktemp("sweep")
    rows = np.stack([TS, angles], axis=1)
    np.savetxt(folder / "own.csv", rows, "%.6f", ",", header="time_s,angle_rad", comments="")
    base = f"[base]\namplitude = {AMPLITUDE}\nfrequency = {FREQUENCY}\nrate = {SWEEP}\n"
    known = f"[fixed]\nlength = {LENGTH}\n[sensor]\ngain = 1.0\noffset = 0.0\ndrift = 0.0\n"
    (folder / "own.toml").write_text(base + known + "cutoff = inf\n")
    return folder / "own.csv"


@quick
def test_first_look_at_a_sweep(path):
    prepared = ij.prepare(path, laws=["restitution"])
    look = prepared.first_look
    assert look.phase == pytest.approx(PHASE, abs=0.1)
    assert float(vars(look.oscillator)["omega_n"]) == pytest.approx(OMEGA_N, rel=0.01)
    base = vars(prepared.experiment.model.oscillator)["base"]
    assert isinstance(base, ij.Chirp)
    assert float(base.rate) == SWEEP
    assert not {"amplitude", "frequency", "rate"} & {*ij.build_problem(prepared.experiment).names}
    assert "The base moves with a frequency that changes" in str(ij.check(path))


def test_sweep_is_fitted_as_one_recording(path):
    (experiment,) = ij.prepare(path, laws=["restitution"]).experiments.values()
    estimate = ij.fit(experiment, starts=ij.Starts(16))
    for name, truth in TRUTHS.items():
        own = estimate[name]
        assert abs(own.value - truth) < 3.5 * own.standard_error, name
    assert estimate.rms < 1.05 * NOISE


@quick
def test_plan_of_a_sweep_is_refused(tmp_path):
    plan = tmp_path / "plan.toml"
    base = "[base]\namplitude = 1e-3\nfrequency = 30.0\nrate = 4.0\n"
    plan.write_text(f'[system]\nlaw = "restitution"\n{base}')
    with pytest.raises(FileError, match=r"line 6: a plan has no sweep of the frequency"):
        read_plan(plan)
