"""Motion of a mechanism with contacts by SciPy's DOP853, restarted at every event and sample.

Written apart from the package, in NumPy. Guards are watched at nodes of the dense output of each
step, also around their least values between nodes; an event time found there is corrected by a
step that ends on it.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import root_scalar

from .mechanism_equations import Equations, Parameters, Vector

FREE, TOUCHING, DETACHED, RESTING = range(4)
NODES = np.linspace(0, 1, 6)
RTOL, ATOL = 1e-13, 1e-14
LONGEST_SUM = 1e-7  # [s], a chatter that lasts less is taken as rest at once
MOVED = 1e-9
MOST = 1000  # events


class Event(NamedTuple):
    """An event: `speed` is that of the gap before it [m/s]."""

    t: float
    contact: int
    before: int
    after: int
    speed: float


class Run(NamedTuple):
    """A run with its samples; `events` is None if there were too many."""

    events: list[Event] | None
    q: Vector
    v: Vector
    modes: Vector


class Simulation:
    """One mechanism with its parameters, laws and phases of contact."""

    def __init__(
        self,
        equations: Equations,
        p: Parameters,
        kinds: tuple[str, ...],
        laws: Vector,
        rtol: float = RTOL,
    ) -> None:
        self.equations, self.p, self.kinds, self.laws = equations, p, kinds, laws
        self.rtol = rtol
        self.n = equations.draw(np.random.default_rng(0))[1].size
        self.modes = [FREE] * len(kinds)

    def contacts(self, q: Vector, v: Vector) -> tuple[Vector, Vector, Vector, Vector, Vector]:
        """Gaps, their rates, normals, M⁻¹ nᵀ and n M⁻¹ nᵀ."""
        normals = self.equations.normals(self.p, q)
        columns = np.linalg.solve(self.equations.matrix(self.p, q), normals.T)
        return self.equations.gaps(self.p, q), normals @ v, normals, columns, normals @ columns

    def law_force(self, i: int, gap: float, rate: float, mass: float) -> float:
        """Force of a compliant contact."""
        a, b, n = self.laws[i]
        if self.kinds[i] == "hunt-crossley":
            return a * max(-gap, 0.0) ** n * (1 - b * rate)
        return mass * (a**2 * -gap - 2 * b * a * rate)

    def motion(self, y: Vector) -> tuple[Vector, Vector]:
        """Acceleration, and the force of each contact."""
        q, v = y[: self.n], y[self.n :]
        force, matrix = self.equations.force(self.p, q, v), self.equations.matrix(self.p, q)
        push = np.zeros(len(self.kinds))
        if all(mode == FREE for mode in self.modes):
            return np.linalg.solve(matrix, force), push
        normals = self.equations.normals(self.p, q)
        solved = np.linalg.solve(matrix, np.column_stack([normals.T, force]))
        columns, acceleration = solved[:, :-1], solved[:, -1]
        gap, rate, inverse = self.equations.gaps(self.p, q), normals @ v, normals @ columns
        for i, mode in enumerate(self.modes):
            if mode in (TOUCHING, DETACHED):
                push[i] = self.law_force(i, gap[i], rate[i], 1 / inverse[i, i])
            if mode == TOUCHING:
                acceleration = acceleration + push[i] * columns[:, i]
        rest = [i for i, mode in enumerate(self.modes) if mode == RESTING]
        if rest:
            bend = normals @ acceleration + self.equations.turning(self.p, q, v)
            push[rest] = np.linalg.solve(inverse[np.ix_(rest, rest)], -bend[rest])
            acceleration = acceleration + columns[:, rest] @ push[rest]
        return acceleration, push

    def rates(self, t: float, y: Vector) -> Vector:
        """Time derivative of the state."""
        return np.concatenate([y[self.n :], self.motion(y)[0]])

    def guards(self, y: Vector) -> Vector:
        """Two values for each contact: each falls through zero at its event."""
        gap, values = self.equations.gaps(self.p, y[: self.n]), np.ones(2 * len(self.kinds))
        forced = [
            mode == RESTING or (mode != FREE and kind == "at-zero-force")
            for kind, mode in zip(self.kinds, self.modes, strict=True)
        ]
        push = self.motion(y)[1] if any(forced) else gap
        for i, mode in enumerate(self.modes):
            values[2 * i] = gap[i] if mode == FREE else push[i] if mode == RESTING else -gap[i]
            if forced[i] and mode != RESTING:
                values[2 * i + 1] = push[i] if mode == TOUCHING else -push[i]
        return values

    def happened(self, which: int, t: float, y: Vector, events: list[Event]) -> Vector:
        """The state after an event, which is put into the log; modes are set."""
        i, second = divmod(which, 2)
        mode = self.modes[i]
        speed = float(self.contacts(y[: self.n], y[self.n :])[1][i])
        if mode == FREE and self.kinds[i] == "restitution":
            return self.impacts(i, t, y, events)
        if second:
            self.modes[i] = DETACHED if mode == TOUCHING else TOUCHING
        else:
            self.modes[i] = TOUCHING if mode == FREE else FREE
        events.append(Event(t, i, mode, self.modes[i], speed))
        return y

    def impacts(self, i: int, t: float, y: Vector, events: list[Event]) -> Vector:
        """Impact at a rigid contact, and those that follow from it at once."""
        q, v = y[: self.n], y[self.n :].copy()
        closed = {i}
        for _ in range(MOST):
            _, rate, normals, columns, inverse = self.contacts(q, v)
            change = -(1 + self.laws[i][0]) * rate[i] / inverse[i, i] * columns[:, i]
            moved = np.abs(normals @ change) > MOVED * abs(rate[i])
            for j, mode in enumerate(self.modes):
                if mode == RESTING and moved[j]:
                    self.modes[j] = FREE
                    closed.add(j)
            v = v + change
            v = self.rested(i, q, v)
            events.append(Event(t, i, FREE, self.modes[i], float(rate[i])))
            after = self.contacts(q, v)[1]
            meet = [j for j in sorted(closed) if self.modes[j] == FREE and after[j] < 0]
            if not meet:
                break
            i = meet[0]
        return np.concatenate([q, v])

    def rested(self, i: int, q: Vector, v: Vector) -> Vector:
        """Rates after an impact: those of rest if what is left of a chatter is short enough.

        Contacts that bounce beside this one, as in a pile, come to rest with it.
        """
        gap, rate, _, columns, inverse = self.contacts(q, v)
        modes = list(self.modes)
        most = LONGEST_SUM * np.maximum(np.abs(rate), abs(rate[i]))
        beside = [j for j, mode in enumerate(modes) if mode == FREE and gap[j] < most[j]]
        for j in {i, *beside}:
            self.modes[j] = RESTING
        rest = [j for j, mode in enumerate(self.modes) if mode == RESTING]
        still = v + columns[:, rest] @ np.linalg.solve(inverse[np.ix_(rest, rest)], -rate[rest])
        push = self.motion(np.concatenate([q, still]))[1]
        if all(
            self.kinds[j] == "restitution"
            and 2 * abs(rate[j]) <= LONGEST_SUM * push[j] * inverse[j, j] * (1 - self.laws[j][0])
            for j in {i, *beside}
        ):
            return still
        self.modes = modes
        return v

    def longest_step(self, y: Vector) -> float:
        """A quarter of the shortest flight that begins with a gap near zero."""
        gap, rate, *_ = self.contacts(y[: self.n], y[self.n :])
        bend = self.equations.normals(self.p, y[: self.n]) @ self.motion(y)[0]
        flight = np.inf
        for i, mode in enumerate(self.modes):
            if mode == FREE and abs(gap[i]) < 1e-9 and rate[i] > 0 and bend[i] < 0:
                flight = min(flight, -rate[i] / bend[i] / 2)
        return flight


def simulated(simulation: Simulation, q: Vector, v: Vector, times: Vector) -> Run:
    """The run from time zero."""
    t, y, events, rows, modes = 0.0, np.concatenate([q, v]), [], [], []
    armed = simulation.guards(y) > 0
    h = 1e-3
    for end in times:
        while t < end:
            first = min(h, simulation.longest_step(y), end - t)
            solver = DOP853(
                simulation.rates, t, y, end, first_step=first, rtol=simulation.rtol, atol=ATOL
            )
            while solver.status == "running":
                before = solver.t, solver.y.copy()
                solver.step()
                h = solver.t - before[0]
                found, armed = _watched(simulation, solver, before[0], armed)
                if found is not None:
                    which, guess = found
                    t, y = _landed(simulation, solver, before, which, guess)
                    modes_before = list(simulation.modes)
                    y = simulation.happened(which, t, y, events)
                    if len(events) > MOST:
                        return Run(None, y, y, y)
                    armed = _armed_after(simulation, armed, y, which, modes_before)
                    break
                t, y = solver.t, solver.y
        rows.append(y)
        modes.append(list(simulation.modes))
    states = np.array(rows)
    return Run(events, states[:, : simulation.n], states[:, simulation.n :], np.array(modes))


def _armed_after(
    simulation: Simulation, armed: Vector, y: Vector, which: int, modes_before: list[int]
) -> Vector:
    """Guards that are watched after an event: those of contacts whose mode it changed, or which
    had it, once they are positive.
    """
    values, fresh = simulation.guards(y), armed.copy()
    for i, mode in enumerate(modes_before):
        if i == which // 2 or mode != simulation.modes[i]:
            fresh[2 * i : 2 * i + 2] = values[2 * i : 2 * i + 2] > 1e-9
    return fresh


def _watched(
    simulation: Simulation, solver: DOP853, before: float, armed: Vector
) -> tuple[tuple[int, float] | None, Vector]:
    """The first event of a step with its time, and which guards are watched after it."""
    dense, t0, t1 = solver.dense_output(), before, solver.t
    at = t0 + NODES * (t1 - t0)
    values = np.array([simulation.guards(dense(s)) for s in at])
    best, left = None, armed.copy()
    for k in range(values.shape[1]):
        on, times, column = armed[k], at, values[:, k]
        inner = np.flatnonzero((column[1:-1] <= column[:-2]) & (column[1:-1] <= column[2:])) + 1
        for _ in range(2):
            if not inner.size or column.min() < 0 or column.min() > np.ptp(column):
                break
            i = inner[np.argmin(column[inner])]
            fine = np.linspace(times[i - 1], times[i + 1], 17)
            times, column = fine, np.array([simulation.guards(dense(s))[k] for s in fine])
            inner = np.array([min(max(int(np.argmin(column)), 1), 15)])
        if column.min() >= 0:
            times, column = at, values[:, k]
        for j in range(1, times.size):
            on = on or column[j - 1] > 0
            if on and column[j] < 0 and column[j - 1] >= 0:
                root = root_scalar(
                    lambda s, k=k: simulation.guards(dense(s))[k],
                    bracket=(times[j - 1], times[j]),
                    xtol=1e-15,
                ).root
                if best is None or root < best[1]:
                    best = k, root
                break
        left[k] = on or column[-1] > 0
    return best, left


def _landed(
    simulation: Simulation, solver: DOP853, before: tuple[float, Vector], which: int, guess: float
) -> tuple[float, Vector]:
    """Time and state of an event, by steps that end on it."""
    dense, (t0, begin) = solver.dense_output(), before
    width = 1e-3 * (solver.t - t0)
    slope = (
        simulation.guards(dense(guess + width))[which]
        - simulation.guards(dense(guess - width))[which]
    ) / (2 * width)
    t, y = guess, begin
    for _ in range(3):
        if t <= t0:
            return before
        own = DOP853(
            simulation.rates, t0, begin, t, first_step=t - t0, rtol=simulation.rtol, atol=ATOL
        )
        while own.status == "running":
            own.step()
        y = own.y
        change = -simulation.guards(y)[which] / slope if slope < 0 else 0.0
        if abs(change) < 1e-16 or abs(change) > width:
            break
        t += change
    return t, y
