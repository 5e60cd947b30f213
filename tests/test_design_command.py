"""The commands `design` and `identifiability`, and the plans that they read."""

import dataclasses
import json
import math
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from command import impactjax
from impactjax._cli.fitting import compared
from impactjax._design.from_file import planned_experiments
from impactjax._record.plan_file import read_plan
from tiers import quick

PLAN = """
[system]
law = "restitution"

[values]
omega_n = 12.0
zeta = 0.02
r = 0.7

[sensor]
sigma = 0.002

[recording]
duration = 0.6
rate = 200.0

[choices]
theta0 = { low = 0.4, high = 1.0 }
rate = [100.0, 200.0]

[cost.s]
each = 50.0
second = 10.0

[goal]
r = 0.01
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "plan.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def plan(tmp_path_factory) -> Path:
    return written(tmp_path_factory.mktemp("plan"), PLAN)


def test_plan_that_reaches_the_goal(plan):
    run = impactjax("design", plan, "--refits", "3")
    assert (run.status, run.stderr) == (0, "")
    first, *rows = run.stdout.splitlines()
    assert first == "This plan tells r within 1 %."
    assert "rate = 200" in rows[0]  # twice the samples at the same cost
    assert any(row.startswith("  it takes: performances ") for row in rows)
    cost = next(row for row in rows if "it takes" in row)
    number = int(cost.split("performances ")[1].split(",")[0])
    assert f"s {56 * number}" in cost
    assert any(row.startswith("  r: 0.69") and "refits" in row for row in rows)


def test_answer_is_written_as_json_and_as_a_page(plan, tmp_path):
    run = impactjax("design", plan, "--refits", "2", "--out", tmp_path / "new")
    assert (run.status, run.stderr) == (0, "")
    found = json.loads((tmp_path / "new" / "design.json").read_text())
    assert run.stdout.startswith(found["verdict"])
    assert found["reached"]
    assert found["asked"] == {"r": 0.01}
    (performed,), r = found["performances"], found["parameters"]["r"]
    assert performed["choices"]["rate"] == 200.0
    assert found["costs"] == {"performances": performed["number"], "s": 56.0 * performed["number"]}
    low, high = r["interval95"]
    assert math.isclose((high - low) / 2, r["half_width"] * r["value"])
    assert math.isclose(r["half_width"], 0.01 * found["size"])
    text = (tmp_path / "new" / "design.html").read_text()
    for said in (found["verdict"], "omega_n", "2 refits", "<td>s</td><td>56</td>"):
        assert said in text
    again = impactjax("design", plan, "--out", tmp_path / "new")
    assert again.status == 2
    assert "design.json exists; use --force" in again.stderr


def test_goal_beyond_the_budget_has_its_own_status(plan, tmp_path):
    far = written(tmp_path, PLAN.replace("r = 0.01", "r = 1e-6") + "\n[budget]\ns = 200.0\n")
    run = impactjax("design", far, "--refits", "0")
    assert (run.status, run.stderr) == (1, "")
    assert run.stdout.startswith("No plan was found that tells r within 0.0001 %")
    assert "of 200" in run.stdout


def test_identifiability_of_a_plan(plan):
    run = impactjax("identifiability", plan)
    assert (run.status, run.stderr) == (0, "")
    assert run.stdout.startswith("restitution\n  omega_n     12.0000 ± ")
    assert "Determined: omega_n to" in run.stdout


def test_second_sensor_of_a_plan_tells_more(plan, tmp_path):
    """Two equal sensors: all errors fall by √2."""
    twice = PLAN + '\n[[sensors]]\nquantity = "angle"\nsensor = { sigma = 0.002 }\n'
    once, both = (
        ij.information(planned_experiments(path, read_plan(path)).experiments)
        for path in (plan, written(tmp_path, twice))
    )
    assert once.names == both.names
    np.testing.assert_allclose(both.bounds * math.sqrt(2), once.bounds, rtol=1e-6)


WRONG = {
    "a second sensor": (
        ("[goal]", '[[sensors]]\nquantity = "angel"\nsensor = { sigma = 1.0 }\n[goal]'),
        "`angle`",
    ),
    "a second noise": (
        ("[goal]", '[[sensors]]\nquantity = "angle"\nsensor = {}\n[goal]'),
        "state `sigma`",
    ),
    "a law": (("restitution", "restitutoin"), "did you mean `restitution`?"),
    "a parameter": (("r = 0.7", "rr = 0.7"), "There is no parameter `rr`"),
    "a value": (("zeta = 0.02", "zeta = -0.02"), "`zeta` must be"),
    "a goal": (("r = 0.01", "k = 0.01"), "There is no parameter `k`"),
    "a key": (("duration", "duratoin"), "did you mean `duration`"),
    "no sigma": (("sigma = 0.002", ""), "state `sigma` under [sensor]"),
    "no goal": (("[goal]\nr = 0.01", ""), "add a table [goal]"),
    "no rise": (("low = 0.4", "low = 1.4"), "the range of `theta0` does not rise"),
    "no values": (("rate = [100.0, 200.0]", "rate = []"), "`rate` has no value"),
    "a range of the rate": (
        ("rate = [100.0, 200.0]", "rate = { low = 100.0, high = 200.0 }"),
        "line 19: `rate` cannot be chosen in a range",
    ),
    "a choice that is a number": (
        ("rate = [100.0, 200.0]", "rate = 100.0"),
        "line 19: `choices.rate` cannot be used (Expected a table or a list, got a number)",
    ),
    "half a range": ((", high = 1.0", ""), "there is no `high` in [choices.theta0]"),
    "a choice without a value": (
        ("rate = [100.0, 200.0]", "rate = [100.0, nan]"),
        "line 19: `choices.rate[1]` cannot be used (Expected a number that is finite)",
    ),
    "no goal to reach": (
        ("r = 0.01", "r = 0.0"),
        "line 26: `goal.r` cannot be used (Expected a number > 0.0)",
    ),
    "a negative cost": (("each = 50.0", "each = -50.0"), "line 22: `cost.s.each` cannot be used"),
    "no law": (('law = "restitution"', ""), "line 2: there is no `law` in [system]; add it"),
    "a key of the criterion": (
        ("[goal]\nr = 0.01", '[criterion]\nname = "d-optimal"\nparameter = ["r"]\n'),
        "did you mean `parameters`",
    ),
    "a parameter twice": (
        ("[goal]\nr = 0.01", '[criterion]\nname = "d-optimal"\nparameters = ["r", "r"]\n'),
        "named twice",
    ),
    "too many samples": (("duration = 0.6", "duration = 6e5"), "1.2e+08 samples"),
    "an unknown resource": (("[goal]", "[budget]\nEUR = 3.0\n[goal]"), "which no candidate takes"),
    "both": (("[goal]", '[criterion]\nname = "d-optimal"\n[goal]'), "a goal and a criterion"),
    "an unknown criterion": (
        ("[goal]\nr = 0.01", '[criterion]\nname = "doptimal"\n'),
        "did you mean `d-optimal`?",
    ),
    "a criterion without a budget": (
        ("[goal]\nr = 0.01", '[criterion]\nname = "d-optimal"\n'),
        "State a budget",
    ),
    "no TOML": (("[values]", "[values"), "not valid TOML"),
}


@quick
@pytest.mark.parametrize("case", WRONG)
def test_wrong_plan_is_one_sentence(case, tmp_path):
    (old, new), message = WRONG[case]
    assert old in PLAN
    run = impactjax("design", written(tmp_path, PLAN.replace(old, new)))
    assert (run.status, run.stdout) == (2, "")
    assert run.stderr.startswith("impactjax: ")
    assert run.stderr.count("\n") == 1
    assert message in run.stderr


@quick
def test_absent_plan_is_one_sentence(tmp_path):
    for command in ("design", "identifiability"):
        run = impactjax(command, tmp_path / "none.toml")
        assert run.status == 2
        assert "cannot be read" in run.stderr


@pytest.fixture
def ball(tmp_path) -> Path:
    """Impact times of a ball."""
    path, times = tmp_path / "ball.csv", [0.0]
    for i in range(8):
        times.append(times[-1] + 2 * 2.0 * 0.8**i / 9.81 + 1e-4 * math.sin(7 * i))
    path.write_text("impact time [s]\n" + "\n".join(f"{t:.6f}" for t in times) + "\n")
    return path


def test_identifiability_of_a_recording(ball):
    run = impactjax("identifiability", ball, "--law", "restitution")
    assert (run.status, run.stderr) == (0, "")
    assert run.stdout.startswith("restitution\n  r ")
    assert "Determined: r to" in run.stdout
    assert run.stdout.splitlines()[-1].startswith("No profiles: the fit allows for scatter ")


def test_fit_that_cannot_be_used_has_no_identifiability(ball, monkeypatch):
    def failing(*given):
        (found,) = compared(*given)
        outcome = jnp.int32(ij.Outcome.MAX_ITERATIONS)
        fits = tuple(
            fit._replace(estimate=dataclasses.replace(fit.estimate, outcome=outcome))
            for fit in found.fits
        )
        return [dataclasses.replace(found, fits=fits)]

    monkeypatch.setattr("impactjax._cli.identifiability.compared", failing)
    run = impactjax("identifiability", ball, "--law", "restitution")
    assert run.stdout.startswith("restitution\n  No fit that could be used: ")
