"""The verb `synthetic`: experiment → the same with a simulated recording."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Key

from impactjax._fit.evaluation import answer_at
from impactjax._fit.linear_scatter import Effects
from impactjax._known import is_known
from impactjax._optimise.linearisation import Vector
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.failure import failure
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import Residuals
from impactjax._refusal import check_kind


def synthetic(
    experiment: Experiment, key: Key[Array, ""], *, scatter: ArrayLike = 0.0
) -> Experiment:
    """The experiment with a simulated recording: what its sensor shows of the motion at the values
    of its model, with independent normal noise of the sensor's `sigma` and `quantisation`.

    Works under `jit` and `vmap`.

    **Arguments:**

    - `experiment`: the experiment, whose recording may be a planned one.
    - `key`: random key of the noise.
    - `scatter`: standard deviation of the logarithm of the speed after each impact [1].

    **Raises** `ValueError` as `fit` does, for a sensor without `sigma`, a `scatter` that is not a
    number from 0 on or has no stop, and a motion that cannot be simulated.
    """
    check_kind("experiment", experiment, Experiment, "Experiment(model, planned(...), initial)")
    problem = build_problem(experiment)
    variance, start = problem.variance(), problem.start
    if variance is None:
        raise ValueError("A synthetic recording needs the size of its noise: state `sigma`.")
    has_scatter(problem, scatter)
    try:
        of_noise, of_scatter = jax.random.split(key)
    except TypeError as error:
        raise TypeError(
            f"Argument `key` must be a random key, such as `jax.random.key(0)`, but it is {key!r}."
        ) from error
    steps = jax.random.normal(of_scatter, (problem.impacts,), start.dtype)
    logs = jnp.asarray(scatter, start.dtype) * steps
    residuals = _residuals(problem, start, logs)
    if is_known(residuals) and not np.isfinite(np.asarray(residuals)).all():
        raise ValueError(f"The motion cannot be simulated: {failure(problem)}.")
    noise = jnp.sqrt(variance) * jax.random.normal(of_noise, residuals.shape, start.dtype)
    rows = jnp.where(problem.valid, residuals + noise, 0.0)
    return dataclasses.replace(experiment, recording=experiment.recording.shifted(-rows))


def has_scatter(problem: Problem, scatter: ArrayLike) -> bool:
    """True unless the size of the scatter from impact to impact is known to be zero.

    **Raises** `ValueError` for a size that is no number, negative or infinite, and for a model
    without a stop.
    """
    size = None
    if is_known(scatter):
        number = isinstance(scatter, int | float | np.ndarray | np.generic | jax.Array)
        size = float(np.asarray(scatter)) if number and np.shape(scatter) == () else math.nan
    if size is not None and not 0 <= size < math.inf:
        raise ValueError(f"Argument `scatter` must be a number from 0 on, but it is {scatter}.")
    if size != 0 and not problem.has_stop:
        raise ValueError("Scatter from impact to impact needs a stop, and the model has none.")
    return size != 0


def _residuals(problem: Problem, values: Vector, logs: Effects) -> Residuals:
    """The residuals with some logarithms of the factors after the impacts; if all numbers are
    known, by the program that a fit needs as well.
    """
    if not is_known((problem, values, logs)):
        return (problem.scattered(logs) if problem.has_stop else problem).residuals(values)
    longer = problem.padded()
    if problem.has_stop:
        longer = longer.scattered(jnp.pad(logs, (0, longer.impacts - logs.shape[0])))
    return answer_at(longer, values).residuals[: problem.valid.shape[-1]]
