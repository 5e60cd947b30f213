"""Solutions that owe nothing to the package: closed forms, and SciPy restarted at each event."""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import mpmath
import numpy as np
from scipy.integrate import solve_ivp

Flow = Callable[[float, np.ndarray], np.ndarray]


class Reference(NamedTuple):
    """Samples, and the times and speeds of impact."""

    position: np.ndarray
    velocity: np.ndarray
    impact_times: np.ndarray
    approach: np.ndarray
    separation: np.ndarray


def pendulum(omega_n: float, zeta: float = 0.0, friction: float = 0.0) -> Flow:
    """Free flight θ″ = −2 ζ ω_n θ′ − ω_n² sin θ − f sgn θ′."""

    def flow(t: float, y: np.ndarray) -> np.ndarray:
        viscous, rubbed = 2 * zeta * omega_n * y[1], friction * np.sign(y[1])
        return np.array([y[1], -viscous - omega_n**2 * np.sin(y[0]) - rubbed])

    return flow


def spring(omega_n: float, rest: float = 0.0) -> Flow:
    """Free flight x″ = −ω_n² (x − x_rest)."""
    return lambda t, y: np.array([y[1], -(omega_n**2) * (y[0] - rest)])


def ball(gravity: float = 9.80665) -> Flow:
    """Free flight x″ = −g."""
    return lambda t, y: np.array([y[1], -gravity])


def _until(flow: Flow, sign: int, t: float, y: np.ndarray, t1: float, max_step: float):
    """Dense solution until the place, times a sign, falls through zero, and where it does."""

    def reached(s: float, y: np.ndarray) -> float:
        return sign * y[0] + (s - t < 1e-9)  # the start itself does not count

    vars(reached).update(terminal=True, direction=-1)
    run = solve_ivp(
        flow,
        (t, t1),
        y,
        method="DOP853",
        rtol=1e-13,
        atol=1e-15,
        dense_output=True,
        max_step=max_step,
        events=reached,
    )
    if run.status != 1:
        return run.sol, t1, run.y[:, -1], False
    end = float(run.t_events[0][0])
    return run.sol, end, run.sol(end), True


def simulate_rigid(
    flow: Flow,
    y0: list[float],
    ts: np.ndarray,
    restitution: Callable[[float], float],
    max_step: float = 2e-3,
) -> Reference:
    """A stop at zero with a jump v⁺ = −r(|v⁻|) v⁻."""
    t, y = float(ts[0]), np.array(y0)
    out = np.zeros((2, len(ts)))
    times, approach, separation = [], [], []
    while True:
        sol, end, state, hit = _until(flow, 1, t, y, ts[-1], max_step)
        inside = (ts >= t) & (ts <= end if not hit else ts < end)
        if inside.any():
            out[:, inside] = sol(ts[inside])
        if not hit:
            break
        r = restitution(-state[1])
        times.append(end)
        approach.append(-state[1])
        separation.append(-r * state[1])
        t, y = end, np.array([0.0, -r * state[1]])
    return Reference(out[0], out[1], *map(np.array, (times, approach, separation)))


def simulate_compliant(
    free: Flow,
    contact: Flow,
    y0: list[float],
    ts: np.ndarray,
    max_step: float = 2e-3,
    contact_step: float = 5e-5,
) -> Reference:
    """A stop at zero with its own flow below it, left at zero again."""
    t, y, touching = float(ts[0]), np.array(y0), False
    out = np.zeros((2, len(ts)))
    times, approach, separation = [], [], []
    while True:
        sign, step = (-1, contact_step) if touching else (1, max_step)
        flow = contact if touching else free
        sol, end, state, hit = _until(flow, sign, t, y, ts[-1], step)
        inside = (ts >= t) & (ts <= end if not hit else ts < end)
        if inside.any():
            out[:, inside] = sol(ts[inside])
        if not hit:
            break
        if touching:
            separation.append(state[1])
        else:
            times.append(end)
            approach.append(-state[1])
        t, y, touching = end, np.array([0.0, state[1]]), not touching
    return Reference(out[0], out[1], *map(np.array, (times, approach, separation)))


def ball_position(height, gravity, r, t, impacts: int):
    """Height of a ball dropped from rest, at a time after so many impacts; mpmath numbers."""
    speed = mpmath.sqrt(2 * gravity * height)
    when = mpmath.sqrt(2 * height / gravity)
    for _ in range(impacts - 1):
        speed = r * speed
        when = when + 2 * speed / gravity
    if impacts == 0:
        return height - gravity * t**2 / 2
    speed = r * speed
    s = t - when
    return speed * s - gravity * s**2 / 2


def ball_impact_time(height, gravity, r, number: int):
    """Time of the impact with a number from 0 of a ball dropped from rest."""
    first = mpmath.sqrt(2 * height / gravity)
    return first * (1 + 2 * sum(r**k for k in range(1, number + 1)))


def derivative(function: Callable[..., Any], values: list[float], index: int) -> float:
    """∂f/∂x_index with 40 digits."""
    with mpmath.workdps(40):
        numbers = [mpmath.mpf(value) for value in values]

        def along(x):
            return function(*numbers[:index], x, *numbers[index + 1 :])

        return float(mpmath.diff(along, numbers[index]))


def richardson(function: Callable[[float], np.ndarray], x: float, h: float) -> np.ndarray:
    """f′(x) from central differences at h, h/2, h/4, h/8, extrapolated to order 8."""
    estimates = [
        (function(x + h / 2**k) - function(x - h / 2**k)) / (2 * h / 2**k) for k in range(4)
    ]
    for order in (4, 16, 64):
        estimates = [(order * b - a) / (order - 1) for a, b in itertools.pairwise(estimates)]
    return estimates[0]
