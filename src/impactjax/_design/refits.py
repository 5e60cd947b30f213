"""Verification of a plan by simulated refits."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from impactjax._design.informed import OF_MOTION
from impactjax._fit.evaluation import evaluate_each
from impactjax._fit.search import Search, Searches, lowest
from impactjax._fit.synthetic import synthetic
from impactjax._known import AnyArray, known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.joint_problem import JointProblem
from impactjax._problem.prior import Normal
from impactjax._problem.problem import Problem
from impactjax._problem.scatter import NoScatter

_REDUCTION, _DAMPING = 1e-6, 1e-6  # of searches that start close to the minimum

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
    motions: Sequence[Motion], priors: Mapping[str, Normal], key: Key[Array, ""], count: int
) -> Refits:
    """Refits of a plan, from starts at the true values. Prior means are drawn as well."""
    close = LevenbergMarquardt(reduction=_REDUCTION, damping=_DAMPING)
    rows, failed, names = [], 0, ()
    for own in jax.random.split(key, count):
        joint = _drawn(motions, priors, own)
        names, start = joint.names, joint.coordinates(known(joint.start))
        whole = known(joint.parts((1.0,)))
        searches = Searches(start[None], np.ones((1, len(names)), bool), whole)
        found = lowest(Search(evaluate_each).minima(joint, close, searches))
        if bool(found.converged) and np.isfinite(found.cost):
            rows.append(np.asarray(joint.at(found.u)))
        else:
            failed += 1
    return Refits(names, np.array(rows).reshape(-1, len(names)), failed)


def _drawn(
    motions: Sequence[Motion], priors: Mapping[str, Normal], key: Key[Array, ""]
) -> JointProblem:
    """The joint problem of simulated recordings."""
    of_priors, *keys = jax.random.split(key, 1 + sum(len(each) for each in motions))
    problems, names, places = [], list[str](), []
    for number, motion in enumerate(motions):
        for each in motion:
            drawn = synthetic(each, keys[len(problems)])
            problem = dataclasses.replace(build_problem(drawn), scatter=NoScatter())
            called = [
                _called(name, handle.path[0], number, len(problems))
                for name, handle in problem.handles().items()
            ]
            names += [name for name in called if name not in names]
            places.append(tuple(names.index(name) for name in called))
            problems.append(problem)
    steps = np.asarray(jax.random.normal(of_priors, (len(priors),)))
    true = _values(problems, places)
    return JointProblem(
        problems=tuple(problems),
        sizes=tuple(_sigma(problem) for problem in problems),
        priors=tuple(
            Normal(true[names.index(name)] + step * prior.sigma, prior.sigma)
            for (name, prior), step in zip(priors.items(), steps, strict=True)
        ),
        names=tuple(names),
        places=tuple(places),
        asked=tuple(names.index(name) for name in priors),
    )


def _called(name: str, part: str, motion: int, recording: int) -> str:
    """The joint name of a parameter: a model's own, or that of one motion or recording."""
    if part == "model":
        return name
    return f"{name}[{motion if name in OF_MOTION else recording}]"


def _values(problems: Sequence[Problem], places: Sequence[tuple[int, ...]]) -> dict[int, float]:
    return {
        place: float(value)
        for problem, own in zip(problems, places, strict=True)
        for place, value in zip(own, problem.starting_values(), strict=True)
    }


def _sigma(problem: Problem) -> Float[Array, ""]:
    variance = problem.variance()
    assert variance is not None  # `information` has asked for it
    return jnp.sqrt(variance)
