"""Plans whose recording is a list of impact times, against the closed form of a bouncing ball."""

import math
from pathlib import Path

import numpy as np
import pytest

import impactjax as ij
from command import impactjax
from impactjax._design.from_file import planned_experiments
from impactjax._record.plan_file import read_plan
from tiers import quick

R, CLOCK, COUNT, WEIGHT = 0.8, 1e-3, 7, 10.0

PLAN = f"""
[system]
law = "restitution"

[values]
gravity = {WEIGHT}
r = {R}
x_dot0 = 2.0

[sensor]
sigma = {CLOCK}

[recording]
quantity = "impact time"
impacts = {COUNT}

[choices]
x_dot0 = {{ low = 1.0, high = 2.5 }}
impacts = [5, {COUNT}]

[cost.s]
each = 50.0

[goal]
r = 0.002
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "plan.toml"
    path.write_text(text)
    return path


def times(r: float, speed: float) -> np.ndarray:
    """Impact times of a ball that leaves the ground at the first one."""
    return np.concatenate([[0.0], np.cumsum(2 * speed * r ** np.arange(COUNT - 1) / WEIGHT)])


def error(speed: float) -> float:
    """The standard error of r, with the speed and the first impact from the same times."""
    step, columns = 1e-6, [np.ones(COUNT)]
    for a, b in ((step, 0.0), (0.0, step)):
        columns.append((times(R + a, speed + b) - times(R - a, speed - b)) / (2 * step))
    jacobian = np.stack(columns, axis=1) / CLOCK
    return math.sqrt(np.linalg.inv(jacobian.T @ jacobian)[1, 1])


def test_planned_times_are_those_of_the_motion(tmp_path):
    path = written(tmp_path, PLAN)
    (only,) = planned_experiments(path, read_plan(path)).experiments
    assert isinstance(only.recording, ij.ImpactTimes)
    np.testing.assert_allclose(only.recording.times, times(R, 2.0), rtol=1e-9)
    told = ij.information(only)
    assert told.names == ("r", "x_dot0", "t0")
    np.testing.assert_allclose(told.bounds[0], error(2.0), rtol=1e-5)


def test_design_of_impact_times(tmp_path):
    """The longest recording at the highest speed tells most, and costs no more."""
    run = impactjax("design", written(tmp_path, PLAN), "--refits", "2")
    assert (run.status, run.stderr) == (0, "")
    first, plan, cost, *_ = run.stdout.splitlines()
    assert first == "This plan tells r within 0.2 %."
    number = math.ceil((1.959964 * error(2.5) / R / 0.002) ** 2)
    assert plan == f"  {number} x experiment at x_dot0 = 2.5, impacts = 7"
    assert cost == f"  it takes: performances {number}, s {50 * number}"


def test_identifiability_of_impact_times(tmp_path):
    run = impactjax("identifiability", written(tmp_path, PLAN))
    assert (run.status, run.stderr) == (0, "")
    assert f"Determined: r to {100 * error(2.0) / R:.2g} %." in run.stdout


def test_stop_away_from_the_origin_is_where_the_motion_starts(tmp_path):
    path = written(tmp_path, PLAN.replace("[values]", "[values]\ngap = 0.3"))
    (only,) = planned_experiments(path, read_plan(path)).experiments
    assert isinstance(only.recording, ij.ImpactTimes)
    np.testing.assert_allclose(only.initial.position, -0.3)
    np.testing.assert_allclose(only.recording.times, times(R, 2.0), rtol=1e-9)


def test_more_impacts_than_happen_are_refused():
    """A series of impacts is summed once its flights are negligible."""
    ball = ij.ImpactOscillator(ij.BouncingBall(WEIGHT), ij.Stop(ij.Restitution(0.1)))
    with pytest.raises(ValueError, match=r"Only \d+ impacts with flights between them happen"):
        ij.planned_impacts(ball, ij.InitialState(0.0, 2.0), 60)


@quick
def test_single_impact_is_no_list():
    ball = ij.ImpactOscillator(ij.BouncingBall(WEIGHT), ij.Stop(ij.Restitution(R)))
    with pytest.raises(ValueError, match="`count` must be at least 2"):
        ij.planned_impacts(ball, ij.InitialState(0.0, 2.0), 1)


WRONG = {
    "a rate": (("impacts = 7", "rate = 100.0"), "impact times have no `rate`"),
    "durations": (("impacts = [5, 7]", "duration = [0.7]"), "impact times have no `duration`"),
    "a cost of time": (("each = 50.0", "second = 1.0"), "no duration that may cost"),
    "a second sensor": (
        ("[goal]", '[[sensors]]\nquantity = "displacement"\nsensor = { sigma = 1.0 }\n[goal]'),
        "recorded alone; omit [[sensors]]",
    ),
    "a range": (("impacts = [5, 7]", "impacts = { low = 5, high = 7 }"), "cannot be chosen in a"),
    "half an impact": (("impacts = [5, 7]", "impacts = [5.5]"), "`impacts` cannot be 5.5"),
    "one impact": (("impacts = [5, 7]", "impacts = [1]"), "`impacts` cannot be 1"),
    "a place": (("x_dot0 = 2.0", "x0 = 0.2"), "Impact times begin at the stop"),
    "a speed into the stop": (("low = 1.0", "low = -1.0"), "`x_dot0` must be positive"),
    "no stop": (('"restitution"', '"none"'), "without a stop"),
    "samples": (('quantity = "impact time"', ""), 'state quantity = "impact time"'),
    "impacts beside samples": (
        (
            'quantity = "impact time"\nimpacts = 7\n\n[choices]',
            '[[sensors]]\nquantity = "impact time"\nsensor = { sigma = 1.0 }\n\n[choices]',
        ),
        "recorded alone; plan them in another file",
    ),
}


@quick
@pytest.mark.parametrize("case", WRONG)
def test_wrong_plan_of_impact_times_is_one_sentence(case, tmp_path):
    (old, new), message = WRONG[case]
    assert old in PLAN
    text = PLAN.replace(old, new)
    if case == "impacts beside samples":
        text = text.replace("impacts = [5, 7]", "")
    if case == "no stop":
        text = text.replace("r = 0.8", "").replace("r = 0.002", "gravity = 0.1")
    refused(written(tmp_path, text), message)


def refused(path: Path, message: str) -> None:
    """Checks that a plan is refused in one sentence."""
    run = impactjax("design", path)
    assert (run.status, run.stdout) == (2, "")
    assert run.stderr.startswith("impactjax: ")
    assert run.stderr.count("\n") == 1
    assert message in run.stderr


def test_wrong_recording_of_impact_times_is_one_sentence(tmp_path):
    few = PLAN.replace("impacts = 7", "impacts = 2")
    refused(written(tmp_path, few), "2 observations, too few for 3 parameters")
    louder = PLAN.replace("sigma = 0.001", "sigma = 0.001\ngain = 2.0")
    refused(written(tmp_path, louder), "Times of impacts have no gain")
