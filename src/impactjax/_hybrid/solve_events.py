"""The verb `solve_events`: a differential equation with events, in the words of Diffrax."""

import inspect
import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Int, PyTree

from impactjax._hybrid.equations import choose
from impactjax._hybrid.event_log import EventLog
from impactjax._hybrid.explicit_step import ExplicitStep
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.reset import AbstractReset, Guard
from impactjax._hybrid.solve import solve_run
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import HybridSystem, Mode, State, Transition
from impactjax._refusal import check_kind
from impactjax._results import RESULTS
from impactjax._types import Samples, Scalar

if TYPE_CHECKING:
    import diffrax


class EventSolution(eqx.Module):
    """A solution with events.

    - `ts`, `ys`: as asked for in `saveat`, which may be a tree of outputs.
    - `terms`: number of the term that holds at each time, in the same tree.
    - `events`: the event log; `transition` is the number of the event in the argument `events`.
    - `final`: where the run has stopped, to go on from by the argument `start`.
    - `result`: result code.
    - `stats`: number of steps.
    """

    ts: PyTree
    ys: PyTree
    terms: PyTree
    events: EventLog
    final: Start
    result: RESULTS
    stats: dict[str, Int[Array, "..."]]


def solve_events(
    terms: "diffrax.ODETerm[Any] | Sequence[diffrax.ODETerm[Any]]",
    solver: "diffrax.AbstractERK | AbstractMethod",
    t0: ArrayLike,
    t1: ArrayLike,
    y0: State | None,
    args: PyTree = None,
    *,
    events: Sequence[AbstractReset],
    saveat: "diffrax.SaveAt | None" = None,
    term: int = 0,
    start: Start | None = None,
    tolerance: ArrayLike | None = None,
    scale: State | None = None,
    max_steps: int = 4096,
    max_events: int = 64,
) -> EventSolution:
    """Solves an ordinary differential equation with events that change the state and the run goes
    on.

    The earliest of several events happens first, however long the step. Times and states of events
    have exact derivatives, in forward and reverse mode.

    **Arguments:**

    - `terms`: an `ODETerm`, or several of which one holds at a time.
    - `solver`: an explicit Runge-Kutta method of Diffrax, such as `diffrax.Tsit5()`; or a
      `TaylorStep`, for analytic vector fields.
    - `t0`, `t1`: start and end, t0 < t1.
    - `y0`, `args`: as for `diffrax.diffeqsolve`; derivatives go through both.
    - `events`: `Reset` and `ResetAt` objects.
    - `saveat`: a `diffrax.SaveAt` with `t0`, `t1`, `ts`, `fn` or `subs`; the end by default. At an
      event, values are those after it. If an event ends the run, `t1` asks for the state there.
    - `term`: number of the term that holds at first.
    - `start`: the `final` of another solution, where the run goes on; `y0` is then `None`, and
      `t0` and `term` do not count.
    - `tolerance`, `scale`, `max_steps`, `max_events`: as for `solve`.

    **Raises** `ValueError` for a `saveat` with `steps` or `dense`, an unknown term, a function that
    holds a traced value instead of getting it by `args`, and as `solve` does; `TypeError` for
    arguments of the wrong type.
    """
    import diffrax

    several = (terms,) if isinstance(terms, diffrax.ODETerm) else tuple(terms)
    wanted = diffrax.SaveAt(t1=True) if saveat is None else saveat
    _check(several, events, term, wanted)
    if (y0 is None) == (start is None):
        raise ValueError("Give either `y0` or, with `None` for it, `start`.")
    begin, end = jnp.asarray(t0, float), jnp.asarray(t1, float)
    subs, structure = jax.tree.flatten(wanted.subs, is_leaf=_is_sub)
    times = [_times(each, begin, end) for each in subs]
    joined = jnp.concatenate([*times, end[None]])
    order = jnp.argsort(joined)
    counts = tuple(event.passed(begin) for event in events)
    origin = begin if start is None else jnp.asarray(start.t)
    own = tuple(event.since(origin) for event in events)
    solved = solve_run(
        _Terms(several, own, args),
        Start(begin, y0, (term, counts)) if start is None else start,
        joined[order],
        tolerance=tolerance,
        scale=scale,
        max_steps=max_steps,
        max_events=max_events,
        method=_method(solver),
    )
    place = jnp.argsort(order)
    sampled = joined, *jax.tree.map(lambda column: column[place], (solved.ys, solved.modes[0]))
    ends = np.cumsum([0, *[each.size for each in times]])
    pieces = [
        _piece(sub, slice(a, b), sampled, solved.final)
        for sub, (a, b) in zip(subs, itertools.pairwise(ends), strict=True)
    ]
    saved = [
        jax.vmap(lambda t, y, fn=sub.fn: fn(t, y, args))(ts, ys)
        for sub, (ts, ys, _) in zip(subs, pieces, strict=True)
    ]
    numbers = np.array([*_numbers(events), -1])  # the last for unused rows
    return EventSolution(
        jax.tree.unflatten(structure, [ts for ts, _, _ in pieces]),
        jax.tree.unflatten(structure, saved),
        jax.tree.unflatten(structure, [own for _, _, own in pieces]),
        eqx.tree_at(
            lambda log: log.transition,
            solved.events,
            jnp.asarray(numbers)[solved.events.transition],
        ),
        solved.final,
        solved.result,
        {"num_steps": solved.steps},
    )


class _Terms(HybridSystem):
    """Terms of Diffrax with events. The mode holds the number of the term, and for each event how
    often it has happened.
    """

    terms: "tuple[diffrax.ODETerm[Any], ...]"
    events: tuple[AbstractReset, ...]
    args: PyTree

    def flow(self, t: Scalar, y: State, mode: Mode) -> State:
        rates = self.terms[0].vf(t, y, self.args)
        for number, each in enumerate(self.terms[1:], start=1):
            rates = choose(mode[0] == number, each.vf(t, y, self.args), rates)
        return rates

    def transitions(self) -> Sequence[Transition]:
        return [
            _transition(number, event, guard, self.args)
            for number, event in enumerate(self.events)
            for guard in event.guards()
        ]


class _Explicit(AbstractMethod):
    """An explicit Runge-Kutta method of Diffrax."""

    solver: "diffrax.AbstractERK" = eqx.field(static=True)

    def of_flows(self) -> AbstractFlowStep:
        return ExplicitStep(self.solver)


def _method(solver: "diffrax.AbstractERK | AbstractMethod") -> AbstractMethod:
    import diffrax

    if isinstance(solver, AbstractMethod):
        return solver
    if not isinstance(solver, diffrax.AbstractERK):
        raise TypeError(
            "Argument `solver` must be an explicit Runge-Kutta method with an embedded error "
            f"estimate, such as `diffrax.Tsit5()`, or a `TaylorStep`, but it is {solver}."
        )
    return _Explicit(solver)


def _transition(number: int, event: AbstractReset, own: Guard, args: PyTree) -> Transition:
    def guard(t: Scalar, y: State, mode: Mode) -> ArrayLike:
        term, counts = mode
        return jnp.where(event.applies(term), own(t, y, args, counts[number]), 1.0)

    reset = event.jump()
    if reset is None:
        return Transition(guard)

    def jump(t: Scalar, y: State, mode: Mode) -> tuple[State, Mode]:
        term, counts = mode
        counted = [*counts[:number], counts[number] + 1, *counts[number + 1 :]]
        return reset(t, y, args), (event.following(term), tuple(counted))

    return Transition(guard, jump)


def _numbers(events: Sequence[AbstractReset]) -> list[int]:
    """The number of the event of each transition."""
    return [number for number, event in enumerate(events) for _ in event.guards()]


def _times(sub: "diffrax.SubSaveAt", t0: Scalar, t1: Scalar) -> Samples:
    """The times of an output, in the order of Diffrax."""
    parts = [t0[None]] if sub.t0 else []
    parts += [] if sub.ts is None else [jnp.asarray(sub.ts, t0.dtype)]
    parts += [t1[None]] if sub.t1 else []
    return jnp.concatenate(parts)


def _piece(
    sub: "diffrax.SubSaveAt", part: slice, sampled: tuple[Array, State, Array], final: Start
) -> tuple[Array, State, Array]:
    """Times, states and terms of an output; with the end of a run that an event has ended as its
    last row, if it asks for `t1`.
    """
    rows = jax.tree.map(lambda column: column[part], sampled)
    if not sub.t1 or final.memory is None:
        return rows
    ended, end = final.memory.ended, (final.t, final.y, final.mode[0])
    return jax.tree.map(
        lambda column, last: jnp.concatenate(
            [column[:-1], jnp.where(ended, last, column[-1])[None]]
        ),
        rows,
        end,
    )


def _is_sub(node: object) -> bool:
    import diffrax

    return isinstance(node, diffrax.SubSaveAt)


def _check(
    terms: "Sequence[diffrax.ODETerm[Any]]",
    events: Sequence[AbstractReset],
    term: int,
    saveat: "diffrax.SaveAt",
) -> None:
    """Checks the arguments of `solve_events`."""
    import diffrax

    for each in terms:
        check_kind("terms", each, diffrax.ODETerm, "diffrax.ODETerm(vector_field)")
    if isinstance(events, AbstractReset):
        raise TypeError("Argument `events` must be a list of events.")
    for event in events:
        check_kind("events", event, AbstractReset, "Reset(cond_fn, reset)")
        event.check(len(terms))
    for function in filter(inspect.isfunction, jax.tree.leaves((terms, events))):
        held = [cell.cell_contents for cell in function.__closure__ or ()]
        if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(held)):
            raise ValueError(
                f"`{function.__name__}` uses a traced value from outside: give it by `args`."
            )
    check_kind("saveat", saveat, diffrax.SaveAt, "diffrax.SaveAt(ts=ts)")
    subs = jax.tree.leaves(saveat.subs, is_leaf=_is_sub)
    if saveat.dense or any(each.steps for each in subs):
        raise ValueError("Argument `saveat` must not ask for `steps` or `dense`: give `ts`.")
    own = saveat.solver_state, saveat.controller_state, saveat.made_jump
    if any(own):
        raise ValueError("Argument `saveat` must not ask for states of the solver.")
    if not 0 <= term < len(terms):
        raise ValueError(
            f"Argument `term` must number one of {len(terms)} terms, but it is {term}."
        )
