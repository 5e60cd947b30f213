"""Scores of a fit against what was held out: the end of its record, or another recording."""

import dataclasses
import numbers
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._compare.prepare import Prepared
from impactjax._compare.step_budget import step_budget
from impactjax._fit.estimate import Estimate
from impactjax._fit.fit import best_from
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem
from impactjax._problem.scatter import NoScatter
from impactjax._record.abstract_recording import AbstractRecording

R = TypeVar("R", bound=AbstractRecording)

_RIG = ("model", "sensor")  # parts of a system that other recordings share
_OF_ONE = ("offset", "drift")  # parameters of the sensor that they do not share


class Prediction(NamedTuple):
    """Prediction of the observations that a fit has not seen.

    - `observations`: number of those that count.
    - `rms`: root mean square of predicted minus recorded, in the recording's SI unit; infinite if
      the fit or the simulation failed.
    - `recording`: name of the recording that was held out; empty for the end of the fitted one.
    """

    observations: int
    rms: float
    recording: str = ""


def share_of(holdout: float | Prepared, fitted: Sequence[AbstractRecording]) -> float:
    """The share of the fitted recordings that is held out; 0 if another recording is.

    **Raises** `TypeError` for what is neither a share nor prepared, and `ValueError` for a share
    that cannot be held out, and for a recording of another quantity than those fitted.
    """
    if isinstance(holdout, Prepared):
        for each in fitted:
            _check_quantity(holdout, each)
        return 0.0
    if not isinstance(holdout, numbers.Real):
        raise TypeError(
            "Argument `holdout` must be a share of the observations or what `prepare` made of "
            f'another recording, such as prepare("another.csv"), but it is {holdout!r}.'
        )
    if not 0 <= holdout < 1:
        raise ValueError(
            f"Argument `holdout` is the share of the observations to hold out, from 0 to less than "
            f"1, but it is {holdout}."
        )
    return holdout


def _check_quantity(held_out: Prepared, fitted: AbstractRecording) -> None:
    other = _first(held_out).recording
    if (type(fitted), fitted.unit) != (type(other), other.unit):
        raise ValueError(
            f"{held_out.name} cannot be held out: it is a {type(other).__name__} in {other.unit}, "
            f"and what is fitted is a {type(fitted).__name__} in {fitted.unit}."
        )


def fitted_part(recording: R, share: float) -> R:
    """The recording whose last `share` of the observations that count do not count any more."""
    valid, instants = np.asarray(recording.valid), np.asarray(recording.instants)
    kept = instants[valid]
    count = max(len(kept) - round(share * len(kept)), 1)
    mask = jnp.asarray(valid & (instants <= kept[count - 1]))
    return eqx.tree_at(lambda each: each.valid, recording, mask)


def prediction(
    estimate: Estimate[Problem],
    recording: AbstractRecording,
    share: float,
    optimiser: LevenbergMarquardt,
    search: Search,
) -> Prediction:
    """The prediction of the last `share` of the observations of a recording, which were not fitted.
    Impacts that were fitted have their expected deviations; later ones follow the law.
    """
    unseen = np.asarray(recording.valid) & ~np.asarray(fitted_part(recording, share).valid)
    whole = eqx.tree_at(lambda each: each.recording, estimate.problem, recording)
    problem = whole.padded().of_record()
    if estimate.scatter is not None:
        problem = problem.scattered(jnp.asarray(estimate.scatter.logarithms))
    u, parts = problem.coordinates(np.asarray(estimate.values)), problem.parts(optimiser.horizons)
    found = search.evaluate(problem, jnp.asarray(u), jnp.asarray(parts), jnp.zeros((), bool))
    left = np.asarray(found.answer.residuals)[: len(unseen)][unseen]
    rms = float(np.sqrt(np.mean(left**2))) if np.isfinite(left).all() else np.inf
    return Prediction(len(left), rms)


def prediction_of_another(
    estimate: Estimate[Problem],
    held_out: Prepared,
    starts: Starts,
    optimiser: LevenbergMarquardt,
    search: Search,
) -> Prediction:
    """The prediction of another recording of the same rig. Only the start of its motion is fitted
    to it, with the zero and the drift of its sensor if they were fitted; impacts follow the law
    without scatter.
    """
    count = int(np.asarray(_first(held_out).recording.valid).sum())
    if not bool(estimate.converged):
        return Prediction(count, np.inf, held_out.name)
    problem = build_problem(_on_the_rig(estimate, held_out))
    found = best_from(problem, starts.lanes(problem), optimiser, search)
    rms = float(found.rms) if np.isfinite(found.rms) else np.inf
    return Prediction(count, rms, held_out.name)


def _first(held_out: Prepared) -> Experiment:
    """The first of the experiments, which differ in their models only."""
    return next(iter(held_out.experiments.values()))


def _on_the_rig(estimate: Estimate[Problem], held_out: Prepared) -> Experiment:
    """An experiment on a recording that is held out, with the fitted model and sensor. Values that
    were stated for its start, zero and drift are kept, and prior knowledge of its start.
    """
    other, system = _first(held_out), estimate.system
    parts = {name: handle.path[0] for name, handle in handles(system).items()}
    held = [name for name, part in parts.items() if part in _RIG and name not in _OF_ONE]
    stated = {name: x for name, x in other.fixed.items() if name in {*parts} - {*held}}
    zero = {name: getattr(other.sensor, name) for name in _OF_ONE}
    return dataclasses.replace(
        other,
        model=system.model,
        sensor=dataclasses.replace(system.sensor, **zero),
        fixed={**stated, **dict.fromkeys(held)},
        free=[name for name in _OF_ONE if name in estimate.names and name not in stated],
        ties={},
        priors={
            name: prior
            for name, prior in other.priors.items()
            if name in parts and parts[name] not in _RIG
        },
        bounds={},
        loss=estimate.problem.loss,
        scatter=NoScatter(),
        simulation=step_budget(other.recording, held_out.first_look, system.model),
    )
