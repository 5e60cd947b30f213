"""Diffrax as its documentation shows it: `diffeqsolve` ends at an event, a `lax.scan` restarts it.

The number of segments is fixed in advance; surplus ones are masked. XLA takes as many cores as the
process may use.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax as dfx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array

from . import reference, tasks
from .prepared import Prepared, Run, prepare

TOLERANCE = 1e-10
SEGMENTS = {tasks.RESTITUTION: 8, tasks.KELVIN_VOIGT: 15}
SLOPE_STRIDE = 50
RECORD_SEGMENTS = 190
# more samples than any segment of the record holds
WINDOW = 400


class _State(NamedTuple):
    """Where a segment starts: `side` is 1 in flight and −1 in contact."""

    t: Array
    x: Array
    v: Array
    side: Array


class _System(NamedTuple):
    """The arguments of the right side."""

    damping: Array
    stiffness: Array
    contact_damping: Array
    contact_stiffness: Array
    push: Array
    frequency: Array
    side: Array


def _system(law: str, values: Array, forcing: tasks.Forcing, side: Array) -> _System:
    omega_n, zeta = values[0], values[1]
    contact = (jnp.zeros(()), jnp.zeros(()))
    if law == tasks.KELVIN_VOIGT:
        contact = (2 * values[2] * values[3], values[3] ** 2)
    force = (jnp.asarray(forcing.ratio * forcing.frequency**2), jnp.asarray(forcing.frequency))
    return _System(2 * zeta * omega_n, omega_n**2, *contact, *force, side)


def _free(_t: Any, y: tuple[Array, Array], args: _System) -> tuple[Array, Array]:
    x, v = y
    flight = -args.damping * v - args.stiffness * jnp.sin(x)
    contact = -args.contact_damping * v - args.contact_stiffness * x
    return v, jnp.where(args.side > 0, flight, contact)


def _forced(t: Any, y: tuple[Array, Array], args: _System) -> tuple[Array, Array]:
    v, acceleration = _free(t, y, args)
    return v, acceleration + args.push * jnp.sin(args.frequency * t) * jnp.cos(y[0])


def _gap(t: Any, y: tuple[Array, Array], args: _System, **_kwargs: object) -> Array:
    del t
    return args.side * y[0]


def _restart(law: str, values: Array, state: _State) -> _State:
    zero = jnp.zeros_like(state.x)
    if law == tasks.RESTITUTION:
        return _State(state.t, zero, -values[2] * state.v, state.side)
    return _State(state.t, zero, state.v, -state.side)


class _Scene(NamedTuple):
    """What stays the same from segment to segment."""

    law: str
    forcing: tasks.Forcing
    end: float
    adjoint: dfx.AbstractAdjoint


def _segment(scene: _Scene, values: Array, state: _State, times: Array) -> tuple[_State, Array]:
    """From one event to the next: the state after it, and the angle at the times."""
    saved = dfx.SubSaveAt(ts=jnp.clip(times, state.t, scene.end))
    solution = dfx.diffeqsolve(
        dfx.ODETerm(_forced if scene.forcing.ratio else _free),
        dfx.Dopri8(),
        state.t,
        scene.end,
        jnp.where(state.side > 0, 1e-2, 3e-4),
        (state.x, state.v),
        _system(scene.law, values, scene.forcing, state.side),
        saveat=dfx.SaveAt(subs=[saved, dfx.SubSaveAt(t1=True)]),
        stepsize_controller=dfx.PIDController(rtol=TOLERANCE, atol=TOLERANCE),
        adjoint=scene.adjoint,
        event=dfx.Event(_gap, optx.Newton(1e-12, 1e-12), direction=False),
        max_steps=512,
    )
    assert solution.ts is not None
    assert solution.ys is not None
    samples, (x, v) = solution.ys[0][0], solution.ys[1]
    state = _State(solution.ts[1][-1], x[-1], v[-1], state.side)
    return _restart(scene.law, values, state), samples


def _start(values: Array) -> _State:
    one = jnp.ones(())
    return _State(0.0 * one, values[-1], 0.0 * one, one)


def simulator(law: str, adjoint: dfx.AbstractAdjoint | None = None) -> Callable[[Array], Array]:
    """Parameters to the samples of T1; each segment saves at all the times, as is simplest."""
    adjoint = dfx.RecursiveCheckpointAdjoint() if adjoint is None else adjoint
    scene = _Scene(law, tasks.NO_FORCING, tasks.DURATION, adjoint)
    times = jnp.asarray(tasks.TIMES)

    def simulate(values: Array) -> Array:
        def segment(carry: tuple[_State, Array], _: None) -> tuple[tuple[_State, Array], None]:
            state, out = carry
            new, samples = _segment(scene, values, state, times)
            taken = (times >= state.t) & (times <= new.t) & (state.t < scene.end)
            return (new, jnp.where(taken, samples, out)), None

        carry = (_start(values), jnp.zeros(times.size))
        return jax.lax.scan(segment, carry, None, SEGMENTS[law])[0][1]

    return simulate


def _record() -> Callable[[Array], Array]:
    """Parameters to the samples of T4; each segment saves in a window of times only."""
    scene = _Scene(
        *(tasks.KELVIN_VOIGT, tasks.RECORD_FORCING, tasks.RECORD_DURATION),
        dfx.RecursiveCheckpointAdjoint(),
    )
    padding = np.full(WINDOW, tasks.RECORD_DURATION)
    times = jnp.asarray(np.concatenate([tasks.RECORD_TIMES, padding]))

    def simulate(values: Array) -> Array:
        def segment(carry: tuple[_State, Array], _: None) -> tuple[tuple[_State, Array], None]:
            state, out = carry
            first = jnp.ceil(state.t * tasks.RATE).astype(int)
            window = jax.lax.dynamic_slice(times, (first,), (WINDOW,))
            new, samples = _segment(scene, values, state, window)
            old = jax.lax.dynamic_slice(out, (first,), (WINDOW,))
            samples = jnp.where((window <= new.t) & (state.t < scene.end), samples, old)
            return (new, jax.lax.dynamic_update_slice(out, samples, (first,))), None

        carry = (_start(values), jnp.zeros(times.size))
        out = jax.lax.scan(segment, carry, None, RECORD_SEGMENTS)[0][1]
        return out[: tasks.RECORD_TIMES.size]

    return simulate


def _ready(function: Callable[[Array], Array], values: np.ndarray) -> Run:
    """The compiled function of these values."""
    compiled, given = jax.jit(function), jnp.asarray(values)
    return lambda: np.asarray(compiled(given))


def _double(build: Callable[[], Run]) -> Callable[[], Run]:
    """Double precision is a global choice of JAX's user: here it is made."""

    def chosen() -> Run:
        jax.config.update("jax_enable_x64", True)
        return build()

    return chosen


def t1(law: str) -> Prepared:
    """One trajectory."""
    build = _double(lambda: _ready(simulator(law), tasks.parameters(law)))
    return prepare(build, f"naive scan of diffeqsolve, Dopri8, tol {TOLERANCE:g}")


def t2(law: str) -> Prepared:
    """A thousand trajectories."""
    lanes = tasks.drawn_parameters(law)
    build = _double(lambda: _ready(jax.vmap(simulator(law)), lanes))
    return prepare(build, f"naive scan, vmap, Dopri8, tol {TOLERANCE:g}", tasks.LANES)


def _slopes(law: str) -> Callable[[Array], Array]:
    derivative = jax.jacfwd(simulator(law, dfx.ForwardMode()))
    return lambda values: derivative(values).T


def t3(law: str) -> Prepared:
    """Derivatives of one trajectory."""
    build = _double(lambda: _ready(_slopes(law), tasks.parameters(law)))
    return prepare(build, f"naive scan, jacfwd, Dopri8, tol {TOLERANCE:g}")


def t3_batch(law: str) -> Prepared:
    """Derivatives of every fiftieth of the thousand trajectories."""
    lanes = tasks.drawn_parameters(law)[::SLOPE_STRIDE]
    build = _double(lambda: _ready(jax.vmap(_slopes(law)), lanes))
    how = f"naive scan, vmap of jacfwd over every 50th lane, Dopri8, tol {TOLERANCE:g}"
    return prepare(build, how, len(lanes), SLOPE_STRIDE)


def t4(law: str) -> Prepared:
    """The forced record."""
    build = _double(lambda: _ready(_record(), tasks.parameters(law)))
    how = f"scan of {RECORD_SEGMENTS} segments with windows of samples, Dopri8, tol {TOLERANCE:g}"
    return prepare(build, how)


def t5(law: str) -> Prepared:
    """The fit: Optimistix's Levenberg-Marquardt, all compiled."""
    start, record = tasks.FIT_START[law], reference.record(law)

    def build() -> Run:
        simulate, scale = simulator(law, dfx.ForwardMode()), jnp.asarray(start)
        solver = optx.LevenbergMarquardt(rtol=1e-8, atol=1e-8)

        def residual(scaled: Array, data: Array) -> Array:
            return simulate(jnp.append(scaled * scale, tasks.VALUES["theta0"])) - data

        def fit(data: Array) -> Array:
            ones = jnp.ones(scale.size)
            options = {"jac": "fwd"}
            return optx.least_squares(residual, solver, ones, data, options).value * scale

        return _ready(fit, record)

    return prepare(_double(build), f"naive scan, optimistix LM, Dopri8, tol {TOLERANCE:g}")
