"""The contract of the command line: words, files, exit status."""

import importlib.metadata
import math
import re
from pathlib import Path

import pytest

from browser import look, needs_browser
from command import Fitted, fitted, impactjax
from impactjax._cli.fit import fit_command
from impactjax._report.write import write_texts

DATA = Path(__file__).parent.parent / "data"
TRUTH = {
    "omega_n": 12.0,
    "zeta": 0.01,
    "r": 0.7,
    "theta0": math.radians(40),
    "theta_dot0": 0.5,
    "offset": 0.0,
    "gain": 1.0,
    "drift": 0.0,
}
PARAMETERS = len(TRUTH) + 2  # and the cutoff, and the size of the noise
ALIKE = ["--duration=0.8", "--rate=500", "--set=length=2"]  # all runs compile the same program
SWING = [
    *("simulate", "--law", "restitution", *ALIKE, "--noise", "0.2", "--seed", "3"),
    *("--set=omega_n=12", "--set=zeta=0.01", "--set=r=0.7", "--set=theta0=40deg"),
    "--set=theta_dot0=0.5",
]


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    path = tmp_path_factory.mktemp("simulated") / "swing.csv"
    assert impactjax(*SWING, "--out", path) == (0, "", "")
    return path


@pytest.fixture(scope="module")
def found(simulated, tmp_path_factory) -> Fitted:
    out = tmp_path_factory.mktemp("found") / "deep" / "folder"
    return fitted(out, simulated, "--law", "restitution", "--seed", "11", "--fix", "dry_friction")


@pytest.fixture(scope="module")
def bounces(tmp_path_factory) -> Fitted:
    """Impact times of a ball without noise, written and fitted."""
    folder = tmp_path_factory.mktemp("bounces")
    path = folder / "bounces.csv"
    run = impactjax(
        *("simulate", "--system", "bouncing-ball", "--set", "r=0.8", "--set", "x0=200mm"),
        *("--duration", "1.2", "--impacts", "--out", path),
    )
    assert run == (0, "", "")
    return fitted(folder, path, "--law", "restitution", "--law", "restitution")


def test_version_option():
    version = importlib.metadata.version("impactjax")
    assert impactjax("--version") == (0, f"impactjax {version}\n", "")


@pytest.mark.parametrize("command", ["check", "fit", "simulate"])
def test_help_contains_examples(command):
    run = impactjax(command, "--help")
    assert (run.status, run.stderr) == (0, "")
    examples = [line for line in run.stdout.splitlines() if f"  impactjax {command} " in line]
    assert len(examples) >= 2
    assert ("kelvin-voigt" in run.stdout) == (command != "check")
    assert "bouncing-ball" in run.stdout


def test_command_without_arguments_shows_help():
    run = impactjax()
    assert run.status == 2
    assert "fit" in run.stdout + run.stderr
    assert "simulate" in run.stdout + run.stderr


def test_simulate_command_writes_requested_samples(simulated):
    lines = simulated.read_text().splitlines()
    assert lines[0] == "time [s], angle [deg]"
    assert len(lines) == 402
    assert lines[-1].startswith("0.8, ")
    assert impactjax(*SWING) == (0, simulated.read_text(), "")


def test_fit_json_schema(found, simulated):
    document = found.document
    keys = {"recording", "fits", "versions", "notes", "seed", "measured_restitution"}
    assert set(document) == keys | {"repeatability"}
    assert document["recording"] == str(simulated)
    assert document["seed"] == 11
    assert document["versions"]["impactjax"] == importlib.metadata.version("impactjax")
    assert {"python", "jax", "diffrax", "numpy"} <= set(document["versions"])
    (fit,) = document["fits"]
    assert fit["law"] == "restitution"
    assert fit["result"] == "successful"
    assert fit["n_samples"] == 401
    assert fit["rms_residual"]["unit"] == "rad"
    assert fit["rms_residual"]["value"] == pytest.approx(math.radians(0.2), rel=0.1)
    assert {type(fit[key]) for key in ("aic", "bic", "seconds")} == {float}
    assert fit["bic"] - fit["aic"] == pytest.approx(PARAMETERS * (math.log(401) - 2))


def test_fit_json_parameter_schema(found):
    units = {
        "omega_n": "rad/s",
        "zeta": "1",
        "r": "1",
        "theta0": "rad",
        "theta_dot0": "rad/s",
        "mass": "kg",
        "gap": "rad",
        "t0": "s",
        "gain": "1",
        "offset": "rad",
        "delay": "s",
        "drift": "rad/s",
        "cutoff": "Hz",
    }
    parameters = found.best["parameters"]
    assert {name: each["unit"] for name, each in parameters.items()} == units
    for name, each in parameters.items():
        assert set(each) == {
            "value",
            "standard_error",
            "interval95",
            "error_inflation",
            "unit",
            "verdict",
            "reason",
            "assumed",
            "rests_on",
            "own",
            "prior",
        }
        assert each["assumed"] == (name in ("mass", "gap"))
        if name in TRUTH or name == "cutoff":
            low, high = each["interval95"]  # without an end, if it is open
            assert low <= each["value"]
            assert high is None or each["value"] <= high
            assert each["standard_error"] > 0
            assert each["verdict"] in ("identified", "one-sided", "not identified")
        else:
            assert (each["standard_error"], each["interval95"]) == (None, None)
            assert each["verdict"] == "fixed"


@pytest.mark.parametrize("name", TRUTH)
def test_fit_command_recovers_simulated_parameters(found, name):
    low, high = found.parameter(name)["interval95"]
    assert low <= TRUTH[name] <= high
    if name in ("omega_n", "r", "theta0"):
        assert found.parameter(name)["verdict"] == "identified"


def test_printed_table_agrees_with_fit_json(found):
    for name in TRUTH:
        assert re.search(
            rf"│ {name} +│ .* │ .* │ {found.parameter(name)['verdict']} +│", found.stdout
        )
    assert "Written: " in found.stdout


@needs_browser
def test_browser_shows_command_report(found, tmp_path):
    seen = look(found.page, tmp_path)
    assert len(seen.images) == found.page.count("<img") > 3
    assert min(seen.images) > 300  # pixels wide, and so not missing
    assert seen.console == []


def test_impact_times_round_trip_through_files(bounces):
    assert [fit["law"] for fit in bounces.document["fits"]] == ["restitution"]
    assert bounces.best["rms_residual"]["unit"] == "s"
    assert bounces.parameter("r")["value"] == pytest.approx(0.8, abs=1e-6)
    assert bounces.parameter("x_dot0")["value"] == pytest.approx(
        0.8 * math.sqrt(2 * 9.80665 * 0.2), abs=1e-6
    )
    assert bounces.parameter("t0")["value"] == pytest.approx(math.sqrt(0.4 / 9.80665), abs=1e-6)


def test_existing_files_are_overwritten_only_with_force(simulated, tmp_path):
    out = tmp_path / "mine.csv"
    out.write_text("mine")
    run = impactjax("simulate", "--out", out)
    assert (run.status, run.stdout) == (2, "")
    assert run.stderr == f"impactjax: {out} exists; use --force to overwrite it.\n"
    assert out.read_text() == "mine"
    assert impactjax("simulate", *ALIKE, "--out", out, "--force") == (0, "", "")
    assert out.read_text().startswith("time [s]")
    (tmp_path / "report.html").write_text("mine")
    run = impactjax("fit", simulated, "--out", tmp_path)
    assert run.status == 2
    assert "report.html exists; use --force" in run.stderr
    assert (tmp_path / "report.html").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--seed", "99999999999999999999999"], "Input should be"),
        (["--seed", "-1"], "Input should be"),
        (["--out", "/proc/self"], "/proc/self cannot be written to"),
    ],
)
def test_fit_command_refuses_impossible_arguments(simulated, arguments, says):
    run = impactjax("fit", simulated, *arguments)
    assert (run.status, run.stdout) == (2, "")
    assert says in run.stderr


def test_dangling_link_is_not_overwritten(simulated, tmp_path):
    (tmp_path / "fit.json").symlink_to(tmp_path / "elsewhere.json")
    run = impactjax("fit", simulated, "--out", tmp_path)
    assert (run.status, run.stdout) == (2, "")
    assert "fit.json exists; use --force" in run.stderr


def test_output_created_during_fit_is_not_overwritten(tmp_path):
    path = tmp_path / "fit.json"
    write_texts([path], ["mine"], force=False)
    with pytest.raises(FileExistsError):
        write_texts([path], ["another's"], force=False)
    assert path.read_text() == "mine"
    write_texts([path], ["forced"], force=True)
    assert path.read_text() == "forced"


def test_failed_page_leaves_no_files(tmp_path, monkeypatch, capsys):
    def failing(*given):
        raise RuntimeError("no page")

    monkeypatch.setattr("impactjax._cli.fit.compared", lambda *given: [])
    monkeypatch.setattr("impactjax._report.write.document", lambda *given: {})
    monkeypatch.setattr("impactjax._report.write.page", failing)
    with pytest.raises(RuntimeError, match="no page"):
        fit_command([DATA / "free_decay.csv"], laws=["none"], out=tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert "│" not in capsys.readouterr().out  # only the look before the fit


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--law", "kelvin"], "no law `kelvin`; did you mean `kelvin-voigt`?"),
        (["--system", "ball"], "no system `ball`; there are pendulum"),
        (["--set", "omega=3"], "no parameter `omega`; there are omega_n"),
        (["--set", "t0=3"], "no parameter `t0`"),
        (["--set", "gain=3"], "no parameter `gain`"),
        (["--set", "omega_n"], "`omega_n` is not NAME=VALUE"),
        (["--set", "omega_n=nan"], "is not NAME=VALUE"),
        (["--set", "omega_n=1.2.3"], "`1.2.3` in `omega_n=1.2.3` is not a number"),
        (["--set", "omega_n=-3"], "`omega_n` must be finite and greater than 0"),
        (["--set", "r=1.5"], "`r` must be from 0 to 1"),
        (["--set", "r=1e999"], "`r` must be from 0 to 1"),
        (["--set", "length=-1"], "`length` must be finite and greater than 0"),
        (["--set", "theta0=45mm"], "unknown unit `mm` in `theta0=45mm`; use rad or"),
        (["--set", "omega_n=3Hz"], "unknown unit `Hz`"),
        ([*ALIKE, "--set", "theta0=-10deg"], "inside a rigid stop"),
        ([*ALIKE, "--set", "theta0=1e999"], "infinite or NaN"),
        (["--duration", "0"], "--duration times --rate must be"),
        (["--duration", "inf"], "--duration times --rate must be"),
        (["--duration", "nan"], "--duration times --rate must be"),
        (["--rate", "1e12"], "--duration times --rate must be"),
        (["--noise", "-1"], "--noise must be"),
        (["--noise", "nan"], "--noise must be"),
        ([*ALIKE, "--out", "/dev/null/x"], "cannot be written"),
        ([*ALIKE, "--out", ".", "--force"], "cannot be written"),
    ],
)
def test_simulate_command_refuses_impossible_arguments(arguments, says):
    run = impactjax("simulate", *arguments)
    assert (run.status, run.stdout) == (2, "")
    (line,) = run.stderr.splitlines()
    assert line.startswith("impactjax: ")
    assert says in line


def test_length_and_units_of_set_option():
    """With a length the speed at the stop is theta_dot times it; no damping keeps the energy."""
    settings = "--set=omega_n=10", "--set=zeta=0", "--set=theta0=1000mrad"
    run = impactjax("simulate", "--impacts", *ALIKE, *settings)
    assert run.stdout.startswith("impact time [s], approach speed [m/s], ")
    speed = float(run.stdout.splitlines()[1].split(",")[1])
    assert speed == pytest.approx(2 * 10 * 2 * math.sin(0.5), rel=1e-6)
