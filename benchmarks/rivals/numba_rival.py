"""Numba: a DOP853 written by hand for this one pendulum, with tangents and saltation. One core.

Nothing here is reusable for another system: it shows what a scalar core can do. The tolerances are
about the largest that keep the samples within 1e-8 rad, and the derivatives within 1e-7 of their
largest value.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from . import numba_kernel, reference, tasks
from .dop853 import Plan
from .numba_fit import levenberg_marquardt
from .prepared import Prepared, Run, prepare

TOLERANCE = 2e-9
TANGENT_TOLERANCE = 3e-10
FORCED_TOLERANCE = 1e-9
SWEEP_TOLERANCE = 2e-10
SPACING = 1.0 / tasks.RATE


def _values(lanes: np.ndarray, plan: Plan, tolerance: float) -> Run:
    """The samples of each lane."""
    simulate = numba_kernel.batch_kernel(plan)
    out = np.empty((len(lanes), tasks.TIMES.size))
    unused, rows = np.empty((len(lanes), 0, 0)), numba_kernel.workspace(plan)

    def run() -> np.ndarray:
        simulate(lanes, 0.0, SPACING, tolerance, out, unused, rows)
        return out

    return run


def _derivatives(lanes: np.ndarray, plan: Plan, tolerance: float) -> Run:
    """The derivatives of the samples of each lane."""
    simulate = numba_kernel.batch_kernel(plan)
    out = np.empty((len(lanes), tasks.TIMES.size))
    derivatives = np.empty((len(lanes), plan.tangents, tasks.TIMES.size))
    rows = numba_kernel.workspace(plan)

    def run() -> np.ndarray:
        simulate(lanes, 0.0, SPACING, tolerance, out, derivatives, rows)
        return derivatives

    return run


def t1(law: str) -> Prepared:
    """One trajectory."""

    def build() -> Run:
        run = _values(tasks.parameters(law)[None], Plan(law), TOLERANCE)
        return lambda: run()[0]

    return prepare(build, f"DOP853, tol {TOLERANCE:g}")


def t2(law: str) -> Prepared:
    """A thousand trajectories."""

    def build() -> Run:
        return _values(tasks.drawn_parameters(law), Plan(law), TOLERANCE)

    return prepare(build, f"DOP853, scalar loop, tol {TOLERANCE:g}", tasks.LANES)


def _tangents(law: str) -> Plan:
    return Plan(law, tangents=len(tasks.NAMES[law]))


def t3(law: str) -> Prepared:
    """Derivatives of one trajectory."""

    def build() -> Run:
        run = _derivatives(tasks.parameters(law)[None], _tangents(law), TANGENT_TOLERANCE)
        return lambda: run()[0]

    return prepare(build, f"DOP853 with tangents and saltation by hand, tol {TANGENT_TOLERANCE:g}")


def t3_batch(law: str) -> Prepared:
    """Derivatives of a thousand trajectories."""

    def build() -> Run:
        return _derivatives(tasks.drawn_parameters(law), _tangents(law), TANGENT_TOLERANCE)

    how = f"DOP853 with tangents and saltation by hand, scalar loop, tol {TANGENT_TOLERANCE:g}"
    return prepare(build, how, tasks.LANES)


def _driven(tolerance: float) -> Callable[[tasks.Forcing, float, float, np.ndarray], None]:
    """Fills samples of the forced motion, from a first time in equal spacing."""
    plan, values = Plan(tasks.KELVIN_VOIGT, forced=True), tasks.parameters(tasks.KELVIN_VOIGT)
    simulate, rows = numba_kernel.kernel(plan), numba_kernel.workspace(plan)
    unused = np.empty((0, 0))

    def fill(forcing: tasks.Forcing, first: float, spacing: float, out: np.ndarray) -> None:
        grid = (first, spacing, tolerance)
        simulate(values, forcing.ratio, forcing.frequency, *grid, out, unused, rows)

    return fill


def t4(_law: str) -> Prepared:
    """The forced record."""

    def build() -> Run:
        fill, out = _driven(FORCED_TOLERANCE), np.empty(tasks.RECORD_TIMES.size)

        def run() -> np.ndarray:
            fill(tasks.RECORD_FORCING, 0.0, SPACING, out)
            return out

        return run

    return prepare(build, f"DOP853, tol {FORCED_TOLERANCE:g}")


def t4_sweep(_law: str) -> Prepared:
    """The sweep of forcing frequencies."""
    forcings = [tasks.sweep_forcing(hertz) for hertz in tasks.SWEEP_FREQUENCIES]

    def build() -> Run:
        fill, out = _driven(SWEEP_TOLERANCE), np.empty((len(forcings), tasks.SWEEP_KEPT))

        def run() -> np.ndarray:
            for forcing, samples in zip(forcings, out, strict=True):
                times = tasks.sweep_times(forcing)
                fill(forcing, times[0], times[1] - times[0], samples)
            return out

        return run

    return prepare(build, f"DOP853, scalar loop, tol {SWEEP_TOLERANCE:g}", len(forcings))


def t5(law: str) -> Prepared:
    """The fit: SciPy's Levenberg-Marquardt with the tangents as Jacobian."""

    def build() -> Run:
        simulate, record = numba_kernel.kernel(_tangents(law)), reference.record(law)
        rows = numba_kernel.workspace(_tangents(law))
        out, jacobian = np.empty(record.size), np.empty((len(tasks.NAMES[law]), record.size))
        last: list[bytes] = [b""]

        def update(fitted: np.ndarray) -> None:
            """Residual and Jacobian at the same parameters come from one simulation."""
            if last[0] != fitted.tobytes():
                last[0] = fitted.tobytes()
                values = tasks.with_start_angle(fitted)
                simulate(values, 0.0, 1.0, 0.0, SPACING, TOLERANCE, out, jacobian, rows)

        def residual(fitted: np.ndarray) -> np.ndarray:
            update(fitted)
            return out - record

        def slope(fitted: np.ndarray) -> np.ndarray:
            update(fitted)
            return jacobian[:-1].T

        def run() -> np.ndarray:
            last[0] = b""
            start = tasks.FIT_START[law]
            return least_squares(
                residual,
                start,
                jac=slope,  # pyright: ignore[reportArgumentType]
                method="lm",
                x_scale=start,
            ).x

        return run

    return prepare(build, f"least_squares lm, Jacobian by tangents, tol {TOLERANCE:g}")


def t5_compiled(law: str) -> Prepared:
    """The fit with the optimiser compiled, too."""

    def build() -> Run:
        fit, record = levenberg_marquardt(_tangents(law)), reference.record(law)
        return lambda: fit(tasks.FIT_START[law], tasks.VALUES["theta0"], record, TOLERANCE)

    return prepare(build, f"own compiled Levenberg-Marquardt, tol {TOLERANCE:g}")
