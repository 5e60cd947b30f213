"""A restitution that is learned: what it can be, where it starts, and what leaves it alone."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array
from scipy.interpolate import BSpline

import impactjax as ij
from impactjax._problem.parameters import handles
from impactjax._sensor.system import Start, System
from impactjax._simulate.default_step import natural_step
from tiers import mostly_thorough, thorough

SPEEDS = np.array([0.1, 0.3, 0.7, 1.5, 3.0])


def test_learned_restitution_consists_of_integrated_hats():
    """The hats are SciPy's B-splines of degree one, divided by their area."""
    weights = np.random.default_rng(1).standard_normal(7)
    shares = np.exp(weights) / np.sum(np.exp(weights))
    knots = np.concatenate([SPEEDS[:1], SPEEDS, SPEEDS[-1:]])
    rate = np.zeros(5)
    for k in range(5):
        hat = BSpline(knots, np.eye(5)[k], 1)
        rate[k] = shares[k + 1] / float(hat.integrate(SPEEDS[0], SPEEDS[-1]))
    law = ij.LearnedRestitution(SPEEDS, weights)
    for v in (0.1, 0.2, 0.3, 0.55, 1.49, 2.2, 3.0):
        fall = float(BSpline(knots, rate, 1).integrate(SPEEDS[0], v))
        np.testing.assert_allclose(law.restitution(jnp.asarray(v)), 1 - shares[0] - fall)
    ends = law.restitution(jnp.array([0.0, 0.1, 3.0, 50.0]))
    np.testing.assert_allclose(ends, [*[1 - shares[0]] * 2, *[shares[-1]] * 2])


@pytest.mark.parametrize("size", [1.0, 30.0, 1e3])
def test_learned_restitution_is_monotone_and_in_range(size):
    speeds = jnp.linspace(0.0, 4.0, 801)

    def restitution(weights, v):
        return ij.LearnedRestitution(SPEEDS, weights).restitution(v)

    weights = jnp.asarray(size * np.random.default_rng(2).standard_normal((20, 7)))
    over = jax.vmap(jax.vmap(jax.value_and_grad(restitution, (0, 1)), (None, 0)), (0, None))
    r, slopes = jax.jit(over)(weights, speeds)
    assert np.all(np.diff(r, axis=1) <= 1e-15)
    assert np.all((np.asarray(r) >= -1e-15) & (np.asarray(r) <= 1))
    assert all(np.all(np.isfinite(slope)) for slope in slopes)


def test_learned_restitution_approximates_named_law():
    fast = jnp.linspace(0.0, 4.0, 41)
    line = ij.LearnedRestitution.like(ij.LinearRestitution(0.9, 0.1), SPEEDS)
    expected = 0.9 - 0.1 * np.clip(fast, 0.1, 3.0)
    np.testing.assert_allclose(line.restitution(fast), expected, atol=1e-14)
    power = ij.PowerRestitution(0.6, 0.25)
    near = ij.LearnedRestitution.like(power, SPEEDS).restitution(jnp.asarray(SPEEDS))
    expected = np.minimum(0.6 * SPEEDS**-0.25, 1)
    np.testing.assert_allclose(near[np.array([0, -1])], expected[[0, -1]], rtol=1e-2)
    np.testing.assert_allclose(near, expected, atol=0.05)
    for r in (0.0, 0.7, 1.0):  # shares of nothing are given a thousandth
        level = ij.LearnedRestitution.like(ij.Restitution(r), SPEEDS)
        np.testing.assert_allclose(level.restitution(fast), r, atol=0.01)


@pytest.mark.parametrize(
    ("speeds", "count", "words"),
    [
        ([1.0], 3, "at least two"),
        (1.0, 2, "at least two"),
        ([1.0, 2.0], 3, "two more weights than the 2"),
        ([2.0, 1.0], 4, "increase strictly"),
        ([-1.0, 1.0], 4, "not negative"),
        ([0.0, np.inf], 4, "must be finite"),
    ],
)
def test_learned_restitution_refuses_wrong_arguments(speeds, count, words):
    with pytest.raises(ValueError, match=words):
        ij.LearnedRestitution(np.array(speeds), np.zeros(count))
    with pytest.raises(ValueError, match="`weights` must be finite"):
        ij.LearnedRestitution(SPEEDS, np.full(7, np.nan))


def test_learned_weights_are_not_parameters():
    law = ij.LearnedRestitution(SPEEDS, np.zeros(7))
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(law))
    system = System(model, ij.InitialState(0.0), Start(0.0), ij.Sensor())
    assert not {"speeds", "weights"} & set(handles(system))


def test_impact_uses_restitution_at_its_speed():
    law = ij.LearnedRestitution(SPEEDS, np.random.default_rng(3).standard_normal(7))
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(law))
    run = ij.simulate(model, ij.InitialState(0.3), jnp.array([0.0, 0.3]), max_steps=16)
    # flight is analytic, whatever the law
    assert isinstance(natural_step(model, 1e-8), ij.TaylorStep)
    v = jnp.sqrt(2 * 9.81 * jnp.asarray(0.3))
    np.testing.assert_allclose(run.impacts.approach_speed[0], v, rtol=1e-9)
    np.testing.assert_allclose(run.impacts.restitution[0], law.restitution(v), rtol=1e-9)


class Series(ij.AbstractMemorylessLaw):
    """F = a₁ δ + a₂ δ² + a₃ δ³: a law whose coefficients are one array."""

    a: Array = eqx.field(converter=ij.as_parameter)
    separation: ij.AbstractSeparation = ij.AtZeroForce()

    def force(self, penetration, rate, internal, mass):
        del rate, internal, mass
        return jnp.sum(self.a * jnp.stack([penetration, penetration**2, penetration**3]))


@thorough
def test_force_law_may_have_array_field():
    """Its energy is that of the impact: 100 δ²/2 + 10⁴ δ³/3 = v²/2 at δ = 0.03 for a unit mass."""
    model = ij.ImpactOscillator(ij.FreeMass(1.0), ij.Stop(Series(a=np.array([100.0, 1e4, 0.0]))))
    run = ij.simulate(model, ij.InitialState(0.01, -(0.27**0.5)), jnp.array([0.0, 1.0]))
    np.testing.assert_allclose(run.deepest_penetration[0], 0.03, rtol=1e-6)
    np.testing.assert_allclose(run.velocity[1], 0.27**0.5, rtol=1e-7)


@thorough
@pytest.mark.parametrize("order", mostly_thorough([9, 11, 15], 9))
def test_force_vanishing_at_surface_ends_contact_once(order):
    """A lossless spring without pull: the force and the indentation are zero at one time, and
    rounding must not let the mass press again on what it has left.
    """
    law = Series(a=jnp.array([100.0, 1e4, 0.0]))
    model = ij.ImpactOscillator(ij.FreeMass(1.0), ij.Stop(law))
    speeds = jnp.linspace(0.05, 1.0, 200)
    back = jax.vmap(
        lambda v: ij.simulate(
            model,
            ij.InitialState(0.01, -v),
            jnp.array([0.0, 1.0]),
            step=ij.TaylorStep(order),
            max_steps=64,
        )
    )(speeds)
    assert jnp.all(back.result == ij.RESULTS.successful)
    np.testing.assert_allclose(back.velocity[:, 1], speeds, rtol=1e-7)
