"""Dense output of a Runge-Kutta step: a polynomial through shorter steps from the same start.

The polynomial in the stage σ of the step, see `grading.py`, has the states and rates at some nodes,
each reached by a step of its own. It is as accurate as the method: with p nodes its degree is
2p − 1. Source: Shampine, SIAM J. Numer. Anal. 22, 1014 (1985).
"""

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float, PyTree

from impactjax._hybrid.path import or_zeros
from impactjax._series.polynomial import horner
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.stages import Begin, ends_of_steps
from impactjax._simulate.state import Mode, State
from impactjax._types import Scalar

if TYPE_CHECKING:
    import diffrax


class Expansion(NamedTuple):
    """Polynomial of a step.

    - `way`: coefficients c of the way from the start, σ Σ cₖ (2 σ − 1)ᵏ.
    - `h`: duration of the step [s]; 1 for a step without one.
    """

    begin: Begin
    way: State  # of arrays
    h: Scalar


def expanded(
    solver: "diffrax.AbstractERK", automaton: Automaton, mode: Mode, begin: Begin, h: Scalar
) -> Expansion:
    """The polynomial of a step of duration `h`."""
    t, y, grading = begin
    order = solver.order(None)  # pyright: ignore[reportArgumentType]  terms do not matter
    assert order is not None
    nodes = (1 - np.cos(np.linspace(0, np.pi, (order + 3) // 2))) / 2
    sigma = jnp.asarray(nodes, h.dtype)
    passed = h * jax.vmap(grading.share)(sigma)
    reached, _ = ends_of_steps(solver, automaton, mode, begin, passed[1:], jnp.zeros_like(h))
    states = jax.tree.map(lambda first, rest: jnp.append(first, rest), y, reached)

    def rates(sigma: Scalar, passed: Scalar, state: State) -> list[Scalar]:
        counts = grading.weight(sigma) > 0  # otherwise the slope of the force may be infinite
        state = jax.tree.map(lambda own, first: jnp.where(counts, own, first), state, y)
        return grading.stage(sigma, jax.tree.leaves(automaton.flow(t + passed, state, mode)))

    slopes = jax.tree.unflatten(jax.tree.structure(y), jax.vmap(rates)(sigma, passed, states))
    inverse = jnp.asarray(_inverse(nodes), h.dtype)

    def coefficients(first: Scalar, values: Array, slopes: Array) -> Array:
        data = jnp.concatenate([values[1:] - first, h * slopes])
        return inverse @ data

    way = jax.tree.map(coefficients, y, states, slopes)
    return Expansion(begin, way, jnp.where(h > 0, h, 1.0))


def _inverse(nodes: np.ndarray) -> Float[np.ndarray, "powers conditions"]:
    """The matrix that gives the coefficients c from the values of σ Σ cₖ (2 σ − 1)ᵏ at all nodes
    but the first, where σ = 0, and from the derivatives at all nodes.
    """
    powers = np.vander(2 * nodes - 1, 2 * nodes.size - 1, increasing=True)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = 2 * powers[:, :-1] * np.arange(1, powers.shape[1])
    values = nodes[:, None] * powers
    return np.linalg.inv(np.concatenate([values[1:], powers + nodes[:, None] * slopes]))


@jax.custom_jvp
def within(
    automaton: Automaton, mode: Mode, expansion: Expansion, s: Scalar, delay: Scalar
) -> State:
    """The state at the time `s − delay` after the start of a step, where the delay is zero and only
    its derivatives count.

    Its derivative by time is the flow: that of σ may be infinite.
    """
    del automaton, mode, delay
    (_, first, grading), way, h = expansion
    return _at(grading.sigma(s / h), first, way)


def _within_jvp(primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]) -> tuple[State, State]:
    automaton, mode, ((t, first, grading), way, h), s, delay = primals
    _, _, ((_, d_first, _), d_way, _), d_s, d_delay = tangents
    y = within(*primals)
    d_first = jax.tree.map(or_zeros, d_first, first)
    d_way = jax.tree.map(or_zeros, d_way, way)
    d_y = _at(grading.sigma((s - delay) / h), d_first, d_way)
    if isinstance(d_s, SymbolicZero) and isinstance(d_delay, SymbolicZero):
        return y, d_y
    d_time = or_zeros(d_s, s) - or_zeros(d_delay, delay)
    rate = automaton.flow(t + (s - delay), y, mode)
    return y, jax.tree.map(lambda change, dy: change + dy * d_time, d_y, rate)


within.defjvp(_within_jvp, symbolic_zeros=True)


def _at(sigma: Scalar, start: State, way: State) -> State:
    """The state at a stage of the step."""
    x = 2 * sigma - 1
    return jax.tree.map(lambda first, each: first + sigma * horner(list(each), x), start, way)
