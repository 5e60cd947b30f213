"""Damped Newton's method for the equations of an orbit and one more linear equation."""

from typing import NamedTuple

import numpy as np

from impactjax._response.linear import Cycle, Linear, Vector, linearised

_ITERATIONS = 40
_SMALL = 1e-8  # a step after which the equations are solved to rounding: the next is its square
_LEAST_FACTOR = 1 / 128
_ROUNDING = 1e-10  # size of a state, relative to its response to others, that counts as zero
_DURATION_LEFT = 0.1  # least share of a duration that a step leaves


class Constraint(NamedTuple):
    """The equation row · (unknowns / sizes) = value, which fixes a point of a branch."""

    row: Vector
    value: float


class Found(NamedTuple):
    """Outcome of Newton's method.

    - `linear`: the equations at the last values.
    - `converged`: true if they are solved.
    - `steps`: number of steps.
    """

    linear: Linear
    converged: bool
    steps: int


def sizes_of(linear: Linear, parameter: float) -> Vector:
    """A size of each unknown: the period for times, the largest value on the orbit for a state (or
    that of its rate in a radian of the force), and `parameter` for the parameter.

    A state whose values are zero to rounding at all events, as that of a grazing, has the size of
    its response to changes of the other states, and of the start by a radian.
    """
    pieces, arcs = linear.pieces, linear.cycle.arcs(linear.unknowns)
    radian = linear.period / (2 * np.pi * linear.cycle.multiple)
    values = [np.abs(arcs.y), np.abs(pieces.before), np.abs(pieces.rate) * radian]
    state = np.max(np.concatenate(values), axis=0)
    slopes = np.abs(pieces.slopes[:, 1 : 1 + state.size, : 1 + state.size])
    response = np.nan_to_num(np.max(slopes @ np.append(radian, state), axis=0), posinf=0.0)
    state = np.where(state > _ROUNDING * response, state, response)
    state = np.where(state > 0, state, 1.0)
    row = np.concatenate([[linear.period], state, [linear.period]])
    return np.append(np.tile(row, linear.cycle.segments), parameter)


def fixed_parameter(unknowns: Vector, sizes: Vector) -> Constraint:
    """The equation that keeps the parameter."""
    row = np.zeros_like(unknowns)
    row[-1] = 1.0
    return Constraint(row, unknowns[-1] / sizes[-1])


def solved(linear: Linear, sizes: Vector, constraint: Constraint) -> Found:
    """Newton's method from the equations at some values.

    A step is damped until the next simplified step is shorter, the natural monotonicity test of
    P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3.
    """
    for count in range(_ITERATIONS):
        matrix = _matrix(linear, sizes, constraint)
        if not np.all(np.isfinite(matrix)):
            return Found(linear, False, count)
        step = _step(matrix, linear, sizes, constraint)
        size = _size(step)
        if not np.isfinite(size):
            return Found(linear, False, count)
        if size < _SMALL:
            final = linearised(linear.cycle, linear.unknowns + sizes * step)
            return Found(final, bool(np.all(np.isfinite(final.residual))), count + 1)
        factor = _longest(linear.cycle, linear.unknowns, sizes * step)
        while True:
            trial = linearised(linear.cycle, linear.unknowns + factor * sizes * step)
            next_size = _size(_step(matrix, trial, sizes, constraint))
            if next_size <= (1 - factor / 2) * size:
                break
            factor /= 2
            if factor < _LEAST_FACTOR:
                return Found(linear, False, count)
        linear = trial
    return Found(linear, False, _ITERATIONS)


def _matrix(linear: Linear, sizes: Vector, constraint: Constraint) -> np.ndarray:
    return np.vstack([linear.jacobian() * sizes, constraint.row])


def _step(matrix: np.ndarray, linear: Linear, sizes: Vector, constraint: Constraint) -> Vector:
    """The step of the scaled unknowns; infinite if there is none."""
    own = constraint.row @ (linear.unknowns / sizes) - constraint.value
    residual = np.append(linear.residual, own)
    if not np.all(np.isfinite(residual)):
        return np.full_like(residual, np.inf)
    try:
        return -np.linalg.solve(matrix, residual)
    except np.linalg.LinAlgError:
        return np.full_like(residual, np.inf)


def _size(step: Vector) -> float:
    return float(np.max(np.abs(step)))


def _longest(cycle: Cycle, unknowns: Vector, step: Vector) -> float:
    """The largest share of a step that leaves all durations positive, at most 1."""
    durations, changes = cycle.arcs(unknowns).d, cycle.arcs(step).d
    shrinks = (durations > 0) & (changes < 0)
    shares = (1 - _DURATION_LEFT) * durations[shrinks] / -changes[shrinks]
    return float(min(1.0, np.min(shares, initial=1.0)))
