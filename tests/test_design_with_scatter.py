"""Designs with restitution that scatters, against the closed form of a bouncing ball.

The durations of successive flights have the ratio r exp(s ξ). Without noise, n + 2 impact times
tell n such ratios, so that log r has the standard error s/√n.
"""

import dataclasses
import json
import math

import jax
import numpy as np
import pytest

import impactjax as ij
from command import impactjax
from estimates import SMALL
from impactjax._design.refits import refitted
from tiers import quick

R, SCATTER, COUNT = 0.8, 0.01, 7
FACTORS = COUNT - 2
BALL = ij.ImpactOscillator(ij.BouncingBall(10.0), ij.Stop(ij.Restitution(R)))


def drop(model: ij.ImpactOscillator, speed: float, clock: float = 1e-7) -> ij.Experiment:
    """Planned impact times, nearly without noise."""
    flights = 2 * speed * R ** np.arange(COUNT - 1) / 10.0
    recording = ij.ImpactTimes(np.concatenate([[0.0], np.cumsum(flights)]))
    start, sensor = ij.InitialState(0.0, speed), ij.Sensor(sigma=clock)
    return ij.Experiment(model, recording, start, sensor, simulation=SMALL)


SPEEDS = ij.Candidates(drop, {"speed": [2.0]})


def best(candidates: ij.Candidates, number: int, refits: int, **more) -> ij.Design:
    budget = {"performances": number}
    return ij.design(
        candidates, BALL, ij.WorstParameter(), budget=budget, scatter=SCATTER, refits=refits, **more
    )


def test_error_of_restitution_is_its_scatter_over_the_root_of_the_number_of_impacts():
    found = best(SPEEDS, 3, 0)
    np.testing.assert_allclose(found.size, SCATTER / math.sqrt(3 * FACTORS), rtol=1e-4)


def test_recordings_that_exist_scatter_as_well():
    found = best(SPEEDS, 1, 0, performed=[drop(BALL, 2.0)])
    np.testing.assert_allclose(found.size, SCATTER / math.sqrt(2 * FACTORS), rtol=1e-4)


@pytest.mark.parametrize(("motions", "sensors"), [(1, 1), (1, 2), (2, 1)])
def test_refit_finds_the_mean_of_the_drawn_factors(motions, sensors):
    """Without noise the best r is that of the mean logarithm, which the prior tells from r. Two
    sensors of one motion hear the same factors, two motions have their own.
    """
    key = jax.random.key(3)
    found = refitted([[drop(BALL, 2.0)] * sensors] * motions, {}, key, 1, SCATTER)
    _, of_scatter = jax.random.split(jax.random.split(key, 1)[0])
    drawn = np.asarray(jax.random.normal(of_scatter, (motions, COUNT)))
    known = R * np.exp(SCATTER * drawn[:, :FACTORS].mean())
    assert found.failed == 0
    np.testing.assert_allclose(found.values[0, found.names.index("r")], known, rtol=1e-6)


def test_refits_attain_what_noise_and_scatter_together_allow():
    """A clock that adds a fourth to the variance of the scatter."""
    noisy = dataclasses.replace(SPEEDS, experiment=lambda model, speed: drop(model, speed, 2e-3))
    found = best(noisy, 1, 24)
    told = found.expected["r"]
    assert told.half_width > 1.1 * 1.959964 * SCATTER / math.sqrt(FACTORS)
    assert abs(told.attained / told.half_width - 1) < 0.43  # three standard errors of a spread
    assert found.failed == 0


def test_candidate_that_cannot_be_simulated_is_left_out():
    def stretched(model: ij.ImpactOscillator, share: float) -> ij.Experiment:
        plan = drop(model, 2.0)
        return dataclasses.replace(plan, recording=ij.ImpactTimes(plan.recording.instants * share))

    found = best(ij.Candidates(stretched, {"share": [0.01, 1.0]}), 1, 0)
    assert (found.impossible, found.performances[0].values) == (1, {"share": 1.0})
    np.testing.assert_allclose(found.size, SCATTER / math.sqrt(FACTORS), rtol=1e-4)


def test_wrong_scatter_is_refused():
    with pytest.raises(ValueError, match="`scatter` must be a number from 0 on"):
        ij.design(SPEEDS, BALL, ij.Within({"r": 0.1}), scatter=-0.1)


PLAN = """
[system]
law = "restitution"
scatter = 0.01

[values]
r = 0.8
x_dot0 = 2.0

[sensor]
sigma = 1e-7

[recording]
quantity = "impact time"
impacts = 7

[goal]
r = 0.005
"""


def test_scatter_in_a_plan_file(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(PLAN)
    run = impactjax("identifiability", path)
    assert (run.status, run.stderr) == (0, "")
    assert f"Determined: r to {100 * SCATTER / math.sqrt(FACTORS):.2g} %." in run.stdout
    run = impactjax("design", path, "--refits", "2", "--out", tmp_path / "new")
    number = math.ceil((1.959964 * SCATTER / 0.005) ** 2 / FACTORS)
    assert f"\n  {number} x experiment\n" in run.stdout
    assert json.loads((tmp_path / "new" / "design.json").read_text())["scatter"] == SCATTER
    assert "scatters by 1 % from impact" in (tmp_path / "new" / "design.html").read_text()


@quick
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("scatter = 0.01", "scatter = -0.01", "`system.scatter` cannot be used"),
        ("scatter = 0.01", "scater = 0.01", "did you mean `scatter`"),
    ],
)
def test_wrong_scatter_in_a_plan_file_is_one_sentence(old, new, message, tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(PLAN.replace(old, new))
    run = impactjax("design", path)
    assert (run.status, run.stdout) == (2, "")
    assert run.stderr.count("\n") == 1
    assert message in run.stderr
