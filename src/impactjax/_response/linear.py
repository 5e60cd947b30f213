"""Linearised equations of an orbit, with multipliers and tangents."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float

from impactjax._hybrid.equations import NO_EVENT
from impactjax._response.equations import Arcs, Family, Itinerary, Pieces, pieces_of
from impactjax._results import RESULTS

Vector = Float[np.ndarray, " unknowns"]  # the last one is the parameter
Values = Float[np.ndarray, " equations"]
Matrix = Float[np.ndarray, "rows columns"]


class Cycle(NamedTuple):
    """A kind of orbit: what stays the same along a branch.

    - `multiple`: number of periods of the force.
    - `phase`: start of an orbit without events, or of one whose period is unknown.
    """

    family: Family
    itinerary: Itinerary
    multiple: int
    phase: float

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.itinerary.event)

    @property
    def has_events(self) -> bool:
        """True unless the orbit is a single flow."""
        return bool(self.itinerary.event[0] != NO_EVENT)

    @property
    def is_free(self) -> bool:
        """True if the period is an unknown."""
        return self.family.rhythm.is_free()

    def packed(self, arcs: Arcs, parameter: float) -> Vector:
        """All unknowns in one row: (t, y, d) of each segment, then the parameter."""
        rows = np.concatenate([arcs.t[:, None], arcs.y, arcs.d[:, None]], axis=1)
        return np.append(rows.ravel(), parameter)

    def arcs(self, unknowns: Vector) -> Arcs:
        """The segments of a row of unknowns."""
        rows = unknowns[:-1].reshape(self.segments, -1)
        return Arcs(rows[:, 0], rows[:, 1:-1], rows[:, -1])


class Linear(NamedTuple):
    """Equations of an orbit near some values of its unknowns.

    - `residual`: their values, three kinds for each segment: time, state, condition.
    - `inner`, `wrap`: derivatives by times, states and durations. `wrap` holds those by the segment
      that follows the last one, so that disturbances that are multiplied by μ in a period solve
      (inner + μ wrap) δ = 0.
    - `by_parameter`: derivative by the parameter.
    - `pieces`, `period`: what they were made of.
    """

    cycle: Cycle
    unknowns: Vector
    residual: Values
    inner: Matrix
    wrap: Matrix
    by_parameter: Values
    pieces: Pieces
    period: float

    def jacobian(self) -> Matrix:
        """Derivatives by all unknowns."""
        return np.column_stack([self.inner + self.wrap, self.by_parameter])

    def row_sizes(self, sizes: Vector) -> Values:
        """Size of each equation: that of what it compares; of a condition, its change with all."""
        rows = sizes[:-1].reshape(self.cycle.segments, -1).copy()
        rows[:, -1] = np.sum(np.abs(self.pieces.slopes[:, -1, :-1]) * rows, axis=1)
        return np.where(rows > 0, rows, 1.0).ravel()

    def monodromy(self) -> Matrix:
        """Derivative of the state after a period by the state, both at the time of the start."""
        slopes, rate = self.pieces.slopes, self.pieces.rate[0]
        size = rate.size
        change = np.vstack([np.zeros(size), np.eye(size)])  # of time and state
        with np.errstate(divide="ignore", invalid="ignore"):  # it is infinite where an orbit grazes
            for own in slopes:
                condition = own[-1]
                by_start = -(condition[: size + 1] @ change) / condition[size + 1]
                change = own[:-1, : size + 1] @ change + np.outer(own[:-1, size + 1], by_start)
            return change[1:] - np.outer(rate, change[0])

    def multipliers(self) -> Complex[np.ndarray, " numbers"]:
        """Eigenvalues of the monodromy matrix, the largest first; NaN where it is infinite."""
        return _largest_first(np.append(self.transverse(), np.ones(int(self.cycle.is_free))))

    def transverse(self) -> Complex[np.ndarray, " directions"]:
        """The multipliers without that of a shift in time, which is 1 if the period is unknown.

        The monodromy matrix takes the rate to itself; the others are those of its part across it.
        """
        matrix = self.monodromy()
        if self.cycle.is_free:
            across = np.linalg.svd(self.pieces.rate[:1])[2][1:]
            matrix = across @ matrix @ across.T
        if not np.all(np.isfinite(matrix)):
            return np.full(len(matrix), complex(np.nan))
        return _largest_first(np.linalg.eigvals(matrix).astype(complex))

    def largest(self) -> float:
        """The largest size of a multiplier, without that of a shift in time."""
        return float(np.max(np.abs(self.transverse()), initial=0.0))

    def following(self) -> Cycle:
        """The kind of orbit for those near this one."""
        family, arcs = self.cycle.family, self.cycle.arcs(self.unknowns)
        rhythm = family.rhythm.near(arcs.y[0], self.pieces.rate[0])
        return self.cycle._replace(family=eqx.tree_at(lambda each: each.rhythm, family, rhythm))


def _largest_first(
    multipliers: Complex[np.ndarray, " numbers"],
) -> Complex[np.ndarray, " numbers"]:
    return multipliers[np.argsort(-np.abs(multipliers), kind="stable")]


def linearised(cycle: Cycle, unknowns: Vector) -> Linear:
    """The equations of an orbit and all their derivatives."""
    arcs, count = cycle.arcs(unknowns), cycle.segments
    following = jax.tree.map(lambda leaf: np.roll(leaf, -1, axis=0), cycle.itinerary.mode)
    padded = 1 << (count - 1).bit_length()  # few programs serve all lengths
    rows = np.minimum(np.arange(padded), count - 1)
    data = jax.tree.map(lambda leaf: jnp.asarray(leaf[rows]), (cycle.itinerary, following, arcs))
    numbers = jnp.asarray([unknowns[-1], cycle.multiple, count])
    with np.errstate(all="ignore"):
        found = jax.device_get(pieces_of(cycle.family, *data, *numbers))
        pieces, period, slope = found
        pieces = jax.tree.map(lambda leaf: leaf[:count], pieces)
        return _assembled(cycle, unknowns, pieces, float(period), float(slope))


def _assembled(
    cycle: Cycle, unknowns: Vector, pieces: Pieces, period: float, slope: float
) -> Linear:
    arcs, count = cycle.arcs(unknowns), cycle.segments
    width = arcs.y.shape[1] + 2
    residual = pieces.after.copy()
    inner = np.zeros((count, width, count, width))
    wrap = np.zeros_like(inner)
    by_parameter = pieces.slopes[:, :, -1].copy()
    link = -np.eye(width)
    link[-1, -1] = 0.0  # the condition is of the segment alone
    starts = np.column_stack([arcs.t, arcs.y])
    for number in range(count):
        inner[number, :, number] += pieces.slopes[number, :, :-1]
        last = number + 1 == count
        following = 0 if last else number + 1
        (wrap if last else inner)[number, :, following] += link
        residual[number, :-1] -= starts[following]
    residual[-1, 0] -= period
    by_parameter[-1, 0] -= slope
    if cycle.is_free or not cycle.has_events:  # durations make up the period, and time is free
        residual[-1, 0] = arcs.t[0] - cycle.phase
        inner[-1, 0], wrap[-1, 0], by_parameter[-1, 0] = 0.0, 0.0, 0.0
        inner[-1, 0, 0, 0] = 1.0
    square = count * width, count * width
    return Linear(
        cycle,
        unknowns,
        residual.ravel(),
        inner.reshape(square),
        wrap.reshape(square),
        by_parameter.ravel(),
        pieces,
        period,
    )


def failure(linear: Linear) -> RESULTS | None:
    """The failure of a segment's flow, if there is one."""
    for number in range(linear.cycle.segments):
        own = jax.tree.map(lambda leaf, n=number: jnp.asarray(leaf[n]), linear.pieces.result)
        if own != RESULTS.successful:
            return own
    return None
