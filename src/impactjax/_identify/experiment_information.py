"""The verb `information`: Fisher information in experiments, before any data exist."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike, Float

from impactjax._fit.evaluation import answer_at
from impactjax._fit.linear_scatter import around_values
from impactjax._fit.mixed_model import whitened
from impactjax._fit.synthetic import has_scatter
from impactjax._identify.directions import Sensitivities
from impactjax._identify.information import About, Information, informed, scaled
from impactjax._identify.joint_information import joint_information
from impactjax._known import AnyArray, is_known, known, namespace
from impactjax._optimise.linearisation import Vector
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.failure import failure
from impactjax._problem.padding import padded_size
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import Residuals
from impactjax._refusal import check_kind

Effects = Float[AnyArray, "observations impacts"]

OF_MOTION = ("theta0", "theta_dot0", "x0", "x_dot0", "t0")  # the same for all sensors of a motion


def information(
    experiment: Experiment | Sequence[Experiment], *, scatter: ArrayLike = 0.0
) -> Information:
    """Fisher information in the recording of an experiment, at the values of its model.

    No measured value is used, so it may be a planned one (`planned`). Impact times are simulated up
    to twice the length of the recorded ones, which must therefore be about right. All parameters
    that a fit would vary are included: those of initial state, release and sensor are estimated
    from the same data. Prior knowledge counts as further observations. The bounds are those of a
    fit by least squares with independent noise of the sensor's `sigma`.

    Works under `jit` and `vmap`, in which the result of a failed simulation is NaN.

    **Arguments:**

    - `experiment`: the model with the values around which to linearise; or several experiments,
      recordings of one motion by several sensors, with the initial state and the scatter in common.
    - `scatter`: standard deviation of the logarithm of the speed after each impact [1].

    **Raises** `ValueError` as `fit` does, for a sensor without `sigma`, a negative `scatter`, and a
    motion that cannot be simulated.
    """
    told = informed_by(experiment, scatter)
    if is_known(told) and not np.isfinite(np.asarray(told.sensitivities)).all():
        reason = failure(build_problem(_several(experiment)[0]))
        raise ValueError(f"The motion cannot be simulated: {reason}.")
    return told


def informed_by(
    experiment: Experiment | Sequence[Experiment], scatter: ArrayLike = 0.0
) -> Information:
    """Variant of `information` that is NaN if the motion cannot be simulated."""
    observed = [_observed(each, scatter) for each in _several(experiment)]
    parts = [each.told for each in observed]
    shared = [name for name in OF_MOTION if all(name in each.names for each in parts)]
    told = joint_information(parts, shared=shared if len(parts) > 1 else ())
    effects = [each.effects for each in observed if each.effects is not None]
    return _with_scatter(told, effects, scatter) if effects else told


class _Observed(NamedTuple):
    """The information in a recording without scatter, and the derivatives of its rows by the
    logarithms of the factors of the impacts; `None` without scatter.
    """

    told: Information
    effects: Effects | None


def _several(experiment: Experiment | Sequence[Experiment]) -> Sequence[Experiment]:
    """The experiments. Raises `TypeError` for anything else, and `ValueError` for none."""
    several = experiment if isinstance(experiment, Sequence) else [experiment]
    for each in several:
        check_kind("experiment", each, Experiment, "Experiment(model, planned(...), initial)")
    if not several:
        raise ValueError("There is no experiment to be informed by.")
    return several


def _observed(experiment: Experiment, scatter: ArrayLike) -> _Observed:
    problem = build_problem(experiment)
    variance, values = known(problem.variance()), known(problem.start)
    if variance is None:
        raise ValueError(
            "Information before a measurement needs the size of the noise: state `sigma` of the "
            "sensor, as in `Sensor(sigma=0.001)`."
        )
    effects = None
    if has_scatter(problem, scatter):
        jacobian, effects = _scattered(problem, values)
    else:
        jacobian = _plain(problem, values)
    xp = namespace(jacobian, variance)
    jacobian = jacobian / xp.sqrt(variance)
    prior = xp.asarray(problem.prior_rows(values).slopes, jacobian.dtype)
    told = informed(problem.handles(), values, xp.concatenate([jacobian, prior]))
    if effects is not None:
        effects = xp.pad(effects / xp.sqrt(variance), ((0, len(prior)), (0, 0)))
    return _Observed(told, effects)


def _plain(problem: Problem, values: Vector) -> Sensitivities:
    """The Jacobian of the observations."""
    own = problem.padded() if is_known(problem) else problem
    answer = answer_at(own, values)
    return _existing(answer.residuals, answer.jacobian)[: problem.valid.shape[-1]]


def _scattered(problem: Problem, values: Vector) -> tuple[Sensitivities, Effects]:
    """The Jacobian of the observations, and their derivatives by the logarithms of the factors."""
    most = problem.padded().impacts if is_known(problem) else problem.impacts
    point = around_values(problem, values, namespace(values).zeros(most, values.dtype))
    effects = point.effects
    if is_known(point) and not problem.recording.observes_impacts:
        effects = effects[:, : padded_size(max(int(point.impacts.count), 1))]
    return _existing(point.residuals, point.jacobian), effects


def _with_scatter(told: Information, effects: Sequence[Effects], scatter: ArrayLike) -> Information:
    """The information in rows with scatter: in units of scatter and noise together."""
    xp, most = namespace(told, effects, scatter), max(each.shape[1] for each in effects)
    joined = xp.concatenate([xp.pad(x, ((0, 0), (0, most - x.shape[1]))) for x in effects])
    rows = told.sensitivities / told.scale
    white = whitened(rows, joined, xp.asarray(scatter, rows.dtype) ** 2)
    about = About(told.names, told.units, told.positive, told.of_model)
    return scaled(about, told.values, white)


def _existing(residuals: Residuals, jacobian: Sensitivities | None) -> Sensitivities:
    """A Jacobian, NaN if a residual is: the derivatives of what was not simulated are zero."""
    assert jacobian is not None
    residuals, jacobian = known(residuals), known(jacobian)
    xp = namespace(residuals, jacobian)
    return xp.where(xp.all(xp.isfinite(residuals)), jacobian, xp.nan)
