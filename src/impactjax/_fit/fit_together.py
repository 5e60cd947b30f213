"""The verb `fit_together`: one estimate from several recordings and prior knowledge."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp

from impactjax._fit.estimate import Estimate
from impactjax._fit.evaluation import Lanes, evaluate_each
from impactjax._fit.fit import best_from, check_search, solve
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.joint_problem import JointProblem
from impactjax._problem.prior import Normal
from impactjax._problem.problem import Problem
from impactjax._problem.scatter import NoScatter
from impactjax._refusal import as_names, check_kind, whole
from impactjax._types import Scalar

_ROUNDS = 3  # joint fits, between which the noise variances are estimated anew
_STARTS = 8  # most starts: each takes the shared parameters from one experiment's own fit


def fit_together(
    experiments: Sequence[Experiment],
    *,
    shared: Sequence[str] = (),
    own: Sequence[str] = (),
    starts: Starts = Starts(1),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> Estimate[JointProblem]:
    """One estimate from several recordings: of one motion by several sensors, of one rig at several
    times, of one material on several rigs.

    Parameters of the model (oscillator, stops, laws) are shared by all experiments that have them.
    Those of initial state and sensor belong to one experiment each; with several experiments their
    names carry its number: `theta0[1]`. `priors` of the experiments count as further observations.

    Each recording is weighted by the variance of its noise. This is known from its sensor or
    estimated: first from a fit of that recording alone, then from its residuals in the joint fit.
    Restitution is the same at every impact: a joint fit has no scatter from impact to impact.
    Works under `jit` and `vmap`.

    **Arguments:**

    - `experiments`: at least one.
    - `shared`: names of further shared parameters, such as the initial state of one motion seen by
      two sensors.
    - `own`: names of model parameters that differ between experiments.
    - `starts`, `optimiser`: for the fit of each recording alone; the joint searches start from
      these fits.

    **Raises** `ValueError` as `fit` does, for names that no experiment has or that are both
    `shared` and `own`, and for an experiment with `NormalScatter()`.
    """
    check_search(starts, optimiser)
    shared, own = as_names("shared", shared), as_names("own", own)
    if not experiments:
        raise ValueError("There is no experiment to fit.")
    for experiment in experiments:
        check_kind("experiments", experiment, Experiment, "Experiment(model, recording, initial)")
    problems = [without_scatter(each) for each in _padded(experiments)]
    alone = [solve(problem, starts, optimiser) for problem in problems]
    names, places = named(problems, shared, own)
    priors = priors_of(experiments, problems, names, places)
    joint = JointProblem(
        problems=tuple(problems),
        sizes=tuple(_size(estimate) for estimate in alone),
        priors=tuple(priors.values()),
        names=names,
        places=places,
        asked=tuple(names.index(name) for name in priors),
    )
    lanes = _lanes(joint, alone)
    search = Search(evaluate_each)
    estimate = best_from(joint, lanes, optimiser, search)
    for _ in range(_ROUNDS - 1 if joint.sizes_found else 0):
        joint = eqx.tree_at(lambda each: each.sizes, joint, _sizes(estimate))
        lanes = jnp.broadcast_to(joint.coordinates(estimate.values), lanes.shape)
        estimate = best_from(joint, lanes, optimiser, search)
    return estimate


def without_scatter(experiment: Experiment) -> Problem:
    """The problem of one experiment in a joint fit.

    **Raises** `ValueError` for an experiment with scatter.
    """
    if experiment.scatter is not None and experiment.scatter.scatters:
        raise ValueError(
            "A joint fit has no scatter from impact to impact: fit each experiment alone, or leave "
            "out `scatter`."
        )
    problem = build_problem(experiment)  # prior knowledge is part of the joint problem
    return dataclasses.replace(problem, scatter=NoScatter(), priors={})


def of_experiment(estimate: Estimate[JointProblem], index: int) -> Estimate[Problem]:
    """One experiment's part of a joint estimate, for figures, words and residuals. Values, errors
    and information criteria are those of the joint fit.

    **Raises** `TypeError` for an estimate of one recording, and `ValueError` for a number that no
    experiment has.
    """
    check_kind("estimate", estimate, Estimate, "fit_together(experiments)")
    joint = estimate.problem
    if not isinstance(joint, JointProblem):
        raise TypeError("Argument `estimate` must be one of `fit_together`, but it is of one fit.")
    count = len(joint.problems)
    if whole("index", index, 0) >= count:
        raise ValueError(f"There is no experiment {index}: there are {count}, from 0.")
    places = jnp.array(joint.places[index])
    residuals = joint.share(index, estimate.residuals)
    jacobian = joint.share(index, estimate.jacobian)[:, places]
    problem = joint.problems[index]
    count = problem.observations.astype(residuals.dtype)
    return Estimate(
        problem=problem,
        values=estimate.values[places],
        standard_errors=estimate.standard_errors[places],
        inflation=estimate.inflation[places],
        freedom=estimate.freedom,
        memory=problem.noise.order(problem.loss.score(residuals), count),
        lasting=estimate.lasting,
        exceeds_noise=estimate.exceeds_noise,
        low=estimate.low[places],
        high=estimate.high[places],
        covariance=estimate.covariance[places][:, places],
        verdicts=estimate.verdicts[places],
        residuals=residuals,
        jacobian=jacobian,
        impacts=jax.tree.map(lambda x: x[index], estimate.impacts),
        rms=jnp.sqrt(jnp.sum(residuals**2) / count),
        aic=estimate.aic,
        bic=estimate.bic,
        misfit=problem.misfit(residuals),
        outcome=estimate.outcome,
        iterations=estimate.iterations,
        start_costs=estimate.start_costs,
    )


def _padded(experiments: Sequence[Experiment]) -> list[Experiment]:
    """The experiments with recordings of one type padded to one length, to share a program."""
    longest: dict[type, int] = {}
    for each in experiments:
        kind, count = type(each.recording), each.recording.valid.shape[-1]
        longest[kind] = max(longest.get(kind, 0), count)
    return [
        dataclasses.replace(each, recording=each.recording.padded(longest[type(each.recording)]))
        for each in experiments
    ]


def priors_of(
    experiments: Sequence[Experiment],
    problems: Sequence[Problem],
    names: tuple[str, ...],
    places: tuple[tuple[int, ...], ...],
) -> dict[str, Normal]:
    """Prior knowledge by joint name."""
    found: dict[str, Normal] = {}
    for experiment, problem, own in zip(experiments, problems, places, strict=True):
        for name, prior in experiment.priors.items():
            joint = names[own[problem.names.index(name)]]
            if joint in found:
                raise ValueError(f"Two experiments have a prior of `{joint}`, which they share.")
            found[joint] = prior
    return found


def named(
    problems: Sequence[Problem], shared: Sequence[str], own: Sequence[str]
) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]:
    """The joint names, and for each problem the indices of its parameters among them."""
    known = {name for problem in problems for name in problem.names}
    for name in (*shared, *own):
        if name not in known:
            raise ValueError(f"No experiment fits a parameter `{name}`; there are {sorted(known)}.")
    if both := sorted({*shared} & {*own}):
        raise ValueError(f"Parameter `{both[0]}` is both shared and each experiment's own.")
    names: list[str] = []
    places = []
    for i, problem in enumerate(problems):
        called = [
            name
            if len(problems) == 1
            or ((handle.path[0] == "model" or name in shared) and name not in own)
            else f"{name}[{i}]"
            for name, handle in problem.handles().items()
        ]
        names += [name for name in called if name not in names]
        places.append(tuple(names.index(name) for name in called))
    return tuple(names), tuple(places)


def _size(alone: Estimate[Problem]) -> Scalar:
    """Noise σ of a recording, from its sensor or its own fit."""
    known = alone.problem.variance()
    if known is not None:
        return jnp.sqrt(known)
    n, p = alone.problem.observations.astype(alone.rms.dtype), len(alone.names)
    return alone.rms * jnp.sqrt(n / (n - p))


def _sizes(estimate: Estimate[JointProblem]) -> tuple[Scalar, ...]:
    """Noise σ of each recording, from its sensor or its residuals in the joint fit."""
    joint, found = estimate.problem, []
    dtype = estimate.residuals.dtype
    share = 1 - len(joint.names) / joint.observations.astype(dtype)
    for i, problem in enumerate(joint.problems):
        squares = jnp.sum(joint.share(i, estimate.residuals) ** 2)
        known = problem.variance()
        count = problem.observations.astype(dtype)
        variance = squares / (count * share) if known is None else known
        found.append(jnp.sqrt(variance))
    return tuple(found)


def _lanes(joint: JointProblem, alone: Sequence[Estimate[Problem]]) -> Lanes:
    """Starts of the joint search. Each takes the shared parameters from the fit of one experiment
    alone, and the others from the fit of their own.
    """
    order = range(len(alone))
    rows = []
    for chief in order[:_STARTS]:
        values = jnp.zeros(len(joint.names), alone[0].values.dtype)
        for i in (*(i for i in order if i != chief), chief):
            values = values.at[jnp.array(joint.places[i])].set(alone[i].values)
        rows.append(joint.coordinates(values))
    return jnp.stack(rows)
