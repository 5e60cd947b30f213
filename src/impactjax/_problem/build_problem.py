"""Conversion of an experiment to its least-squares problem."""

import numpy as np
from jax.core import Tracer

from impactjax._model.initial_state import check_angle
from impactjax._problem.checks import check_bounds, check_declared, check_priors, check_requests
from impactjax._problem.experiment import Experiment
from impactjax._problem.loss import Squares
from impactjax._problem.parameters import handles, replaced
from impactjax._problem.problem import Problem
from impactjax._problem.scatter import AbstractScatter, NormalScatter, NoScatter
from impactjax._sensor.system import Start, System

_FLIGHTS = 4  # flights from which impact times tell the scatter of restitution


def build_problem(experiment: Experiment) -> Problem:
    """The residuals of an experiment as a function of the parameters to be fitted.

    Use it with a sampler or another optimiser: it has `start`, `residuals` and `log_density`, and
    `values` and `unbounded` convert between natural values and unbounded coordinates. Prior
    knowledge is no part of the residuals; it counts in `log_density`.

    **Raises** `ValueError` as `fit` does.
    """
    problem = pose(experiment)
    check_declared(problem.system)
    return problem


def pose(experiment: Experiment) -> Problem:
    """The problem of an experiment whose model may also contain weights, which `learn` finds."""
    recording, fixed, ties = experiment.recording, experiment.fixed, dict(experiment.ties)
    start, sensor = Start(recording.begin), experiment.sensor
    system = System(experiment.model, experiment.initial, start, sensor, recording.unit)
    known = handles(system)
    recording.check_suits(experiment.model, sensor)
    check_requests(experiment, system)
    values = {name: value for name, value in fixed.items() if value is not None}
    system = replaced(system, tuple(values), tuple(values.values()))
    check_angle(system.model.oscillator, system.initial)
    usual = {name for name, handle in known.items() if not handle.allowed.known}
    if recording.observes_impacts:
        usual = (usual | {"t0"}) - {"x0", "theta0"}
    wanted = (usual | {*experiment.free, *experiment.priors}) - {*fixed, *ties}
    names = tuple(name for name in known if name in wanted)
    check_priors(experiment.priors, names)
    for name, (low, high) in experiment.bounds:
        check_bounds(name, low, high, {each: known[each] for each in names}, system)
    traced = isinstance(recording.valid, Tracer)
    count = recording.valid.shape[0] if traced else int(np.asarray(recording.valid).sum())
    if count <= len(names):
        raise ValueError(
            f"The recording has {count} observations, too few for {len(names)} parameters "
            f"({', '.join(names)}); fix some of them."
        )
    return Problem(
        system=system,
        recording=recording,
        names=names,
        simulation=experiment.simulation,
        loss=experiment.loss,
        noise=experiment.noise,
        ties=experiment.ties,
        bounds=experiment.bounds,
        scatter=_scatter(experiment, count, len(names)),
        priors=experiment.priors,
    )


def _scatter(experiment: Experiment, count: int, parameters: int) -> AbstractScatter:
    """The scatter of an experiment, by default that of its recording."""
    wanted, plain = experiment.scatter, isinstance(experiment.loss, Squares)
    if wanted is None:
        enough = experiment.recording.observes_impacts and count > max(_FLIGHTS, parameters + 1)
        return NormalScatter() if enough and plain else NoScatter()
    if wanted.scatters and not plain:
        raise ValueError("A fit with scatter has the loss `Squares()`: leave out one of them.")
    model = experiment.model
    if wanted.scatters and model.lower is None and model.upper is None:
        raise ValueError("Scatter from impact to impact needs a stop, and the model has none.")
    return wanted
