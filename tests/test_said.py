"""Statements of sidecar and options reach the experiment, or are refused."""

from pathlib import Path

import numpy as np
import pytest

import impactjax as ij
from bad_files import GOOD
from command import impactjax
from impactjax._cli.options import options
from records import record_file
from tiers import quick

pytestmark = quick

DATA = Path(__file__).parent.parent / "data"
TS = np.arange(400) / 400


def prepared(folder: Path, sidecar: str, header="angle [deg]", laws=("kelvin-voigt",), **said):
    values = 20 * np.abs(np.cos(12 * TS)) * 0.8 ** (12 * TS / np.pi)
    path = record_file(folder / "swing.csv", header, TS, values, sidecar)
    return ij.prepare(path, laws=laws, **said)


def number(value):
    assert value is not None
    return float(value)


def test_sidecar_says_separation(tmp_path):
    laws = ("kelvin-voigt", "walton", "restitution")
    found = prepared(tmp_path, '[system]\nseparation = "zero-force"\n', laws=laws)
    stops = {name: each.model.lower for name, each in found.experiments.items()}
    rules = {
        name: stop.law.separation
        for name, stop in stops.items()
        if stop is not None and isinstance(stop.law, ij.AbstractForceLaw)
    }
    assert isinstance(rules["kelvin-voigt"], ij.AtZeroForce)
    assert isinstance(rules["walton"], ij.AtZeroPenetration)
    assert "`separation` does not apply to walton: the law has its own rule." in found.notes


def test_both_rules_of_separation_are_tried_unless_one_is_stated(tmp_path):
    laws = ["kelvin-voigt", "walton", "restitution"]
    found = prepared(tmp_path, "[sensor]\nsigma = 0.01\n", laws=laws)
    variant = "kelvin-voigt without pull"
    assert [*found.experiments] == ["kelvin-voigt", variant, "walton", "restitution"]
    stop = found.experiments[variant].model.lower
    assert stop is not None
    assert isinstance(stop.law, ij.KelvinVoigt)
    assert isinstance(stop.law.separation, ij.AtZeroForce)
    stated = prepared(tmp_path, '[system]\nseparation = "zero-penetration"\n', laws=laws)
    assert [*stated.experiments] == laws


def test_sidecar_says_equilibrium(tmp_path):
    found = prepared(tmp_path, '[system]\nequilibrium = "inverted"\n')
    oscillator = found.experiments["kelvin-voigt"].model.oscillator
    assert isinstance(oscillator, ij.Pendulum)
    assert isinstance(oscillator.equilibrium, ij.Inverted)


def test_sidecar_says_base_motion(tmp_path):
    sidecar = "[base]\namplitude = 1e-3\nfrequency = 50.0\n[fit]\nfree = ['phase']\n"
    experiment = prepared(tmp_path, sidecar).experiments["kelvin-voigt"]
    oscillator = experiment.model.oscillator
    assert isinstance(oscillator, ij.Pendulum)
    assert isinstance(oscillator.base, ij.HarmonicMotion)
    assert float(oscillator.base.amplitude) == 1e-3
    assert {"amplitude", "frequency"} <= experiment.fixed.keys()
    assert experiment.free == ("phase", "offset", "drift", "cutoff")


@pytest.mark.parametrize("law", [None, "restitution"])
def test_sidecar_says_upper_stop(tmp_path, law):
    sidecar = "[upper]\ngap = 0.4\n" + (f'law = "{law}"\n' if law else "")
    sidecar += "[fixed]\nlower_gamma = 0.1\n"
    experiment = prepared(tmp_path, sidecar).experiments["kelvin-voigt"]
    model = experiment.model
    assert model.lower is not None
    assert model.upper is not None
    assert float(model.upper.gap) == 0.4
    assert isinstance(model.lower.law, ij.KelvinVoigt)
    assert isinstance(model.upper.law, ij.Restitution if law else ij.KelvinVoigt)
    assert experiment.fixed.keys() >= {"upper_gap", "lower_gamma"}
    assert {"upper_r" if law else "upper_omega0", "lower_omega0"} <= {
        *ij.build_problem(experiment).names
    }


@pytest.mark.parametrize(
    ("sidecar", "fixed"),
    [("[system]\ndrag = true\n", {}), ("[fixed]\ndrag = 0.2\n", {"drag": 0.2})],
)
def test_sidecar_says_drag(tmp_path, sidecar, fixed):
    experiment = prepared(tmp_path, sidecar, "displacement [mm]", ["restitution"]).experiment
    assert isinstance(experiment.model.oscillator, ij.BouncingBall)
    assert ("drag" in ij.build_problem(experiment).names) == (not fixed)
    assert {name: number(experiment.fixed[name]) for name in fixed} == pytest.approx(fixed)


def test_arguments_override_sidecar(tmp_path):
    found = prepared(
        tmp_path,
        "[fixed]\nlength = 0.2\n[fit]\nfree = ['offset']\n",
        fixed={"offset": 0.01, "gamma": None},
        free=["length"],
    ).experiments["kelvin-voigt"]
    assert found.free == ("length", "cutoff")
    assert float(found.model.oscillator.lever()) == pytest.approx(0.2)
    assert number(found.fixed["offset"]) == pytest.approx(0.01)
    assert found.model.lower is not None
    law = found.model.lower.law
    assert isinstance(law, ij.KelvinVoigt)
    assert number(found.fixed["gamma"]) == pytest.approx(float(law.gamma))
    assert "gamma" not in ij.build_problem(found).names


def test_infinite_cutoff_states_that_there_is_no_low_pass(tmp_path):
    said = options((), ["cutoff=inf"]).fixed
    found = prepared(tmp_path, "[fixed]\nlength = 0.2\n", fixed=said).experiments["kelvin-voigt"]
    assert found.sensor.low_pass is None
    assert "cutoff" not in ij.build_problem(found).names


@pytest.mark.parametrize("command", ["check", "fit"])
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--free", "length"], "`length` has no value to start from"),
        (["--free", "lengt"], "no parameter `lengt`; did you mean `length`?"),
        (["--fix", "gama=0.1"], "no parameter `gama`; did you mean `gamma`?"),
        (["--fix", "gamma=0,1"], "`0,1` in --fix `gamma=0,1` is not a number"),
        (["--fix", "gamma=inf"], "`inf` in --fix `gamma=inf` is not a finite number"),
        (["--fix", "gamma=-1"], "`gamma` must be finite and at least 0, but it is -1"),
        (["--fix", "=1"], "`=1` is neither NAME nor NAME=VALUE"),
        (["--fix", "mass", "--free", "mass"], "`mass` is in both `free` and `fixed`"),
        (["--out", "swing.csv"], "swing.csv cannot be a folder"),
        (["--system", "ball"], "no system `ball`; there are pendulum"),
    ],
)
def test_command_refuses_impossible_options(command, arguments, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "swing.csv").write_bytes(GOOD)
    assert_refused(impactjax(command, "swing.csv", *arguments), says)


@pytest.mark.parametrize(
    ("loss", "says"),
    [
        ("huber", "no loss `huber`; there are squares, soft-l1, cauchy, student-t."),
        ("cauchi", "no loss `cauchi`; did you mean `cauchy`?"),
        ("cauchy=-1", "the loss `cauchy` needs a scale greater than 0"),
        ("cauchy=x", "`x` in --loss `cauchy=x` is not a number"),
        ("squares=1", "the loss `squares` has no scale"),
        ("soft-l1", "the record shows no noise; give a scale, as in --loss soft-l1=0.001"),
    ],
)
def test_fit_refuses_impossible_losses(loss, says, tmp_path):
    (tmp_path / "swing.csv").write_bytes(GOOD)
    assert_refused(impactjax("fit", tmp_path / "swing.csv", "--loss", loss), says)


def assert_refused(run, says):
    assert (run.status, run.stdout) == (2, "")
    (line,) = run.stderr.splitlines()
    assert line.startswith("impactjax: ")
    assert says in line


class StoppedError(RuntimeError):
    """End of a fit before its search."""


@pytest.fixture
def taken(monkeypatch):
    """Experiments of a fit that ends before its search."""
    found = []

    def stopped(prepared, seed, holdout):
        del seed, holdout
        found.extend(prepared)
        raise StoppedError

    monkeypatch.setattr("impactjax._cli.fit.compared", stopped)
    return found


def test_fit_command_says_what_python_can(taken):
    with pytest.raises(StoppedError):
        impactjax(
            *("fit", DATA / "restitution.csv", "--law", "restitution", "--free", "offset"),
            *("--fix", "zeta=0.0017", "--fix", "theta_dot0", "--loss", "student-t"),
        )
    experiment = taken[0].experiment
    assert experiment.free == ("offset",)
    assert number(experiment.fixed["zeta"]) == 0.0017
    assert "theta_dot0" in experiment.fixed
    assert isinstance(experiment.loss, ij.StudentT)
    assert float(experiment.loss.scale) == pytest.approx(2 * np.radians(0.2), rel=0.1)


def test_check_command_prints_and_draws(tmp_path):
    two = DATA / "restitution.csv", DATA / "free_decay.csv"
    run = impactjax("check", *two, "--out", tmp_path / "deep" / "folder")
    assert (run.status, run.stderr) == (0, "")
    for path in two:
        assert f"{path}\n- Read: " in run.stdout
        picture = tmp_path / "deep" / "folder" / f"{path.stem}-check.png"
        assert str(picture) in run.stdout
        assert picture.read_bytes().startswith(b"\x89PNG")
    run = impactjax("check", two[0], "--out", tmp_path / "deep" / "folder")
    assert_refused(run, "restitution-check.png exists; use --force")
    assert impactjax("check", two[0], "--out", tmp_path / "deep" / "folder", "--force").status == 0


def test_check_command_refuses_two_pictures_of_one_name(tmp_path):
    (tmp_path / "restitution.csv").write_bytes(GOOD)
    paths = DATA / "restitution.csv", tmp_path / "restitution.csv"
    assert_refused(impactjax("check", *paths, "--out", tmp_path / "out"), "have one name")
