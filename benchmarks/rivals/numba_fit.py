"""Levenberg-Marquardt compiled together with the simulation: about the least a fit can cost."""
# pyright: reportMissingImports=false

from collections.abc import Callable

import numpy as np
from numba import njit

from . import numba_kernel, tasks
from .dop853 import Plan

STEPS = 50
# SciPy's default: stop when the sum of squares or the estimate changes relatively by less
CHANGE = 1e-8
Array = np.ndarray


def levenberg_marquardt(plan: Plan) -> Callable[[Array, float, Array, float], Array]:
    """The compiled fit: start, start angle, record and tolerance to the estimate."""
    simulate, size, spacing = numba_kernel.kernel(plan), plan.tangents, 1.0 / tasks.RATE
    space = numba_kernel.workspace(plan).size

    @njit
    def normal(
        values: Array,
        record: Array,
        tolerance: float,
        out: Array,
        slopes: Array,
        rows: Array,
        matrix: Array,
        right: Array,
    ) -> float:
        """Simulates; fills the normal equations and returns the sum of squares."""
        simulate(values, 0.0, 1.0, 0.0, spacing, tolerance, out, slopes, rows)
        residual = out - record
        for i in range(size - 1):
            right[i] = np.dot(slopes[i], residual)
            for j in range(i + 1):
                matrix[i, j] = np.dot(slopes[i], slopes[j])
                matrix[j, i] = matrix[i, j]
        return np.dot(residual, residual)

    @njit
    def fit(start: Array, angle: float, record: Array, tolerance: float) -> Array:
        count = size - 1
        out, slopes = np.empty(record.size), np.empty((size, record.size))
        rows, trial = np.zeros(space), np.empty(size)
        matrix, right = np.empty((count, count)), np.empty(count)
        new_matrix, new_right = np.empty((count, count)), np.empty(count)
        trial[:count], trial[count] = start, angle
        best, damping = start.copy(), 1e-3
        square = normal(trial, record, tolerance, out, slopes, rows, matrix, right)
        for _ in range(STEPS):
            damped = matrix.copy()
            for i in range(count):
                damped[i, i] *= 1.0 + damping
            step = np.linalg.solve(damped, right)
            trial[:count] = best - step
            new = normal(trial, record, tolerance, out, slopes, rows, new_matrix, new_right)
            gain = square - new
            if gain >= 0.0:
                best[:], matrix[:], right[:] = trial[:count], new_matrix, new_right
                square, damping = new, damping * 0.1
            else:
                damping *= 10.0
            if abs(gain) < CHANGE * square or np.all(np.abs(step) < CHANGE * np.abs(best)):
                break
        return best

    return fit
