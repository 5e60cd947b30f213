"""A bouncing ball against its closed form: impacts, samples, rest, and their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from hybrid_systems import Ball

NO_REST = -1.0
EVENTS, SAMPLES = 24, 12
RESULTS = ij.RESULTS
EXACT = ij.TaylorStep(4)  # the flights are parabolas


def run(p, ts):
    """The run with p = (gravity, restitution, height, velocity, slow)."""
    start, settings = ij.Start(0.0, {"x": p[2], "v": p[3]}), {"max_steps": 128, "step": EXACT}
    return ij.solve(Ball(p[0], p[1], p[4]), start, ts, max_events=EVENTS, **settings)


def told(p, ts):
    """Times and speeds of four impacts, the times until which events last, and all samples."""
    found = run(p, ts)
    events = found.events
    first = events.t[:4], events.before["v"][:4], events.after["v"][:4]
    return [*first, events.until, found.ys["x"], found.ys["v"]]


def closed(p, ts):
    """The same from formulas: t = fall + (2 u/g)(r + r² + ...), speeds u rⁿ, rest at n → ∞."""
    g, r, height, velocity, _ = p
    u = jnp.sqrt(velocity**2 + 2 * g * height)
    fall = (velocity + u) / g
    count = jnp.arange(EVENTS, dtype=float)
    flights = 2 * u * r**count / g
    begins = fall + jnp.cumsum(flights) - flights[0]
    end = fall + 2 * u * r / (g * (1 - r))
    number = jnp.searchsorted(jax.lax.stop_gradient(begins), ts, side="right") - 1
    since = ts - begins[number]
    rising = u * r ** (number + 1).astype(float)
    first = ts < begins[0]
    x = jnp.where(first, height + ts * (velocity - g * ts / 2), since * (rising - g * since / 2))
    v = jnp.where(first, velocity - g * ts, rising - g * since)
    rests = ts >= end
    x, v = jnp.where(rests, 0.0, x), jnp.where(rests, 0.0, v)
    before = -u * r ** count[:4]
    return [begins[:4], before, -r * before, jnp.tile(end, EVENTS), x, v]


def joined(p, ts):
    return jnp.concatenate(closed(p, ts))


LANES, TOLD = (jax.jit(jax.vmap(function)) for function in (run, told))
FORWARD = jax.jit(jax.vmap(jax.jacfwd(told)))
REVERSE = jax.vmap(jax.jacrev(told))  # as one program it makes the compiler of JAX 0.10 abort
CLOSED = jax.jit(jax.vmap(lambda p, ts: [joined(p, ts), jax.jacfwd(joined)(p, ts)]))
BALLS = jnp.array(
    [
        [9.81, 0.8, 1.0, 0.0, NO_REST],
        [9.81, 0.5, 1.0, 0.3, 1e-3],  # comes to rest
        [5.0, 0.9, 0.3, -0.2, NO_REST],
        [8.0, 0.25, 1.0, 0.0, 1e-2],  # impacts at binary fractions
    ]
)


@pytest.fixture(scope="module")
def compared():
    ts = jnp.broadcast_to(jnp.linspace(0.05, 2.3, SAMPLES), (len(BALLS), SAMPLES))
    return with_derivatives(BALLS, ts), CLOSED(BALLS, ts)


@pytest.fixture(scope="module")
def impacts(compared):
    """The time of the second impact of each ball."""
    return compared[0][0][:, 1]


def with_derivatives(balls, ts):
    parts = [function(balls, ts) for function in (TOLD, FORWARD, REVERSE)]
    return [jnp.concatenate(each, axis=1) for each in parts]


UNTIL, SAMPLED = slice(12, 12 + EVENTS), 12 + EVENTS  # places of what is told


def agree(own, exact, bar):
    own, exact = np.asarray(own), np.asarray(exact)
    own, exact = (np.delete(each, UNTIL, axis=1) for each in (own, exact))
    np.testing.assert_allclose(own, exact, rtol=bar, atol=bar)


def test_events_and_samples(compared):
    (value, _, _), (exact, _) = compared
    agree(value, exact, 1e-12)


def test_derivatives_in_both_modes(compared):
    (_, forward, reverse), (_, exact) = compared
    agree(forward[..., :4], exact[..., :4], 1e-10)
    np.testing.assert_allclose(forward, reverse, rtol=1e-12, atol=1e-12)


def test_rest_and_its_derivatives(compared):
    (value, forward, reverse), (exact, slope) = compared
    lanes = np.array([1, 3])
    rest = lanes, UNTIL.start + np.nanargmax(value[lanes, UNTIL], axis=1)
    np.testing.assert_allclose(value[rest], exact[rest], rtol=1e-12)
    for own in (forward, reverse):
        np.testing.assert_allclose(own[rest], slope[rest], rtol=1e-10, atol=1e-12)


def test_second_derivatives():
    ts = jnp.linspace(0.05, 2.3, SAMPLES)
    places = np.array([2, 3, 6, SAMPLED, SAMPLED + 5, SAMPLED + 8, -1])

    def some(function):
        return jax.jacfwd(jax.jacfwd(lambda p: jnp.concatenate(function(p, ts))[places]))

    own, exact = some(told)(BALLS[1]), some(closed)(BALLS[1])
    np.testing.assert_allclose(own, exact, rtol=1e-10, atol=1e-9)


def test_samples_at_an_impact_and_one_unit_beside(impacts):
    """The sample at the impact is the state after it, with the derivatives of that state."""
    near = [np.nextafter(impacts, -np.inf), impacts, np.nextafter(impacts, np.inf)]
    later = np.linspace(2.0, 2.3, SAMPLES - 3)
    ts = jnp.stack([np.concatenate([own, later]) for own in np.transpose(near)])
    value, forward, reverse = with_derivatives(BALLS, ts)
    beside = [-1e-13, 1e-13, 1e-13, *np.zeros(SAMPLES - 3)]  # on the right side in the formula
    exact, slope = CLOSED(BALLS, ts + jnp.array(beside))
    agree(value, exact, 1e-11)
    agree(forward[..., :4], slope[..., :4], 1e-10)
    np.testing.assert_allclose(forward, reverse, rtol=1e-12, atol=1e-12)
    before, at = value[:, SAMPLED + SAMPLES], value[:, SAMPLED + SAMPLES + 1]
    assert np.all((before < 0) & (at > 0))


FATES = {
    "goes on": ([9.81, 0.8, 1.0, 0.0, NO_REST], RESULTS.successful),
    "rests": ([9.81, 0.5, 1.0, 0.0, 1e-3], RESULTS.successful),
    "stays where it falls": ([9.81, 0.0, 1.0, 0.0, NO_REST], RESULTS.event_repeats),
    "rests where it falls": ([9.81, 0.0, 1.0, 0.0, 1e-3], RESULTS.successful),
    "endless series": ([9.81, 0.5, 1.0, 0.0, NO_REST], RESULTS.event_repeats),
    "no number": ([np.nan, 0.8, 1.0, 0.0, NO_REST], RESULTS.non_finite),
    "too many impacts": ([9.81, 1.0, 0.01, 0.0, NO_REST], RESULTS.max_events_reached),
    "too many steps": ([9.81, 1.0, 1e-4, 0.0, NO_REST], RESULTS.max_steps_reached),
}


@pytest.fixture(scope="module")
def fates():
    balls = jnp.array([parameters for parameters, _ in FATES.values()])
    ts = jnp.broadcast_to(jnp.linspace(0.2, 2.4, SAMPLES), (len(FATES), SAMPLES))
    return LANES(balls, ts), LANES(jnp.broadcast_to(balls[0], balls.shape), ts)


@pytest.mark.parametrize("name", FATES)
def test_result(fates, name):
    number = list(FATES).index(name)
    own = jax.tree.map(lambda x: x[number], fates[0])
    assert own.result == FATES[name][1]
    fails = FATES[name][1] not in (RESULTS.successful, RESULTS.max_events_reached)
    assert bool(jnp.isnan(own.ys["x"][-1])) == fails
    assert np.all(np.asarray(own.ys["x"])[np.isfinite(own.ys["x"])] >= -1e-12)


def test_samples_before_a_failure_are_right(fates):
    """Until the endless series ends, at t = fall (1 + 2 r/(1 − r)) = 3 fall."""
    both = [jax.tree.map(lambda x, n=n: x[n], fates[0]) for n in (1, 4)]
    before = both[0].ts < 3 * np.sqrt(2 / 9.81) - 1e-3
    np.testing.assert_allclose(both[1].ys["x"][before], both[0].ys["x"][before], rtol=1e-10)


def test_lanes_that_fail_leave_the_others_alone(fates):
    mixed, alone = (jax.tree.map(lambda x: x[0], each) for each in fates)
    same = jax.tree.map(
        lambda a, b: np.array_equal(a, b, equal_nan=True),
        (mixed.ys, mixed.events, mixed.final, mixed.steps),
        (alone.ys, alone.events, alone.final, alone.steps),
    )
    assert all(jax.tree.leaves(same))
