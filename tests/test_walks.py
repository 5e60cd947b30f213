"""Walks of a profile between two minima, with refits in closed form."""

import dataclasses
import math
from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from estimates import line
from impactjax._fit.profile_walk import Walk
from impactjax._fit.refits import Points, Refits
from impactjax._fit.search import Search
from impactjax._fit.straight import Straight
from impactjax._fit.walks import Local, walked
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._parameter import Range

ANY = Range("1", -math.inf, math.inf, False, False)


@dataclasses.dataclass(frozen=True)
class Valleys(Refits):
    """Refits in two valleys of χ²/2: p²/2 and another one. A refit stays in that of its start, of
    which the second parameter is 1 or 0.
    """

    other: Callable[[np.ndarray], np.ndarray]
    rounds: list[int]

    def minima(self, starts, active):
        first = starts[:, 1] > 0.5
        costs = np.where(first, starts[:, 0] ** 2 / 2, self.other(starts[:, 0]))
        self.rounds.append(len(starts))
        zero = np.zeros_like(starts)
        return Points(starts, costs, zero, np.zeros((len(starts), 2, 2)), active)


def walk_up(other):
    """A walk from the estimate 0 up to a rise of 1.96, and the number of refits in its rounds."""
    _, found = line()
    estimate = eqx.tree_at(
        lambda each: (each.values, each.jacobian), found, (jnp.array([0.0, 1.0]), jnp.eye(2))
    )
    valleys = Valleys(
        estimate.problem, LevenbergMarquardt(), Search(), 0.0, 1.0, (ANY, ANY), other, []
    )
    coordinates = Straight((1.0, 1.0), (False, True), (ANY, ANY), (ANY, ANY))
    around = Local(coordinates, np.array([0.0, 1.0]), np.eye(2))
    walk = Walk(0, 1, 0.0, 1.0, False, math.inf, 1.96)
    walked(estimate, valleys, around, [walk])
    return walk, valleys.rounds[1:]


@pytest.mark.parametrize("depth", [0.5, 1.5])
def test_interval_is_that_over_both_valleys(depth):
    walk, rounds = walk_up(lambda p: (p - 1) ** 2 / 2 + depth)
    end = 1 + math.sqrt(1.96**2 - 2 * depth)
    assert walk.bounded
    assert walk.distance == pytest.approx(max(end, 1.96), rel=0.05)
    assert set(rounds) == {2}


def test_no_refits_begin_in_a_valley_far_above():
    walk, rounds = walk_up(lambda p: (p - 1) ** 2 / 2 + 20.0)
    assert walk.distance == pytest.approx(1.96, rel=0.05)
    assert set(rounds) == {1}


def test_valley_below_the_estimate_is_not_hidden():
    """The estimate is not the lowest there, and its interval has no end."""
    walk, _ = walk_up(lambda p: (p - 1) ** 2 / 2 - 3.0)
    assert not walk.bounded
