"""The thesis's pendulum against a Kelvin-Voigt contact at 1 Hz, event by event with SciPy."""

import numpy as np
from scipy.integrate import solve_ivp


def longest_contact(amplitude, r0, alpha, begin=20.0, end=25.0):
    """Duration of the longest contact after a time at 1 Hz, event by event [s]."""
    omega, omega0, length = 6.28, 725.0, 0.071

    def flight(t, y):
        push = amplitude / length * omega**2 * np.cos(omega * t)
        swing = -2 * 0.0017 * 13.47 * y[1] - 13.47**2 * np.sin(y[0])
        return np.array([y[1], swing + push * np.cos(y[0])])

    def surface(t, y, gamma):
        return y[0]

    surface.terminal = True  # pyright: ignore[reportFunctionMemberAccess]  as SciPy asks

    def flow(t, y, gamma):
        held = 0.0 if gamma is None else omega0**2 * y[0] + 2 * gamma * omega0 * y[1]
        return flight(t, y) - np.array([0.0, held])

    t, y, gamma, durations = 0.0, np.array([0.2, 0.0]), None, []
    while t < end:
        start = y + 1e-9 * flow(t, y, gamma)  # off the surface
        run = solve_ivp(
            *(flow, (t + 1e-9, end), start, "DOP853"),
            args=(gamma,),
            events=surface,
            rtol=1e-10,
            atol=1e-14,
        )
        ended, y = run.t[-1], np.array([0.0, run.y[1, -1]])
        if gamma is None:
            loss = np.log(r0 + alpha * length * y[1])
            gamma = -loss / np.hypot(np.pi, loss)
        else:
            durations.append(ended - t if t > begin else 0.0)
            gamma = None
        t = ended
    return max(durations)
