"""pydiffsol: a model in the language DiffSL, compiled; forward sensitivities through its resets.

Its only explicit method is tsit45, of order five. It has no batches: T2 is a loop. One core.
"""
# pyright: reportMissingImports=false

from collections.abc import Callable

import numpy as np
import pydiffsol
from scipy.optimize import least_squares

from . import reference, tasks
from .prepared import Prepared, Run, prepare

TOLERANCE = 1e-8
BATCH_TOLERANCE = 1e-9
TIGHT_TOLERANCE = 1e-10
SLOPE_STRIDE = 10

# a name in DiffSL has no underscore
FLIGHT = "(-2*zeta*omegan*v - omegan*omegan*sin(x))"
CONTACT = "(-2*gamma*omega0*v - omega0*omega0*x)"
MODELS = {
    tasks.RESTITUTION: f"""
in_i {{ omegan = 13, zeta = 0, r = 1, theta0 = 1 }}
u_i {{ x = theta0, v = 0 }}
F_i {{ v, {FLIGHT} }}
stop_i {{ x }}
reset_i {{ 0, -r*v }}
out_i {{ x }}
""",
    tasks.KELVIN_VOIGT: f"""
in_i {{ omegan = 13, zeta = 0, gamma = 0, omega0 = 700, theta0 = 1 }}
u_i {{ x = theta0, v = 0, free = 1 }}
F_i {{ v, free*{FLIGHT} + (1 - free)*{CONTACT}, 0 }}
stop_i {{ x }}
reset_i {{ 0, v, 1 - free }}
out_i {{ x }}
""",
}
DRIVEN = f"""
in_i {{ omegan = 13, zeta = 0, gamma = 0, omega0 = 700, theta0 = 1, push = 0, frequency = 1 }}
u_i {{ x = theta0, v = 0, free = 1 }}
F_i {{ v, free*{FLIGHT} + (1 - free)*{CONTACT} + push*sin(frequency*t)*cos(x), 0 }}
stop_i {{ x }}
reset_i {{ 0, v, 1 - free }}
out_i {{ x }}
"""


def _ode(code: str, tolerance: float) -> pydiffsol.Ode:
    ode = pydiffsol.Ode(code, ode_solver=pydiffsol.tsit45)
    ode.rtol = ode.atol = ode.sens_rtol = ode.sens_atol = tolerance
    return ode


def _slopes(ode: pydiffsol.Ode, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The samples and their derivatives (a row a parameter)."""
    solution = ode.solve_fwd_sens(values, tasks.TIMES)
    return solution.ys[0], np.array([rows[0] for rows in solution.sens])


def t1(law: str) -> Prepared:
    """One trajectory."""

    def build() -> Run:
        ode, values = _ode(MODELS[law], TOLERANCE), tasks.parameters(law)
        return lambda: ode.solve_dense(values, tasks.TIMES).ys[0]

    return prepare(build, f"tsit45, tol {TOLERANCE:g}")


def t2(law: str) -> Prepared:
    """A thousand trajectories."""

    def build() -> Run:
        ode, lanes = _ode(MODELS[law], BATCH_TOLERANCE), tasks.drawn_parameters(law)
        out = np.empty((tasks.LANES, tasks.TIMES.size))

        def run() -> np.ndarray:
            for samples, values in zip(out, lanes, strict=True):
                samples[:] = ode.solve_dense(values, tasks.TIMES).ys[0]
            return out

        return run

    return prepare(build, f"tsit45 loop, tol {BATCH_TOLERANCE:g}", tasks.LANES)


def t3(law: str) -> Prepared:
    """Derivatives of one trajectory."""

    def build() -> Run:
        ode, values = _ode(MODELS[law], TIGHT_TOLERANCE), tasks.parameters(law)
        return lambda: _slopes(ode, values)[1]

    return prepare(build, f"tsit45, forward sensitivities, tol {TIGHT_TOLERANCE:g}")


def t3_batch(law: str) -> Prepared:
    """Derivatives of every tenth of the thousand trajectories."""

    def build() -> Run:
        ode = _ode(MODELS[law], TIGHT_TOLERANCE)
        lanes = tasks.drawn_parameters(law)[::SLOPE_STRIDE]
        return lambda: np.array([_slopes(ode, values)[1] for values in lanes])

    how = f"tsit45 loop over every 10th lane, forward sensitivities, tol {TIGHT_TOLERANCE:g}"
    return prepare(build, how, tasks.LANES // SLOPE_STRIDE, SLOPE_STRIDE)


def _driven(tolerance: float) -> Callable[[tasks.Forcing, np.ndarray], np.ndarray]:
    ode, values = _ode(DRIVEN, tolerance), tasks.parameters(tasks.KELVIN_VOIGT)

    def simulate(forcing: tasks.Forcing, times: np.ndarray) -> np.ndarray:
        push = forcing.ratio * forcing.frequency**2
        return ode.solve_dense(np.append(values, (push, forcing.frequency)), times).ys[0]

    return simulate


def t4(_law: str) -> Prepared:
    """The forced record."""

    def build() -> Run:
        simulate = _driven(BATCH_TOLERANCE)
        return lambda: simulate(tasks.RECORD_FORCING, tasks.RECORD_TIMES)

    return prepare(build, f"tsit45, tol {BATCH_TOLERANCE:g}")


def t4_sweep(_law: str) -> Prepared:
    """The sweep of forcing frequencies."""
    forcings = [tasks.sweep_forcing(hertz) for hertz in tasks.SWEEP_FREQUENCIES]

    def build() -> Run:
        simulate = _driven(TIGHT_TOLERANCE)
        return lambda: np.array([simulate(f, tasks.sweep_times(f)) for f in forcings])

    return prepare(build, f"tsit45 loop, tol {TIGHT_TOLERANCE:g}", len(forcings))


def t5(law: str) -> Prepared:
    """The fit: Levenberg-Marquardt with forward sensitivities as Jacobian."""

    def build() -> Run:
        ode, record = _ode(MODELS[law], TOLERANCE), reference.record(law)
        last: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

        def at(fitted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """Residual and Jacobian at the same parameters come from one simulation."""
            key = fitted.tobytes()
            if key not in last:
                last.clear()
                last[key] = _slopes(ode, tasks.with_start_angle(fitted))
            return last[key]

        def run() -> np.ndarray:
            last.clear()
            return least_squares(
                lambda fitted: at(fitted)[0] - record,
                tasks.FIT_START[law],
                jac=lambda fitted: at(fitted)[1][:-1].T,  # pyright: ignore[reportArgumentType]
                method="lm",
                x_scale=tasks.FIT_START[law],
            ).x

        return run

    return prepare(build, f"least_squares lm, forward sensitivities, tol {TOLERANCE:g}")
