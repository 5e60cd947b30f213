"""Integrate-and-fire neurons v′ = I − v with threshold 1: spikes every ln(I/(I − 1))."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from hybrid_systems import Neurons

EVENTS = 12


def run(p, ts):
    """Two neurons with p = (I₁, I₂, push, v₁, v₂)."""
    start = ij.Start(0.0, p[3:5])
    return ij.solve(Neurons(p[:2], p[2]), start, ts, max_events=EVENTS, max_steps=256)


def told(p, ts):
    found = run(p, ts)
    return found.events.t, found.ys


TS = jnp.array([0.7, 1.3, 2.1])
APART = jnp.array([2.0, 1.8, 0.0, 0.1, 0.3])
PUSHED = jnp.array([2.0, 1.8, 0.2, 0.0, 0.0])  # 1 fires at ln 2, when v₂ = 0.9, and so does 2
TOGETHER = jnp.array([2.0, 2.0, 0.0, 0.0, 0.0])
LANES = jnp.stack([APART, PUSHED, TOGETHER])
RUN = jax.jit(jax.vmap(run, (0, None)))
WAYS = {"forward": jax.jacfwd, "reverse": jax.jacrev}


@pytest.fixture(scope="module")
def found():
    return RUN(LANES, TS)


@pytest.fixture(scope="module", params=WAYS)
def slopes(request):
    """Derivatives of spike times and samples, for each lane."""
    return jax.vmap(WAYS[request.param](told), (0, None))(LANES, TS)


def spikes(current, v, count):
    """Closed form of the spike times of a neuron on its own."""
    first = jnp.log((current - v) / (current - 1))
    return first + jnp.arange(count, dtype=float) * jnp.log(current / (current - 1))


def test_neurons_apart(found, slopes):
    log = jax.tree.map(lambda x: x[0], found.events)
    for own in (0, 1):
        mine = np.flatnonzero(log.transition == own)
        i, v = APART[own], APART[3 + own]
        np.testing.assert_allclose(log.t[mine], spikes(i, v, mine.size), rtol=1e-8)
        by_current, by_start = jax.jacfwd(spikes, (0, 1))(i, v, mine.size)
        np.testing.assert_allclose(slopes[0][0, mine, own], by_current, rtol=1e-6)
        np.testing.assert_allclose(slopes[0][0, mine, 3 + own], by_start, rtol=1e-6)
        np.testing.assert_allclose(slopes[0][0, mine, 1 - own], 0.0, atol=1e-8)


def pushed(p):
    """Closed form of the first spikes: 2 at the time of 1, which is then at the push."""
    current, push = p[0], p[2]
    first = jnp.log((current - p[3]) / (current - 1))
    later = first + jnp.log((current - push) / (current - 1))
    return jnp.stack([first, first, later])


def test_a_spike_that_causes_another(found, slopes):
    log = jax.tree.map(lambda x: x[1], found.events)
    np.testing.assert_array_equal(log.transition[:3], [0, 1, 0])
    np.testing.assert_allclose(log.t[:3], pushed(PUSHED), rtol=1e-8)
    assert log.t[1] == log.t[0]
    np.testing.assert_allclose(log.after[1], np.array([PUSHED[2], 0.0]), atol=1e-12)
    np.testing.assert_allclose(slopes[0][1, :3], jax.jacfwd(pushed)(PUSHED), rtol=1e-6, atol=1e-8)


def test_only_one_was_due(found):
    """Spike 2 was caused by spike 1: their order is no matter of choice."""
    assert not np.any(found.events.order_matters[1])


def test_two_spikes_at_one_time(found, slopes):
    """Without a push, neurons in step have each its own derivative."""
    log = jax.tree.map(lambda x: x[2], found.events)
    np.testing.assert_array_equal(log.transition[:4], [0, 1, 0, 1])
    np.testing.assert_array_equal(log.t[0:4:2], log.t[1:4:2])
    for own in (0, 1):
        exact = jax.jacfwd(spikes)(TOGETHER[own], TOGETHER[3 + own], 2)
        np.testing.assert_allclose(slopes[0][2, own:4:2, own], exact, rtol=1e-6)
        np.testing.assert_allclose(slopes[0][2, own:4:2, 1 - own], 0.0, atol=1e-8)
    assert not np.any(log.order_matters)


def test_modes_agree():
    forward, reverse = (jax.vmap(way(told), (0, None))(LANES, TS) for way in WAYS.values())
    for a, b in zip(forward, reverse, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)
