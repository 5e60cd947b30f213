"""A pendulum against a stop on a base that moves anyhow, by SciPy."""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

OMEGA, ZETA, LENGTH, R, START = 13.4, 0.01, 0.25, 0.62, 0.5


def motion(
    acceleration: Callable[[float], float], ts: np.ndarray, knots: np.ndarray, accuracy: float
) -> tuple[np.ndarray, int]:
    """Angles after a release at `START` by DOP853, begun anew at each impact and each knot, and the
    number of impacts.
    """

    def rates(t: float, y: np.ndarray) -> list[float]:
        push = -acceleration(t) / LENGTH * np.cos(y[0])
        return [y[1], push - 2 * ZETA * OMEGA * y[1] - OMEGA**2 * np.sin(y[0])]

    def touches(_: float, y: np.ndarray) -> float:
        return y[0]

    vars(touches).update(terminal=True, direction=-1)
    settings = {"rtol": accuracy, "atol": accuracy / 100, "events": touches, "dense_output": True}
    t, y, found, impacts = ts[0], np.array([START, 0.0]), np.zeros_like(ts), 0
    while t < ts[-1] - 1e-12:
        end = knots[np.searchsorted(knots, t + 1e-12, side="right")]
        part = solve_ivp(rates, (t, end), y, "DOP853", **settings)
        within = (ts >= t) & (ts <= part.t[-1])
        if within.any():
            found[within] = part.sol(ts[within])[0]
        t, y = part.t[-1], part.y[:, -1]
        if part.status == 1:
            impacts, y = impacts + 1, np.array([0.0, -R * y[1]])
    return found, impacts
