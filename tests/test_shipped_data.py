"""The recordings in `data/`, each fitted with the law it was made from."""

import tomllib
from pathlib import Path

import pytest

from command import Fitted, fitted
from impactjax._record.read_recording import read_recording
from tiers import mostly_thorough

DATA = Path(__file__).parent.parent / "data"
LAWS = {
    "free_decay": "none",
    "restitution": "restitution",
    "linear_restitution": "linear-restitution",
    "kelvin_voigt": "kelvin-voigt",
}


@pytest.fixture(scope="module", params=mostly_thorough(LAWS, "kelvin_voigt"))
def recording(request, tmp_path_factory) -> tuple[str, Fitted]:
    name = request.param
    path = DATA / f"{name}.csv"
    return name, fitted(tmp_path_factory.mktemp(name), path, "--law", LAWS[name])


def truth_of(name: str) -> dict[str, float]:
    return tomllib.loads((DATA / f"{name}.toml").read_text())["truth"]


def test_shipped_recordings_intervals_contain_truth(recording):
    name, found = recording
    truth = truth_of(name)
    assert len(truth) >= 4
    for parameter, value in truth.items():
        low, high = found.parameter(parameter)["interval95"]
        assert low <= value <= high, (parameter, low, value, high)


def test_shipped_recordings_verdicts(recording):
    """The residual is the noise, 0.2 degrees; each parameter is within four standard errors."""
    name, found = recording
    assert found.best["result"] == "successful"
    assert found.best["rms_residual"]["value"] == pytest.approx(0.2 * 3.14159 / 180, rel=0.1)
    for parameter, value in truth_of(name).items():
        each = found.parameter(parameter)
        assert abs(each["value"] - value) < 4 * each["standard_error"], parameter
    for parameter in ("omega_n", "theta0", *(["r"] if name == "restitution" else [])):
        assert found.parameter(parameter)["verdict"] == "identified"


@pytest.mark.parametrize("name", LAWS)
def test_truth_table_is_not_read(name):
    file = read_recording(DATA / f"{name}.csv")
    assert not set(file.sidecar.fixed) & set(truth_of(name))
    assert file.sidecar.start == {}
