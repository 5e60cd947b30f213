"""The Taylor series as a solver of Diffrax's, against SciPy and closed forms."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactjax as ij


def lorenz(t, y, args):
    del t
    x, v, z = y
    sigma, rho, beta = args
    return jnp.stack([sigma * (v - x), x * (rho - z) - v, x * v - beta * z])


LORENZ = (10.0, 28.0, 8 / 3)
TIMES = jnp.linspace(0.0, 3.0, 31)


def solve(field, y0, args, times, tolerance=1e-11):
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(field),
        ij.Taylor(),
        times[0],
        times[-1],
        None,
        y0,
        args,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
    )
    assert solution.ys is not None
    return solution.ys


@jax.numpy_dtype_promotion("standard")
def test_taylor_solver_of_vector_field():
    ours = solve(lorenz, jnp.array([1.0, 1.0, 20.0]), LORENZ, TIMES)
    theirs = solve_ivp(
        lambda t, y: np.asarray(
            [10 * (y[1] - y[0]), y[0] * (28 - y[2]) - y[1], y[0] * y[1] - 8 / 3 * y[2]]
        ),
        (0.0, 3.0),
        [1.0, 1.0, 20.0],
        "DOP853",
        TIMES,
        rtol=1e-13,
        atol=1e-13,
    )
    np.testing.assert_allclose(ours, theirs.y.T, atol=2e-8)


@jax.numpy_dtype_promotion("standard")
def test_taylor_solver_of_pytree_state_and_derivative():
    """θ″ = −ω² θ + cos t with θ(0) = 1 has a closed form, also in ω."""

    def field(t, y, omega):
        angle, rate = y["angle"], y["rate"]
        return {"angle": rate, "rate": jnp.cos(t) - omega**2 * angle}

    def angle(omega):
        y0 = {"angle": jnp.asarray(1.0), "rate": jnp.asarray(0.0)}
        return solve(field, y0, omega, TIMES)["angle"]

    def exact(omega):
        steady = 1 / (omega**2 - 1)
        return (1 - steady) * jnp.cos(omega * TIMES) + steady * jnp.cos(TIMES)

    value, slope = angle(3.0), jax.jacrev(angle)(3.0)
    true, true_slope = jax.jvp(exact, (3.0,), (1.0,))
    np.testing.assert_allclose(value, true, atol=1e-10)
    np.testing.assert_allclose(slope, true_slope, atol=1e-8)


@jax.numpy_dtype_promotion("standard")
def test_taylor_solver_refuses_non_analytic_field():
    with pytest.raises(ij.NotAnalytic):
        solve(lambda t, y, args: -jnp.abs(y), jnp.asarray(1.0), None, TIMES[:3])
