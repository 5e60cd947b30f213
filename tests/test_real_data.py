"""Measurements of other people through the command line; they are not part of the project."""

from pathlib import Path
from typing import Any

import pytest

from command import Fitted, fitted
from tiers import thorough

REAL = Path(__file__).parents[2] / "shared" / "realdata"
SIDECARS = Path(__file__).parent / "sidecars"

pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason=f"there are no recordings in {REAL}")


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory) -> Fitted:
    name = "pendulum_free_swing_data_02"
    return fitted(
        tmp_path_factory.mktemp("pendulum"),
        *(REAL / "free_pendulum" / f"{name}.txt", "--sidecar", SIDECARS / f"{name}.toml"),
        *("--law", "none"),
    )


@pytest.fixture(scope="module")
def ball(tmp_path_factory) -> Fitted:
    return fitted(
        tmp_path_factory.mktemp("ball"),
        *(REAL / "pingpong_bounce" / "derived_onsets.csv", "--sidecar"),
        *(SIDECARS / "derived_onsets.toml", "--law", "restitution"),
    )


def of_friction(found: Fitted, friction: str) -> dict[str, Any]:
    (fit,) = [each for each in found.document["fits"] if each["friction"] == friction]
    return fit


@thorough
def test_free_pendulum_has_dry_friction(pendulum):
    """An independent fit says omega_n = 10.97 rad/s, zeta = 0.013, dry friction 1.3 rad/s²."""
    assert pendulum.best["friction"] == "viscous and dry"
    assert pendulum.best["n_samples"] == 4350
    assert 10.93 <= pendulum.parameter("omega_n")["value"] <= 11.00
    assert pendulum.parameter("zeta")["value"] == pytest.approx(0.013, abs=0.002)
    assert pendulum.parameter("dry_friction")["value"] == pytest.approx(1.3, abs=0.2)
    assert pendulum.best["rms_residual"]["value"] <= 0.7 * 3.14159 / 180
    for name in ("omega_n", "zeta", "dry_friction"):
        assert pendulum.parameter(name)["verdict"] == "identified"


def test_free_pendulum_rejects_viscous_friction_alone(pendulum):
    viscous = of_friction(pendulum, "viscous")
    assert 10.93 <= viscous["parameters"]["omega_n"]["value"] <= 11.00
    assert viscous["rms_residual"]["value"] > 0.8 * 3.14159 / 180
    assert viscous["aic"] > pendulum.best["aic"] + 1000
    sentence = "Viscous friction alone does not describe the record"
    assert sentence in pendulum.page
    assert sentence in pendulum.stdout


def test_ping_pong_ball_restitution(ball):
    """The author's value is 0.9451. The flights' ratios scatter by 0.58 %, clock included."""
    r = ball.parameter("r")
    assert 0.943 <= r["value"] <= 0.948
    assert 0 < r["standard_error"] <= 0.002
    assert r["verdict"] == "identified"
    assert ball.best["rms_residual"] == {"value": pytest.approx(5e-5, abs=4e-5), "unit": "s"}
    assert 0.002 < ball.best["scatter"]["size"] < 0.0058
    assert ball.best["n_samples"] > 20
