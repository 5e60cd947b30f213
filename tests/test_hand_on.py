"""A run of an oscillator that is cut goes on bitwise as if there had been no cut."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from laws import AS_POWER_LAWS, LAWS, MASS, WITH_BROKEN_POWERS
from tiers import mostly_thorough, thorough

EDGES, UNTIL_REST = jnp.linspace(0.0, 20.0, 998)[1:], jnp.linspace(0.0, 3.0, 200)[1:]
STEPS = 65536


def forced(law):
    base = ij.HarmonicMotion(4.6e-3, 2 * np.pi * 4.2, 0.0)
    pendulum = ij.Pendulum(13.47, zeta=0.0017, length=0.071, mass=MASS, base=base)
    return ij.ImpactOscillator(pendulum, ij.Stop(law))


def leaning(law):
    """A pendulum that comes to rest on its stop."""
    pendulum = ij.Pendulum(13.47, length=0.071, mass=MASS)
    return ij.ImpactOscillator(pendulum, ij.Stop(law, gap=-0.2))


def with_friction(law):
    pendulum = ij.Pendulum(13.47, length=0.071, mass=MASS, dry_friction=0.6)
    return ij.ImpactOscillator(pendulum, ij.Stop(law))


def run(model, start, ts, steps=STEPS):
    t0 = 0.0 if isinstance(start, ij.InitialState) else None
    most = steps // 4
    return ij.simulate(model, start, ts, t0=t0, tolerance=1e-10, max_steps=steps, max_impacts=most)


@jax.jit
def at_once(model, start, edges):
    whole = run(model, start, edges)
    return whole.position, whole.velocity, whole.result, whole.final


@jax.jit
def in_parts(model, final, edges):
    """Position and velocity at the ends of all parts that follow, and the last run."""

    def one(final, end):
        part = run(model, final, end[None], 1024)
        return part.final, (part.position[0], part.velocity[0], part.result)

    final, (position, velocity, result) = jax.lax.scan(one, final, edges)
    return position, velocity, result, final


def assert_same(model, start, edges):
    *whole, result, final = at_once(model, start, edges)
    *_, first = at_once(model, start, jnp.linspace(edges[0] / 2, edges[0], edges.size))
    *cut, results, last = in_parts(model, first, edges[1:])
    assert result == ij.RESULTS.successful
    assert jnp.all(results == ij.RESULTS.successful)
    after_first = [values[1:] for values in whole]
    jax.tree.map(np.testing.assert_array_equal, (cut, last), (after_first, final))


def as_power_law(name):
    return ij.PowerLaw(*AS_POWER_LAWS[name]) if name in WITH_BROKEN_POWERS else LAWS[name].law


@pytest.mark.parametrize("name", mostly_thorough(LAWS, "maxwell"))
def test_cuts_of_a_forced_motion(name):
    """Laws without a Taylor series, which have no state of their own, as power laws."""
    assert_same(forced(as_power_law(name)), ij.InitialState(0.05), EDGES)


@pytest.mark.parametrize("make", mostly_thorough((leaning, with_friction), leaning))
@pytest.mark.parametrize(
    "name",
    mostly_thorough(("linear-restitution", "kelvin-voigt", "maxwell"), "linear-restitution"),
)
def test_cuts_until_rest(make, name):
    assert_same(make(LAWS[name].law), ij.InitialState(0.5), UNTIL_REST)


@thorough
@pytest.mark.parametrize("name", ["linear-restitution", "maxwell", "hunt-crossley"])
def test_derivatives_across_a_cut(name):
    """Two cuts before the first impact, one in the contact, if it takes time, and one after it."""
    make, values = LAWS[name]
    later = jnp.array([0.6, 0.9])

    def told(parameters, cut):
        model, start = forced(make(*parameters[1:])), ij.InitialState(parameters[0])
        ends = jnp.stack([jnp.stack([cut / 2, cut]), later])
        both = jax.vmap(lambda ts: run(model, start, ts, 1024))(ends)
        after = run(model, jax.tree.map(lambda leaf: leaf[0], both.final), later, 1024)
        ended = both.result, after.result
        return ((after.position, after.velocity), (both.position[1], both.velocity[1])), ended

    impact = ij.simulate(forced(make(*values)), ij.InitialState(0.3), [0.0, 0.6]).impacts.time[0]
    cuts = jnp.stack([0.3 * impact, 0.9 * impact, impact + 1e-4, impact + 0.1])
    slopes = jax.jit(jax.vmap(jax.jacfwd(told, has_aux=True), (None, 0)))
    (across, whole), ended = slopes(jnp.array([0.3, *values]), cuts)
    assert all(np.all(each == ij.RESULTS.successful) for each in ended)
    for own, other in zip(across, whole, strict=True):
        scale = np.max(np.abs(other), axis=(0, 1))
        np.testing.assert_allclose(own / scale, other / scale, rtol=0, atol=1e-12)
        assert np.all(scale > 0)


def test_start_and_end_of_a_run():
    model, ts = forced(LAWS["restitution"].law), jnp.linspace(0.0, 0.5, 6)
    step = ij.TaylorStep(order=6)  # compiles faster than the usual one

    def later(t0, t1):
        before = ij.simulate(model, ij.InitialState(0.3), jnp.stack([t1]), t0=t0, step=step)
        return ij.simulate(model, before.final, ts + 0.5, step=step).position

    def in_one_run(t0):
        return ij.simulate(model, ij.InitialState(0.3), ts + 0.5, t0=t0, step=step).position

    begin, end = jax.jacfwd(later, (0, 1))(0.0, 0.4)
    np.testing.assert_allclose(begin, jax.jacfwd(in_one_run)(0.0), rtol=1e-12)
    np.testing.assert_array_equal(end, 0.0)


@thorough
def test_factors_of_a_later_run_are_those_of_its_own_impacts():
    model, ts = forced(LAWS["restitution"].law), jnp.linspace(0.7, 1.4, 8)
    factors = jnp.linspace(0.9, 1.1, 12)
    whole = ij.simulate(model, ij.InitialState(0.3), ts, t0=0.0, factors=factors)
    before = ij.simulate(model, ij.InitialState(0.3), [0.65], t0=0.0, factors=factors)
    rest = factors[int(before.impacts.count) :]
    after = ij.simulate(model, before.final, ts, factors=rest)
    assert 0 < before.impacts.count < 12
    np.testing.assert_array_equal(after.position, whole.position)


def test_refusals():
    """After runs whose programs the tests above have compiled."""
    model = forced(LAWS["maxwell"].law)
    *_, final = at_once(model, ij.InitialState(0.05), EDGES)
    with pytest.raises(ValueError, match="`t0` must be left out"):
        ij.simulate(model, final, [20.6], t0=20.5)
    with pytest.raises(ValueError, match="from a run of another kind"):
        ij.simulate(forced(LAWS["kelvin-voigt"].law), final, [20.6])
    with pytest.raises(ValueError, match="from a run of another kind"):
        ij.simulate(model, final, [20.6], step=ij.RungeKutta())
    with pytest.raises(ValueError, match="before"):
        ij.simulate(model, final, [0.1])
    rigid, soft = (leaning(LAWS[name].law) for name in ("linear-restitution", "kelvin-voigt"))
    *_, rests = at_once(rigid, ij.InitialState(0.5), UNTIL_REST)
    with pytest.raises(ValueError, match="from a run of another kind"):
        ij.simulate(soft, rests, [3.6])
    several = jax.tree.map(lambda leaf: jnp.stack([leaf, leaf]), final)
    with pytest.raises(ValueError, match="holds several states"):
        ij.simulate(model, several, [20.6])
