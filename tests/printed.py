"""Formulas of Carter (2005) as printed, and the pendulum itself by SciPy."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

OMEGA_N, ZETA, LENGTH = 13.47, 0.0017, 0.071


def zero(function, low, high):
    return root_scalar(function, bracket=(low, high), xtol=1e-15).root


def case_1(t, theta0, omega=OMEGA_N, zeta=ZETA, lib=np):
    """Carter (2005), 2.30 and 2.31, as printed."""
    fading = lib.exp(-zeta * omega * t)
    argument = omega * t + theta0**2 / (32 * zeta) * (fading**2 - 1)
    return theta0 * fading * lib.cos(argument), -omega * theta0 * fading * lib.sin(argument)


def case_2(t, v, omega=OMEGA_N, zeta=ZETA, lib=np):
    """Carter (2005), 2.32 and 2.33, as printed."""
    fading = lib.exp(-zeta * omega * t)
    argument = omega * t + v**2 / (32 * zeta * omega**2) * (fading**2 - 1)
    return v / omega * fading * lib.sin(argument), v * fading * lib.cos(argument)


def general(t, a0, phi0):
    """Carter (2005), 2.27 and 2.29, as printed."""
    a = a0 * np.exp(-ZETA * OMEGA_N * t)
    argument = OMEGA_N * t + a**2 / (32 * ZETA) + phi0
    return a * np.cos(argument), -OMEGA_N * a * np.sin(argument)


def exact(state, t1=5.0, events=None, zeta=ZETA):
    """The pendulum itself."""

    def flow(t, y):
        return [y[1], -2 * zeta * OMEGA_N * y[1] - OMEGA_N**2 * math.sin(y[0])]

    return solve_ivp(
        flow, (0, t1), state, "DOP853", rtol=1e-13, atol=1e-15, dense_output=True, events=events
    )
