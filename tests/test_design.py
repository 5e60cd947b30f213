"""Designs of experiments with a bouncing ball, whose information has a closed form."""

import dataclasses
import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import impactjax as ij
from estimates import SMALL

R, CLOCK, COUNT = 0.8, 1e-3, 7
BALL = ij.ImpactOscillator(ij.BouncingBall(10.0), ij.Stop(ij.Restitution(R)))


def times(r: float, speed: float) -> np.ndarray:
    """Impact times of a ball that leaves the ground at the first one."""
    return np.concatenate([[0.0], np.cumsum(2 * speed * r ** np.arange(COUNT - 1) / 10.0)])


def drop(model: ij.ImpactOscillator, speed: float = 2.0, sigma: float = CLOCK) -> ij.Experiment:
    """Planned impact times."""
    recording, start = ij.ImpactTimes(times(R, speed)), ij.InitialState(0.0, speed)
    return ij.Experiment(
        model, recording, start, ij.Sensor(sigma=sigma), scatter=ij.NoScatter(), simulation=SMALL
    )


def slopes(speed: float) -> np.ndarray:
    """Derivatives of the impact times by r, speed and start, by differences of the closed form."""
    step, rows = 1e-6, []
    for a, b in ((step, 0.0), (0.0, step)):
        ahead, behind = times(R + a, speed + b), times(R - a, speed - b)
        rows.append((ahead - behind) / (2 * step))
    return np.stack([*rows, np.ones(COUNT)], axis=1)


def error(speed: float, sigma: float = CLOCK) -> float:
    """The relative standard error of r in one performance."""
    jacobian = slopes(speed) / sigma
    return math.sqrt(np.linalg.inv(jacobian.T @ jacobian)[0, 0]) / R


SPEEDS = ij.Candidates(drop, {"speed": ij.Between(1.0, 2.5)}, name="drop")


def test_plan_within_a_budget_is_at_the_highest_speed():
    found = ij.design(SPEEDS, BALL, ij.WorstParameter(), budget={"performances": 3}, refits=0)
    (only,) = found.performances
    assert (only.number, only.values) == (3, {"speed": 2.5})
    np.testing.assert_allclose(found.size, error(2.5) / math.sqrt(3), rtol=1e-5)
    np.testing.assert_allclose(found.least_size, found.size, rtol=1e-6)
    np.testing.assert_allclose(found.expected["r"].half_width, 1.959964 * found.size, rtol=1e-6)
    assert math.isnan(found.expected["r"].attained)


def test_goal_is_reached_with_the_fewest_performances():
    asked = 1.959964 * error(2.5) / math.sqrt(3.5)
    found = ij.design(SPEEDS, BALL, ij.Within({"r": asked}), refits=0)
    assert found.reached
    assert found.costs == {"performances": 4.0}
    np.testing.assert_allclose(found.least_share, 3.5 / 4, rtol=0.02)
    assert str(found).startswith(f"This plan tells r within {100 * asked:.3g} %.\n  4 x drop")


def test_goal_beyond_the_budget_is_not_reached():
    asked = 1.959964 * error(2.5) / 2
    found = ij.design(SPEEDS, BALL, ij.Within({"r": asked}), budget={"performances": 1}, refits=0)
    assert not found.reached
    np.testing.assert_allclose(found.size, 2.0, rtol=1e-4)
    assert "No plan was found that tells r within" in str(found)


def test_cost_of_a_choice_moves_it_to_an_inner_optimum():
    """With the price 1 + speed², the error per price has its minimum inside the range: the price of
    a goal is n (1 + v²) with n = a/v², lowest for the highest speed; a price 1 + v⁴ turns that.
    """
    candidates = dataclasses.replace(SPEEDS, cost=lambda speed: {"s": 1 + speed**4})
    asked = 1.959964 * error(1.0) / math.sqrt(100)
    found = ij.design(candidates, BALL, ij.Within({"r": asked}), refits=0)
    best = min(100 / v**2 * (1 + v**4) for v in np.linspace(1, 2.5, 1501))
    assert best <= found.costs["s"] <= 1.05 * best
    assert found.least_share > 0.95


def test_refits_attain_the_expected_half_width():
    found = ij.design(
        SPEEDS, BALL, ij.WorstParameter(), budget={"performances": 2}, refits=40, seed=1
    )
    told = found.expected["r"]
    assert found.failed == 0
    assert abs(told.attained / told.half_width - 1) < 0.35  # three standard errors of a spread


def test_figure_shows_what_is_expected_and_asked():
    asked = 1.959964 * error(2.5) / math.sqrt(3.5)
    found = ij.design(SPEEDS, BALL, ij.Within({"r": asked}), refits=2)
    _, ax = plt.subplots()
    drawn = ij.plot.design(ax, found).lines
    lines = {line.get_label(): np.asarray(line.get_xdata()) for line in drawn}
    np.testing.assert_allclose(lines["asked"], [asked])
    np.testing.assert_allclose(lines["expected"], [1.959964 * error(2.5) / 2], rtol=1e-5)
    np.testing.assert_allclose(lines["2 refits"], [found.expected["r"].attained])
    plt.close("all")


def test_performed_experiments_and_priors_count():
    prior = {"r": ij.Normal(R, 0.5 * R * error(2.5))}
    found = ij.design(
        SPEEDS,
        BALL,
        ij.WorstParameter(),
        budget={"performances": 1},
        performed=[drop(BALL, 2.5)],
        priors=prior,
        refits=0,
    )
    np.testing.assert_allclose(found.size, error(2.5) / math.sqrt(1 + 1 + 4), rtol=1e-5)


def test_goal_that_is_reached_already_needs_no_performance():
    found = ij.design(
        SPEEDS, BALL, ij.Within({"r": 3 * error(2.5)}), performed=[drop(BALL, 2.5)], refits=0
    )
    assert found.performances == ()
    assert str(found).startswith("What is known already tells r within")


def test_two_sensors_of_one_motion_share_its_start():
    """A second clock that hears only the first four impacts tells more of the start than of r."""
    short = 4

    def both(model: ij.ImpactOscillator) -> list[ij.Experiment]:
        first = ij.ImpactTimes(times(R, 2.0)[:short])
        return [drop(model), dataclasses.replace(drop(model), recording=first)]

    found = ij.design(
        ij.Candidates(both), BALL, ij.WorstParameter(), budget={"performances": 1}, refits=0
    )
    whole = slopes(2.0)
    rows = np.concatenate([whole, whole[:short]]) / CLOCK
    expected = math.sqrt(np.linalg.inv(rows.T @ rows)[0, 0]) / R
    np.testing.assert_allclose(found.size, expected, rtol=1e-5)


def test_refits_draw_prior_knowledge_anew():
    """A prior as precise as the data: the errors are those of both together."""
    found = ij.design(
        SPEEDS,
        BALL,
        ij.WorstParameter(),
        budget={"performances": 1},
        priors={"r": ij.Normal(R, 0.3 * R * error(2.5))},
        refits=40,
    )
    told = found.expected["r"]
    assert abs(told.attained / told.half_width - 1) < 0.35  # three standard errors of a spread


def test_precision_is_averaged_over_the_models():
    """The relative errors at two restitutions, in the root mean square."""
    other = ij.ImpactOscillator(ij.BouncingBall(10.0), ij.Stop(ij.Restitution(0.81)))
    one = [
        ij.design(SPEEDS, each, ij.AOptimal(), budget={"performances": 1}, refits=0).size
        for each in (BALL, other)
    ]
    both = ij.design(SPEEDS, [BALL, other], ij.AOptimal(), budget={"performances": 1}, refits=0)
    np.testing.assert_allclose(both.size, math.sqrt(np.mean(np.square(one))), rtol=1e-6)


def test_candidate_that_cannot_be_simulated_is_left_out():
    short = ij.Candidates(
        lambda model, n: dataclasses.replace(
            drop(model), recording=ij.ImpactTimes(times(R, 2.0) * n)
        ),
        {"n": [0.01, 1.0]},
    )
    found = ij.design(short, BALL, ij.WorstParameter(), budget={"performances": 1}, refits=0)
    assert found.impossible == 1
    assert found.performances[0].values == {"n": 1.0}


WRONG = {
    "no budget": (lambda: ij.design(SPEEDS, BALL, ij.DOptimal()), "State a budget"),
    "no such parameter": (
        lambda: ij.design(SPEEDS, BALL, ij.Within({"k": 0.1}), refits=0),
        "There is no parameter `k`; there are r",
    ),
    "no such resource": (
        lambda: ij.design(SPEEDS, BALL, ij.DOptimal(), budget={"h": 1.0}),
        "The budget names `h`, which no candidate takes",
    ),
    "negative budget": (
        lambda: ij.design(SPEEDS, BALL, ij.DOptimal(), budget={"performances": -1.0}),
        "must be positive",
    ),
    "no sigma": (
        lambda: ij.design(
            ij.Candidates(lambda model: dataclasses.replace(drop(model), sensor=ij.Sensor())),
            BALL,
            ij.Within({"r": 0.1}),
        ),
        "state `sigma`",
    ),
    "priors twice": (
        lambda: ij.design(
            ij.Candidates(
                lambda model: dataclasses.replace(drop(model), priors={"r": ij.Normal(0.8, 0.1)})
            ),
            BALL,
            ij.Within({"r": 0.1}),
        ),
        "Prior knowledge counts once",
    ),
    "two costs": (
        lambda: ij.design(
            dataclasses.replace(SPEEDS, cost=lambda speed: {"s": 1.0, "EUR": speed}),
            BALL,
            ij.Within({"r": 0.1}),
        ),
        "State a budget of s, EUR",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_designs_are_refused(case):
    call, message = WRONG[case]
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("criterion", [ij.WorstParameter(), ij.AOptimal(), ij.DOptimal()])
def test_continuous_choice_reaches_its_optimum_however_small_the_errors(criterion):
    """The noise of the clock is lowest at 1.6, between the points that cover the range."""
    for clock in (1e-2, 1e-6):
        candidates = ij.Candidates(
            lambda model, q, clock=clock: drop(model, sigma=clock * (1 + 30 * (q - 1.6) ** 2)),
            {"q": ij.Between(1.0, 2.5)},
        )
        found = ij.design(candidates, BALL, criterion, budget={"performances": 1}, refits=0)
        np.testing.assert_allclose(found.performances[0].values["q"], 1.6, atol=1e-3)


def test_small_losses_are_compared_relatively():
    """Two cheap performances with 1.2 times the noise are better than one."""
    candidates = ij.Candidates(
        lambda model, q: drop(model, sigma=1e-6 * (1.0 if q else 1.2)),
        {"q": [0, 1]},
        cost=lambda q: {"s": 0.7 if q else 0.45},
    )
    found = ij.design(candidates, BALL, ij.WorstParameter(), budget={"s": 1.0}, refits=0)
    assert [(each.number, each.values["q"]) for each in found.performances] == [(2, 0)]


def test_cost_of_nothing_buys_no_more_than_the_goal_needs():
    free = dataclasses.replace(SPEEDS, cost=lambda speed: {"s": 0.0})
    asked = ij.Within({"r": 1.96 * error(2.5) / 1.5})
    assert ij.design(free, BALL, asked, refits=0).costs["performances"] <= 5
    never = dataclasses.replace(SPEEDS, cost=lambda speed: {"performances": 0.0})
    with pytest.raises(ValueError, match="Each performance takes one of the `performances`"):
        ij.design(never, BALL, asked, refits=0)


def test_kinds_are_priced_by_the_same_resource():
    one = {"speed": [1.0]}
    kinds = [
        ij.Candidates(drop, one, cost=lambda speed: {"s": 0.5}, name="dear"),
        ij.Candidates(drop, one, name="free"),
    ]
    asked = ij.Within({"r": 1.96 * error(1.0) / math.sqrt(5.5)})
    (only,) = ij.design(kinds, BALL, asked, refits=0).performances
    assert (only.name, only.number) == ("free", 6)


def test_parameter_that_is_to_be_found_cannot_be_chosen():
    def other(model: ij.ImpactOscillator, r: float) -> ij.Experiment:
        return drop(ij.ImpactOscillator(model.oscillator, ij.Stop(ij.Restitution(r))))

    with pytest.raises(ValueError, match="`r` is to be found, so that it cannot be chosen"):
        ij.design(ij.Candidates(other, {"r": [0.8, 0.79]}), BALL, ij.Within({"r": 0.1}))


def test_plan_that_nothing_tells_says_so():
    dear = dataclasses.replace(SPEEDS, cost=lambda speed: {"s": 10.0})
    found = ij.design(dear, BALL, ij.WorstParameter(), budget={"s": 1.0}, refits=0)
    assert str(found).startswith("No plan was found: no performance that the budget pays for")
