"""Analytic operations: an operation without a recurrence gets no Taylor step."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._series.taylor import solution_series
from tiers import quick

pytestmark = quick


class Own(ij.AbstractMemorylessLaw):
    """A spring with any force."""

    kind: str = eqx.field(static=True, default="")
    separation: ij.AbstractSeparation = ij.AtZeroPenetration()

    def force(self, penetration, rate, internal, mass):
        del rate, internal, mass
        return FORCES[self.kind](penetration)


FORCES = {
    "stairs": lambda x: 0.1 * (x / 1e-4).astype(jnp.int32).astype(x.dtype),
    "rounded": lambda x: 1e3 * x.astype(jnp.float32).astype(x.dtype),
    "a switch": lambda x: jnp.where(x > 1e-3, 2e3 * x, 1e3 * x),
    "a condition": lambda x: 1e3 * (x > 1e-3).astype(x.dtype),
    "floor": lambda x: 0.1 * jnp.floor(x / 1e-4),
    "a modulus": lambda x: 1e3 * jnp.abs(x),
    "a maximum": lambda x: jnp.maximum(1e3 * x, 0.0),
    "a loop": lambda x: jax.lax.fori_loop(0, 3, lambda _, y: y + 300 * x, 0 * x),
    "a look-up": lambda x: jnp.interp(x, jnp.array([0.0, 1.0]), jnp.array([0.0, 1e3])),
    "reduced precision": lambda x: 1e3 * jax.lax.reduce_precision(x, 8, 7),
}


@pytest.mark.parametrize("kind", FORCES)
def test_unknown_primitives_get_no_taylor_step(kind):
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(Own(kind)))
    with pytest.raises(ValueError, match="equations of motion"):
        ij.simulate(model, ij.InitialState(0.1), np.array([0.2]), t0=0.0, step=ij.TaylorStep())


def test_conversion_to_wider_float_is_analytic():
    def field(t, y):
        del t
        return [-jax.lax.convert_element_type(y, jnp.float64)]

    t, start, unit = jnp.asarray(0.0), jnp.asarray(1.0), jnp.asarray(1.0)
    (series,), _ = solution_series(field, t, [start], 6, unit)
    np.testing.assert_allclose(series, [(-1) ** k / math.factorial(k) for k in range(7)])
