"""Verification of a plan by simulated refits."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from impactjax._design.scattered import scattered
from impactjax._fit.bootstrap import simulated
from impactjax._fit.evaluation import evaluate_each
from impactjax._fit.search import Search, Searches, lowest
from impactjax._identify.experiment_information import OF_MOTION
from impactjax._known import AnyArray, known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.minimiser import Minimum
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.joint_problem import JointProblem
from impactjax._problem.prior import Normal
from impactjax._problem.problem import Problem
from impactjax._problem.scatter import NoScatter

_CLOSE = LevenbergMarquardt(reduction=1e-6, damping=1e-6)  # starts are close to the minimum

Motion = Sequence[Experiment]  # recordings of one motion


class Refits(NamedTuple):
    """Fits of all recordings of a plan together, each to simulated values with their own noise.

    - `names`: all fitted parameters.
    - `values`: their values in each refit that did not fail.
    - `failed`: number of refits whose search did not end at a minimum.
    """

    names: tuple[str, ...]
    values: Float[AnyArray, "refits parameters"]
    failed: int


def refitted(
    motions: Sequence[Motion],
    priors: Mapping[str, Normal],
    key: Key[Array, ""],
    count: int,
    scatter: float = 0.0,
) -> Refits:
    """Refits of a plan, from starts at the true values. Prior means are drawn as well, and so are
    the factors of the impacts for scatter of some size.
    """
    joint = _joint(motions, priors)
    refit = _plain(joint)
    if scatter:
        places = [number for number, motion in enumerate(motions) for _ in motion]
        refit = scattered(joint, places, scatter).refit
    rows, failed = [], 0
    for own in jax.random.split(key, count):
        found = refit(own)
        if bool(found.converged) and np.isfinite(found.cost):
            rows.append(np.asarray(joint.at(found.u[: len(joint.names)])))
        else:
            failed += 1
    return Refits(joint.names, np.array(rows).reshape(-1, len(joint.names)), failed)


def _plain(joint: JointProblem) -> Callable[[Key[Array, ""]], Minimum]:
    """Refits with the same restitution at every impact."""
    start, whole = joint.coordinates(known(joint.start)), known(joint.parts((1.0,)))
    exact = evaluate_each(joint, start, whole, jnp.zeros((), bool)).answer.residuals
    searches = Searches(start[None], np.ones((1, len(start)), bool), whole)

    def refit(key: Key[Array, ""]) -> Minimum:
        drawn = simulated(joint, jnp.asarray(exact), key)
        return lowest(Search(evaluate_each).minima(drawn, _CLOSE, searches))

    return refit


def _joint(motions: Sequence[Motion], priors: Mapping[str, Normal]) -> JointProblem:
    """The joint problem of all recordings of a plan, and of prior knowledge."""
    problems, names, places = [], list[str](), []
    for number, motion in enumerate(motions):
        for each in motion:
            problem = dataclasses.replace(build_problem(each), scatter=NoScatter())
            called = [
                _called(name, handle.path[0], number, len(problems))
                for name, handle in problem.handles().items()
            ]
            names += [name for name in called if name not in names]
            places.append(tuple(names.index(name) for name in called))
            problems.append(problem)
    return JointProblem(
        problems=tuple(problems),
        sizes=tuple(_sigma(problem) for problem in problems),
        priors=tuple(priors.values()),
        names=tuple(names),
        places=tuple(places),
        asked=tuple(names.index(name) for name in priors),
    )


def _called(name: str, part: str, motion: int, recording: int) -> str:
    """The joint name of a parameter: a model's own, or that of one motion or recording."""
    if part == "model":
        return name
    return f"{name}[{motion if name in OF_MOTION else recording}]"


def _sigma(problem: Problem) -> Float[Array, ""]:
    variance = problem.variance()
    assert variance is not None  # `information` has asked for it
    return jnp.sqrt(variance)
