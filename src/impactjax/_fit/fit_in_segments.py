"""The verb `fit_in_segments`: one estimate from a recording, in segments with their own starts."""

import dataclasses
from itertools import pairwise

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._first_look.first_look import noise_size, smoothed
from impactjax._fit.estimate import Estimate
from impactjax._fit.evaluation import Lanes, evaluate_each
from impactjax._fit.fit import best_from, check_search
from impactjax._fit.fit_together import named, priors_of, without_scatter
from impactjax._fit.search import Search, Searches, lowest
from impactjax._fit.starts import Starts
from impactjax._known import is_known, known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.joint_problem import JointProblem
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem
from impactjax._record.recording import Recording
from impactjax._refusal import check_kind, whole
from impactjax._types import Scalar

_ROUNDS = 3  # fits, between which the size of the noise is estimated anew
_NEAR = 1 / 3  # of a segment, to both sides: where the highest place for a cut is sought
_STATES = 12  # states from which each segment is searched
_SPREAD = 5.0  # of these states, in sizes of the noise
_SAMPLES = 20  # samples that tell the velocity
_FEWEST = 24  # samples of a segment


def fit_in_segments(
    experiment: Experiment,
    count: int,
    *,
    starts: Starts = Starts(1),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> Estimate[JointProblem]:
    """One estimate from a recorded motion that no single simulation follows, because it is chaotic.

    The recording is cut into segments, at high places between impacts. They share the model and the
    sensor; the state at the start of each is fitted, with a name that carries its number:
    `theta0[3]`. As in multiple shooting, each segment is short enough for a search; but segments
    need not join. Restitution has no scatter from impact to impact. A low-pass of the sensor begins
    anew in each segment, as if the motion had been straight before.

    Source: H. G. Bock (1983), "Recent advances in parameter identification techniques for O.D.E.",
    for multiple shooting; E. Baake, M. Baake, H. G. Bock and K. M. Briggs (1992), "Fitting ordinary
    differential equations to chaotic data", Physical Review A 45, 5524.

    **Arguments:**

    - `experiment`: recording of a position or an angle, model with starting values, and prior
      information. What it says of the initial state holds for the first segment; the states of the
      others start from the recording.
    - `count`: number of segments, at least two.
    - `starts`, `optimiser`: settings of the searches.

    **Raises** `ValueError` as `fit` does, for a recording of another quantity, under `jit`, and for
    segments of fewer than 24 samples.
    """
    check_search(starts, optimiser)
    check_kind("experiment", experiment, Experiment, "Experiment(model, recording, initial)")
    recording = _checked(experiment)
    experiments = _segments(experiment, recording, whole("count", count, 2))
    problems = [without_scatter(each) for each in experiments]
    names, places = named(problems, _of_sensor(problems[0]), ())
    priors = priors_of(experiments, problems, names, places)
    variance = problems[0].variance()
    usual = noise_size(_places(recording)) if variance is None else float(np.sqrt(variance))
    joint = JointProblem(
        problems=tuple(problems),
        sizes=(jnp.asarray(usual),) * len(problems),
        priors=tuple(priors.values()),
        names=names,
        places=places,
        asked=tuple(names.index(name) for name in priors),
    )
    search = Search(evaluate_each)
    estimate = best_from(joint, _lanes(joint, starts), optimiser, search)
    for _ in range(_ROUNDS - 1):
        if variance is None:
            joint = eqx.tree_at(lambda each: each.sizes, joint, (_size(estimate),) * len(problems))
        values = _with_other_states(joint, np.array(estimate.values), usual, optimiser)
        estimate = best_from(joint, joint.coordinates(values)[None], optimiser, search)
    return estimate


def _checked(experiment: Experiment) -> Recording:
    """The recording, of a place and known."""
    recording = experiment.recording
    if not is_known(experiment):
        raise ValueError(
            "`fit_in_segments` needs a recording that is known: call it outside `jit`."
        )
    if not (isinstance(recording, Recording) and recording.shows_place):
        raise ValueError(
            f"Segments need a recorded position or angle, but this is a record of "
            f"{recording.observed}."
        )
    return recording


def _places(recording: Recording) -> np.ndarray:
    """The recorded places, with straight lines over gaps."""
    ts, values, valid = (np.asarray(x) for x in (recording.ts, recording.values, recording.valid))
    return np.interp(ts, ts[valid], values[valid])


def _segments(experiment: Experiment, recording: Recording, count: int) -> list[Experiment]:
    """The experiment of each segment, with recordings padded to one length."""
    ends = _cuts(_places(recording), count)
    if np.diff(ends).min() < _FEWEST:
        raise ValueError(
            f"{count} segments of {ends[-1]} samples are too short: choose a smaller `count`."
        )
    longest = int(np.diff(ends).max())
    parts = [
        Recording(
            recording.ts[begin:end],
            recording.values[begin:end],
            recording.quantity,
            recording.valid[begin:end],
        )
        for begin, end in pairwise(ends)
    ]
    problem = build_problem(experiment)
    first = dataclasses.replace(experiment, recording=parts[0].padded(longest))
    return [first, *(_later(experiment, problem, part, longest) for part in parts[1:])]


def _cuts(places: np.ndarray, count: int) -> list[int]:
    """First samples of the segments, at the highest places near even cuts, and the end."""
    smooth, _ = smoothed(places)
    even = np.linspace(0, len(places), count + 1).astype(int)
    reach = max(int(_NEAR * len(places) / count), 1)
    tops = [i - reach + int(np.argmax(smooth[i - reach : i + reach])) for i in even[1:-1].tolist()]
    return [0, *tops, len(places)]


def _later(experiment: Experiment, problem: Problem, part: Recording, longest: int) -> Experiment:
    """The experiment of a segment after the first one, with its own initial state."""
    model, sensor = problem.system.model, problem.system.sensor
    gap = 0.0 if model.lower is None else float(model.lower.gap)
    initial = part.first_look(model.oscillator, gap, sensor).initial
    own = _names(problem, "initial")
    return dataclasses.replace(
        experiment,
        recording=part.padded(longest),
        initial=initial,
        fixed={name: x for name, x in experiment.fixed.items() if name not in own},
        bounds=tuple(each for each in experiment.bounds if each[0] not in own),
        priors={},
    )


def _names(problem: Problem, part: str) -> list[str]:
    """Names of the parameters of a part of the system."""
    return [name for name, handle in handles(problem.system).items() if handle.path[0] == part]


def _of_sensor(problem: Problem) -> list[str]:
    """Names of the fitted parameters of the sensor, which all segments share."""
    return [name for name in _names(problem, "sensor") if name in problem.names]


def _lanes(joint: JointProblem, starts: Starts) -> Lanes:
    """Starts of the search: the parameters of the first segment, which include all that are shared,
    are scattered.
    """
    first, own = joint.problems[0], list(joint.places[0])
    lanes = np.tile(np.asarray(joint.coordinates(joint.start)), (starts.count, 1))
    lanes[:, own] = np.asarray(starts.lanes(first))
    return jnp.asarray(lanes)


def _with_other_states(
    joint: JointProblem, values: np.ndarray, noise: float, optimiser: LevenbergMarquardt
) -> np.ndarray:
    """The values with the best state at the start of each segment, of searches from states around
    it: a segment whose motion grazes the stop has several minima.
    """
    for i, (problem, places) in enumerate(joint.each_recording()):
        initial = np.isin(problem.names, _names(problem, "initial"))
        random = np.random.default_rng(i).standard_normal((_STATES, len(places)))
        random[0] = 0.0
        ts = np.asarray(problem.recording.instants, float)
        span = _SAMPLES * float(np.median(np.diff(ts)))
        known_paths = handles(problem.system)
        rates = np.array([known_paths[name].path[-1] == "velocity" for name in problem.names])
        spread = _SPREAD * noise * np.where(rates, 1 / span, 1.0) * initial
        own = values[list(places)]
        lanes = problem.coordinates(own + spread * random)
        padded = problem.padded()
        moving = np.broadcast_to(initial, lanes.shape)
        searches = Searches(lanes, moving, padded.parts(optimiser.horizons))
        best = known(lowest(Search().minima(padded, optimiser, searches)))
        values[list(places)] = np.where(initial, known(problem.at(best.u)), own)
    return values


def _size(estimate: Estimate[JointProblem]) -> Scalar:
    """Noise σ of the recording, from the residuals of all segments."""
    joint = estimate.problem
    rows = [joint.share(i, estimate.residuals) for i in range(len(joint.problems))]
    freedom = int(np.asarray(joint.observations)) - len(joint.names)
    return jnp.sqrt(sum(jnp.sum(each**2) for each in rows) / freedom)
