"""Fits as functions that JAX differentiates and batches: a straight line, known in closed form."""

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from estimates import SMALL, TS, line
from tiers import thorough


def slope_and_level(values, ties=None):
    recording = ij.Recording(jnp.asarray(TS), values, ij.Displacement())
    model, initial = ij.ImpactOscillator(ij.FreeMass()), ij.InitialState(0.0)
    return ij.fit(
        ij.Experiment(model, recording, initial, simulation=SMALL, ties=ties or {})
    ).values


@thorough
def test_derivatives_of_line_fit_are_those_of_regression():
    values = jnp.asarray(line()[0])
    expected = np.linalg.pinv(np.stack([np.ones(31), TS - TS[0]], axis=1))
    slopes = jax.jacfwd(slope_and_level)
    np.testing.assert_allclose(jax.jit(slopes)(values), expected, atol=1e-7)
    both = jax.jit(jax.vmap(slopes))(jnp.stack([values, values + 0.1]))
    np.testing.assert_allclose(both, np.stack([expected, expected]), atol=1e-7)


@thorough
def test_tie_may_close_over_batched_value():
    """Through the origin of x = x₀ (1 + c t)."""
    values, t = line()[0], TS - TS[0]

    def level(c):
        return slope_and_level(jnp.asarray(values), {"x_dot0": lambda at: c * at["x0"]})[0]

    cs = np.array([1.0, 2.0, 3.0])
    expected = [values @ (1 + c * t) / np.sum((1 + c * t) ** 2) for c in cs]
    np.testing.assert_allclose(jax.vmap(level)(jnp.asarray(cs)), expected, rtol=1e-9)


def test_recording_may_be_constant_under_jit():
    recording = ij.Recording(jnp.asarray(TS), jnp.asarray(line()[0]), ij.Displacement())
    model = ij.ImpactOscillator(ij.FreeMass())

    @jax.jit
    def fitted(x0):
        return ij.fit(ij.Experiment(model, recording, ij.InitialState(x0), simulation=SMALL)).values

    expected = np.polynomial.polynomial.polyfit(TS - TS[0], line()[0], 1)
    np.testing.assert_allclose(fitted(0.1), expected, rtol=1e-9)
