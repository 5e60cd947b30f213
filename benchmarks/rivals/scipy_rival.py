"""SciPy: `solve_ivp` with DOP853 and a terminal event, restarted at each impact. One core."""

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from . import reference, tasks
from .prepared import Prepared, prepare

RTOL, ATOL = 1e-9, 1e-10
STEP = 1e-6
BATCH_STRIDE, SWEEP_STRIDE = 50, 20
Field = Callable[[float, np.ndarray], tuple[float, float]]


def _leaving(_t: float, y: np.ndarray) -> float:
    return y[0]


def _returning(_t: float, y: np.ndarray) -> float:
    return y[0]


# solve_ivp reads these attributes of an event; the direction keeps it from firing at its own start
_leaving.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
_leaving.direction = -1.0  # pyright: ignore[reportFunctionMemberAccess]
_returning.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
_returning.direction = 1.0  # pyright: ignore[reportFunctionMemberAccess]


def _fields(law: str, values: np.ndarray, forcing: tasks.Forcing) -> tuple[Field, Field | None]:
    """The right sides of flight and, where there is one, contact."""
    named = dict(zip(tasks.NAMES[law], values.tolist(), strict=True))
    omega_n = named["omega_n"]
    damping, stiffness = 2.0 * named["zeta"] * omega_n, omega_n**2
    frequency, push = forcing.frequency, forcing.ratio * forcing.frequency**2

    def force(t: float, x: float) -> float:
        return push * math.sin(frequency * t) * math.cos(x) if push else 0.0

    def flight(t: float, y: np.ndarray) -> tuple[float, float]:
        x, v = y
        return v, -damping * v - stiffness * math.sin(x) + force(t, x)

    if law == tasks.RESTITUTION:
        return flight, None
    contact_damping = 2.0 * named["gamma"] * named["omega0"]
    contact_stiffness = named["omega0"] ** 2

    def contact(t: float, y: np.ndarray) -> tuple[float, float]:
        x, v = y
        return v, -contact_damping * v - contact_stiffness * x + force(t, x)

    return flight, contact


def simulate(
    law: str, values: np.ndarray, times: np.ndarray, forcing: tasks.Forcing = tasks.NO_FORCING
) -> np.ndarray:
    """The samples at the given times."""
    flight, contact = _fields(law, values, forcing)
    out = np.empty(times.size)
    t, end, done, free = 0.0, float(times[-1]), 0, True
    state = (float(values[-1]), 0.0)
    while done < times.size:
        field = flight if free or contact is None else contact
        event = _leaving if free else _returning
        solution = solve_ivp(
            *(field, (t, end), state, "DOP853", times[done:]), events=event, rtol=RTOL, atol=ATOL
        )
        samples = solution.y[0] if len(solution.t) else np.empty(0)
        out[done : done + samples.size] = samples
        done += samples.size
        if solution.status != 1:
            break
        t, rate = float(solution.t_events[0][0]), float(solution.y_events[0][0][1])
        state = (0.0, -values[2] * rate if contact is None else rate)
        free = contact is None or not free
    return out


def t1(law: str) -> Prepared:
    """One trajectory."""
    values = tasks.parameters(law)
    how = f"DOP853, rtol {RTOL:g}, atol {ATOL:g}"
    return prepare(lambda: lambda: simulate(law, values, tasks.TIMES), how)


def t2(law: str) -> Prepared:
    """Twenty of the thousand trajectories."""
    lanes = tasks.drawn_parameters(law)[::BATCH_STRIDE]

    def run() -> np.ndarray:
        return np.array([simulate(law, values, tasks.TIMES) for values in lanes])

    how = f"DOP853 loop over every 50th lane, rtol {RTOL:g}, atol {ATOL:g}"
    return prepare(lambda: run, how, len(lanes), BATCH_STRIDE)


def t3(law: str) -> Prepared:
    """Derivatives by central differences."""
    nominal = tasks.parameters(law)

    def run() -> np.ndarray:
        rows = []
        for i, value in enumerate(nominal):
            step = np.zeros(nominal.size)
            step[i] = STEP * max(value, 0.1)
            up = simulate(law, nominal + step, tasks.TIMES)
            rows.append((up - simulate(law, nominal - step, tasks.TIMES)) / (2 * step[i]))
        return np.array(rows)

    return prepare(lambda: run, f"central differences, step {STEP:g}, rtol {RTOL:g}")


def t4(_law: str) -> Prepared:
    """The forced record."""
    values = tasks.parameters(tasks.KELVIN_VOIGT)

    def run() -> np.ndarray:
        return simulate(tasks.KELVIN_VOIGT, values, tasks.RECORD_TIMES, tasks.RECORD_FORCING)

    return prepare(lambda: run, f"DOP853, rtol {RTOL:g}, atol {ATOL:g}")


def t4_sweep(_law: str) -> Prepared:
    """Ten of the two hundred frequencies."""
    values = tasks.parameters(tasks.KELVIN_VOIGT)
    forcings = [tasks.sweep_forcing(hertz) for hertz in tasks.SWEEP_FREQUENCIES[::SWEEP_STRIDE]]

    def run() -> np.ndarray:
        return np.array(
            [
                simulate(tasks.KELVIN_VOIGT, values, tasks.sweep_times(forcing), forcing)
                for forcing in forcings
            ]
        )

    how = f"DOP853 loop over every 20th frequency, rtol {RTOL:g}, atol {ATOL:g}"
    return prepare(lambda: run, how, len(forcings), SWEEP_STRIDE)


def t5(law: str) -> Prepared:
    """The fit as most write it: finite differences by `least_squares` itself."""
    record, start = reference.record(law), tasks.FIT_START[law]

    def residual(fitted: np.ndarray) -> np.ndarray:
        return simulate(law, tasks.with_start_angle(fitted), tasks.TIMES) - record

    def run() -> np.ndarray:
        return least_squares(residual, start, jac="2-point", x_scale=start).x

    return prepare(lambda: run, f"least_squares trf, 2-point differences, rtol {RTOL:g}")
