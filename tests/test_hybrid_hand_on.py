"""A run that is cut goes on bitwise as if there had been no cut, with its derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from hybrid_systems import Ball, Neurons, Oscillator
from tiers import mostly_thorough

SAMPLES, CUTS = 40, 97


def ball(p):
    return Ball(p[0], p[1], jnp.array(0.05)), ij.Start(0.0, {"x": p[2], "v": 0.0})


def oscillator(p):
    system = Oscillator(jnp.array(0.05), p[0], jnp.array(2.2), p[1])
    return system, ij.Start(0.0, {"x": p[2], "v": 0.0})


def neurons(p):
    return Neurons(p[:2], jnp.array(0.15)), ij.Start(0.0, jnp.stack([p[2], 0.0 * p[2]]))


SYSTEMS = {  # with parameters and end
    "ball": (ball, [9.81, 0.6, 1.0], 2.2),
    "oscillator": (oscillator, [1.5, 0.7, 0.3], 12.0),
    "neurons": (neurons, [2.0, 1.8, 0.1], 4.0),
}


def solved(system, start, ts):
    step = ij.TaylorStep(order=8)  # compiles faster than the usual one
    return ij.solve(system, start, ts, step=step, max_events=32, max_steps=512)


def flat(run):
    return jnp.concatenate([y.reshape(y.shape[0], -1) for y in jax.tree.leaves(run.ys)], axis=1)


def whole_and_parts(name, parameters, first, second):
    make, _, _ = SYSTEMS[name]
    system, start = make(parameters)
    whole = solved(system, start, jnp.sort(jnp.concatenate([first, second])))
    before = solved(system, start, first)
    return whole, before, solved(system, before.final, second)


def times(name):
    """For each cut the samples before and after it; the last ones before lie at the cut."""
    end, random = SYSTEMS[name][2], np.random.default_rng(3)
    cuts = random.uniform(0.05 * end, 0.95 * end, CUTS)
    first = np.linspace(0.0, cuts, SAMPLES // 2, axis=1)
    second = np.linspace(cuts, end, SAMPLES // 2 + 1, axis=1)[:, 1:]
    return jnp.array(first), jnp.array(second)


@pytest.mark.parametrize("name", mostly_thorough(SYSTEMS, "ball"))
def test_cuts(name):
    parameters = jnp.array(SYSTEMS[name][1])
    run = jax.jit(jax.vmap(lambda *ts: whole_and_parts(name, parameters, *ts)))
    whole, before, after = run(*times(name))
    for own, one, two in zip(*map(jax.tree.leaves, (whole.ys, before.ys, after.ys)), strict=True):
        np.testing.assert_array_equal(own, np.concatenate([one, two], axis=1))
    assert np.all(after.result == ij.RESULTS.successful)
    for lane in range(CUTS):
        counts = [int(each.events.count[lane]) for each in (before, after, whole)]
        assert counts[0] + counts[1] == counts[2]
        for part in ("t", "transition", "until"):
            own, one, two = (getattr(each.events, part)[lane] for each in (whole, before, after))
            joined = np.concatenate([one[: counts[0]], two[: counts[1]]])
            np.testing.assert_array_equal(own[: counts[2]], joined)
    same = jax.tree.map(np.array_equal, whole.final, after.final)
    assert all(jax.tree.leaves(same))


@pytest.mark.parametrize("name", mostly_thorough(SYSTEMS, "ball"))
def test_derivatives_across_a_cut(name):
    first, second = (ts[:3] for ts in times(name))

    def told(parameters, *ts):
        whole, _, after = whole_and_parts(name, parameters, *ts)
        return flat(whole)[SAMPLES // 2 :], flat(after)

    slope = jax.vmap(jax.jacfwd(told), (None, 0, 0))
    own, across = slope(jnp.array(SYSTEMS[name][1]), first, second)
    np.testing.assert_allclose(across, own, rtol=1e-12, atol=1e-12)
    assert np.max(np.abs(own)) > 0.1
