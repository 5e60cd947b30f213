"""Dense output of a Runge-Kutta step: a polynomial through shorter steps from the same start.

The polynomial in the stage σ of the step, see `grading.py`, has the states and rates at some nodes,
each reached by a step of its own. It is as accurate as the method: with p nodes its degree is
2p − 1. Source: Shampine, Math. Comp. 46, 135 (1986).
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
from impactjax._simulate.grading import Grading
from impactjax._simulate.stages import ends_of_steps
from impactjax._simulate.state import Mode, State
from impactjax._types import Scalar

if TYPE_CHECKING:
    import diffrax


class Expansion(NamedTuple):
    """Polynomial of a step.

    - `t`, `y`: its start.
    - `grading`: of its stages.
    - `way`: coefficients c of the way from the start, σ Σ cₖ (2 σ − 1)ᵏ.
    - `h`: its duration [s]; 1 for a step without one.
    """

    t: Scalar
    y: State
    grading: Grading
    way: State  # of arrays
    h: Scalar


def expanded(
    solver: "diffrax.AbstractERK",
    automaton: Automaton,
    t: Scalar,
    y: State,
    mode: Mode,
    grading: Grading,
    h: Scalar,
) -> Expansion:
    """The polynomial of a step of duration `h`."""
    order = solver.order(None)  # pyright: ignore[reportArgumentType]  terms do not matter
    assert order is not None
    nodes = (1 - np.cos(np.linspace(0, np.pi, (order + 3) // 2))) / 2
    unit = jnp.where(h > 0, h, 1.0)
    sigma = jnp.asarray(nodes, h.dtype)
    passed = h * jax.vmap(grading.share)(sigma)
    reached, _ = ends_of_steps(
        solver, automaton, t, y, mode, grading, passed[1:], jnp.zeros_like(h)
    )
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

    return Expansion(t, y, grading, jax.tree.map(coefficients, y, states, slopes), unit)


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
    return _at(expansion.grading.sigma(s / expansion.h), expansion.y, expansion.way)


def _within_jvp(primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]) -> tuple[State, State]:
    automaton, mode, expansion, s, delay = primals
    _, _, d_expansion, d_s, d_delay = tangents
    y = within(*primals)
    d_first = jax.tree.map(or_zeros, d_expansion.y, expansion.y)
    d_way = jax.tree.map(or_zeros, d_expansion.way, expansion.way)
    d_y = _at(expansion.grading.sigma((s - delay) / expansion.h), d_first, d_way)
    if isinstance(d_s, SymbolicZero) and isinstance(d_delay, SymbolicZero):
        return y, d_y
    d_time = or_zeros(d_s, s) - or_zeros(d_delay, delay)
    rate = automaton.flow(expansion.t + (s - delay), y, mode)
    return y, jax.tree.map(lambda change, dy: change + dy * d_time, d_y, rate)


within.defjvp(_within_jvp, symbolic_zeros=True)


def _at(sigma: Scalar, start: State, way: State) -> State:
    x = 2 * sigma - 1
    return jax.tree.map(lambda first, each: first + sigma * horner(list(each), x), start, way)
