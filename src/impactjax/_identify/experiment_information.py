"""The verb `information`: Fisher information in an experiment, before any data exist."""

import numpy as np
from jaxtyping import ArrayLike, Float

from impactjax._fit.evaluation import answer_at, evaluate
from impactjax._fit.linear_scatter import around
from impactjax._fit.mixed_model import whitened
from impactjax._fit.straight import straight
from impactjax._fit.synthetic import has_scatter
from impactjax._identify.directions import Sensitivities
from impactjax._identify.information import Information, informed
from impactjax._known import AnyArray, is_known, known, namespace
from impactjax._optimise.linearisation import Vector
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.failure import failure
from impactjax._problem.padding import padded_size
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import Residuals
from impactjax._refusal import check_kind


def information(experiment: Experiment, *, scatter: ArrayLike = 0.0) -> Information:
    """Fisher information in the recording of an experiment, at the values of its model.

    No measured value is used, so it may be a planned one (`planned`). Impact times are simulated up
    to twice the length of the recorded ones, which must therefore be about right. All parameters
    that a fit would vary are included: those of initial state, release and sensor are estimated
    from the same data. Prior knowledge counts as further observations. The bounds are those of a
    fit by least squares with independent noise of the sensor's `sigma`.

    Works under `jit` and `vmap`, in which the result of a failed simulation is NaN.

    **Arguments:**

    - `experiment`: the model with the values around which to linearise.
    - `scatter`: standard deviation of the logarithm of the speed after each impact [1].

    **Raises** `ValueError` as `fit` does, for a sensor without `sigma`, a negative `scatter`, and a
    motion that cannot be simulated.
    """
    told = informed_by(experiment, scatter)
    if is_known(told) and not np.isfinite(np.asarray(told.sensitivities)).all():
        reason = failure(build_problem(experiment))
        raise ValueError(f"The motion cannot be simulated: {reason}.")
    return told


def informed_by(experiment: Experiment, scatter: ArrayLike = 0.0) -> Information:
    """Variant of `information` that is NaN if the motion cannot be simulated."""
    check_kind("experiment", experiment, Experiment, "Experiment(model, planned(...), initial)")
    problem = build_problem(experiment)
    variance, values = known(problem.variance()), known(problem.start)
    if variance is None:
        raise ValueError(
            "Information before a measurement needs the size of the noise: state `sigma` of the "
            "sensor, as in `Sensor(sigma=0.001)`."
        )
    if has_scatter(problem, scatter):
        jacobian = _scattered(problem, values, variance, scatter)
    else:
        jacobian = _plain(problem, values)
    xp = namespace(jacobian, variance)
    jacobian = jacobian / xp.sqrt(variance)
    prior = xp.asarray(problem.prior_rows(values).slopes, jacobian.dtype)
    return informed(problem.handles(), values, xp.concatenate([jacobian, prior]))


def _plain(problem: Problem, values: Vector) -> Sensitivities:
    """The Jacobian of the observations."""
    own = problem.padded() if is_known(problem) else problem
    answer = answer_at(own, values)
    return _existing(answer.residuals, answer.jacobian)[: problem.valid.shape[-1]]


def _scattered(
    problem: Problem, values: Vector, variance: Float[AnyArray, ""], scatter: ArrayLike
) -> Sensitivities:
    """The Jacobian in units of scatter and noise together, times the size of the noise."""
    own, axes = problem.padded() if is_known(problem) else problem, straight(problem)
    most = own.impacts
    if is_known(problem) and not own.recording.observes_impacts:
        happen = int(answer_at(own, values, logged=True).impacts.count)
        most = min(padded_size(max(happen, 1)), most)
    nothing = namespace(values).zeros(most, values.dtype)
    point = around(own, axes.turned(values), nothing, evaluate)
    xp = namespace(point.jacobian, variance, scatter)
    ratio = xp.asarray(scatter, point.jacobian.dtype) ** 2 / variance
    white = whitened(point.jacobian / axes.slopes(axes.turned(values)), point.effects, ratio)
    return _existing(point.residuals, white)[: problem.valid.shape[-1]]


def _existing(residuals: Residuals, jacobian: Sensitivities | None) -> Sensitivities:
    """A Jacobian, NaN if a residual is: the derivatives of what was not simulated are zero."""
    assert jacobian is not None
    residuals, jacobian = known(residuals), known(jacobian)
    xp = namespace(residuals, jacobian)
    return xp.where(xp.all(xp.isfinite(residuals)), jacobian, xp.nan)
