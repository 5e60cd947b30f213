"""Contact whose spring and dashpot follow different powers: at some length the errors of the two
cancel in the estimate of the first step.
"""

import jax
import jax.numpy as jnp
import numpy as np
from numpy.polynomial import Chebyshev
from scipy.integrate import solve_ivp

import impactjax as ij
from tiers import thorough

K, C, N, P, MASS, OMEGA, GAP = 8.34e4, 155.5, 1.5, 0.7635, 0.198, 4.16, 0.153
SLOWEST, FASTEST = 0.45, 0.55
GRADING = 12  # t = s^12: then δ^1.76 is smooth in s at the beginning


def restitution(speed: float) -> float:
    """DOP853 in a stretched time, up to zero force within the indentation."""

    def rates(s, y):
        depth, rate = max(y[0], 0.0), y[1]
        push = (K * depth**N + C * depth**P * rate) / MASS
        fall = -push - OMEGA**2 * (GAP + y[0])
        return np.array([rate, fall]) * GRADING * s ** (GRADING - 1)

    def force(_, y):
        return K * max(y[0], 0.0) ** (N - P) + C * y[1] if y[1] < 0 else 1.0

    force.terminal = True  # pyright: ignore[reportFunctionMemberAccess]  as SciPy asks
    end = 0.1 ** (1 / GRADING)
    y0, steps = [0.0, speed], end / 200
    run = solve_ivp(
        rates, (0, end), y0, "DOP853", events=force, rtol=1e-13, atol=1e-16, max_step=steps
    )
    return -run.y_events[0][0][1] / speed


@jax.jit
@jax.vmap
def simulated(speed):
    law = ij.PowerLaw(K, C, N, P, 1.0, separation=ij.AtZeroForce())
    model = ij.ImpactOscillator(ij.LinearOscillator(OMEGA, mass=MASS), ij.Stop(law, GAP))
    run = ij.simulate(model, ij.InitialState(-GAP, -speed), jnp.array([0.06]), t0=0.0)
    return run.impacts.restitution[0]


@thorough
def test_restitution_at_every_speed_of_many():
    exact = Chebyshev.interpolate(np.vectorize(restitution), 10, [SLOWEST, FASTEST])
    speeds = np.linspace(SLOWEST, FASTEST, 501)
    assert abs(exact(0.53) - restitution(0.53)) < 1e-11
    assert np.max(np.abs(simulated(speeds) - exact(speeds))) < 1e-7
