"""The verb `learn`: gradient descent through the simulator, for laws with many weights."""

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from impactjax._fit.learned import Learned, Numbers, Task, Where, no_weights, places
from impactjax._optimise.gradient_descent import History, begin, step
from impactjax._problem.abstract_problem import Answer
from impactjax._problem.build_problem import pose
from impactjax._problem.checks import check_declared
from impactjax._problem.experiment import Experiment
from impactjax._refusal import check_kind
from impactjax._types import Flag, Scalar

if TYPE_CHECKING:
    import optax

Axes = Float[Array, "numbers numbers"]

_NEAR = 0.1  # distance to the minimum, in standard errors, that counts as convergence


@cache  # one object, so that programs with it are compiled once
def _lbfgs() -> "optax.GradientTransformation":
    import optax

    return optax.lbfgs(linesearch=optax.scale_by_backtracking_linesearch(max_backtracking_steps=20))


def learn(
    experiment: Experiment,
    *,
    where: Where = no_weights,
    optimiser: "optax.GradientTransformation | None" = None,
    steps: int = 20,
    rounds: int = 50,
    progress: Callable[[str], None] | None = None,
) -> Learned:
    """Gradient descent with Optax for the difference of a simulated and a recorded motion.

    It fits arrays of weights, such as those of `LearnedRestitution` or of a law of your own,
    together with the parameters that `fit` would fit. Gradients are exact through every impact: by
    forward mode for few numbers, by reverse mode for many. The search starts from the values in
    `model`, `initial` and `sensor`: use those of a named law that was fitted. Without `where` it
    is a first-order alternative to `fit`.

    The search consists of rounds. In each round the optimiser starts afresh with a scaled problem:
    the cost is divided by its value at the start p of the round, and a point is
    p + (H + |g|)^(−1/2) z, with the Gauss-Newton Hessian H and the gradient g at p, so that the
    curvature in z is about one. One learning rate therefore suits all problems: 0.1 for
    `optax.adam`.

    Works under `jit` and `vmap`, over experiments, without `progress`.

    **Arguments:**

    - `experiment`: as for `fit`; `restitution_band` uses its `noise`.
    - `where`: function from a system, which has `model`, `initial` and `sensor`, to the arrays to
      fit: `lambda system: system.model.lower.law.weights`; no arrays by default.
    - `optimiser`: any Optax optimiser that needs only value and gradient, or a line search;
      `optax.lbfgs` by default. Reuse the object, since a new one is compiled again.
    - `steps`: most steps of a round; it ends earlier when the cost has stopped changing.
    - `rounds`: most rounds; the search ends earlier when it has converged.
    - `progress`: function called with a line of text after every round.

    **Raises** `ValueError` for what `fit` refuses, for an experiment with scatter, for a `where`
    that picks a parameter with a name, and for `steps` or `rounds` below one. A search that does
    not converge says so in what it returns.
    """
    for name, count in (("steps", steps), ("rounds", rounds)):
        if count < 1:
            raise ValueError(f"Argument `{name}` must be at least 1, but it is {count}.")
    check_kind("experiment", experiment, Experiment, "Experiment(model, recording, initial)")
    if experiment.priors:
        raise ValueError("`learn` minimises the residuals only: leave out `priors`.")
    if experiment.scatter is not None and experiment.scatter.scatters:
        raise ValueError("`learn` finds a law without scatter: leave out `scatter`.")
    problem = pose(experiment)
    task = Task(problem, places(problem.system, where))
    check_declared(problem.system, task.places)
    by, search = optimiser or _lbfgs(), _first(task, rounds * steps)
    for end in (rounds,) if progress is None else range(rounds + 1):
        search = _search(task, by, steps, rounds, jnp.asarray(end), search)
        if progress is not None:
            rms = float(_rms(task, search.slopes.answer))
            progress(f"{end} of {rounds} rounds, rms residual {rms:.4g}")
            if bool(search.converged):
                break
    return _learned(task, search)


class _Slopes(eqx.Module):
    """The cost around a point: its gradient g, and H + |g| with the Gauss-Newton Hessian H.

    The |g| on the diagonal limits the Newton step of each number to about one. A weight that drifts
    to infinity, where it no longer matters, then does not prevent convergence.
    """

    answer: Answer
    cost: Scalar
    gradient: Numbers
    curvature: Axes

    def expected_gain(self) -> Scalar:
        """Expected decrease of the cost by a step: gᵀ (H + |g|)⁻¹ g / 2."""
        return self.gradient @ jnp.linalg.solve(self.curvature, self.gradient) / 2

    def unit(self) -> Scalar:
        """The cost, if it is positive and finite; else 1."""
        return jnp.where(jnp.isfinite(self.cost) & (self.cost > 0), self.cost, 1.0)

    def axes(self) -> Axes:
        """(H + |g|)^(−1/2) for the cost divided by `unit`; the identity if that is not finite."""
        sizes, vectors = jnp.linalg.eigh(self.curvature / self.unit())
        axes = vectors / jnp.sqrt(sizes)
        return jnp.where(jnp.all(jnp.isfinite(axes)), axes, jnp.eye(sizes.size))


def _slopes(task: Task, numbers: Numbers) -> _Slopes:
    answer = task.answer(numbers)
    loss, residuals, jacobian = task.problem.loss, answer.residuals, answer.jacobian
    assert jacobian is not None
    weighted = loss.weight(residuals)[:, None] * jacobian
    gradient, curvature = weighted.T @ residuals, weighted.T @ jacobian
    least = jnp.finfo(numbers.dtype).eps * jnp.trace(curvature)
    bounds = jnp.abs(gradient) + jnp.where(least > 0, least, 1.0)
    cost = jnp.sum(loss.cost(residuals))
    return _Slopes(answer, cost, gradient, curvature + jnp.diag(bounds))


class _Search(NamedTuple):
    """State between rounds."""

    numbers: Numbers
    slopes: _Slopes  # at the start of the last round
    looks: Int[Array, ""]  # number of rounds begun
    converged: Flag
    history: History


@eqx.filter_jit
def _first(task: Task, most: int) -> _Search:
    start, none = task.start(), jnp.zeros((), jnp.int32)
    shapes = jax.eval_shape(_slopes, task, start)
    unseen = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
    history = History(jnp.full(most, jnp.nan, start.dtype), none, none)
    return _Search(start, unseen, none, jnp.zeros((), bool), history)


@eqx.filter_jit
def _search(
    task: Task,
    optimiser: "optax.GradientTransformation",
    steps: int,
    rounds: int,
    end: Int[Array, ""],
    search: _Search,
) -> _Search:
    """Continues until the point after `end` rounds is evaluated, or the search has converged."""

    def go_on(now: _Search) -> _Search:
        slopes = _slopes(task, now.numbers)
        n = task.problem.recording.observations.astype(slopes.cost.dtype)
        converged = slopes.expected_gain() <= _NEAR**2 * slopes.cost / n
        axes, unit = slopes.axes(), slopes.unit()

        def cost(z: Numbers) -> Scalar:
            return task.cost(now.numbers + axes @ z) / unit

        stops = now.history.iterations + jnp.where(converged | (now.looks == rounds), 0, steps)
        descent = jax.lax.while_loop(
            lambda each: ~each.over & (each.history.iterations < stops),
            lambda each: step(optimiser, cost, each),
            begin(optimiser, jnp.zeros_like(now.numbers), unit, now.history),
        )
        return _Search(
            numbers=now.numbers + axes @ descent.best,
            slopes=slopes,
            looks=now.looks + 1,
            converged=converged,
            history=descent.history,
        )

    return jax.lax.while_loop(lambda now: ~now.converged & (now.looks <= end), go_on, search)


@eqx.filter_jit
def _learned(task: Task, search: _Search) -> Learned:
    answer, history = search.slopes.answer, search.history
    assert answer.jacobian is not None
    return Learned(
        task=task,
        numbers=search.numbers,
        costs=history.costs,
        iterations=history.iterations,
        refused=history.refused,
        converged=search.converged,
        residuals=answer.residuals,
        jacobian=answer.jacobian,
        impacts=answer.impacts,
        rms=_rms(task, answer),
    )


def _rms(task: Task, answer: Answer) -> Scalar:
    squares = jnp.sum(answer.residuals**2)
    n = task.problem.recording.observations.astype(squares.dtype)
    return jnp.where(jnp.isfinite(squares), jnp.sqrt(squares / n), jnp.inf)
