"""Derivatives at the edges: rests that outlast a run, one sample, lanes that cannot run."""

import functools

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from tiers import mostly_thorough, thorough

# Flights of a ball are parabolas, which both steps integrate exactly.
STEPS = {"Taylor": ij.TaylorStep(order=4), "Bosh3": ij.RungeKutta(diffrax.Bosh3())}
WAYS = jax.jacfwd, jax.jacrev
G = 9.81


def drop(step, r, height, velocity, gravity, ts, t0=0.0):
    model = ij.ImpactOscillator(ij.BouncingBall(gravity), ij.Stop(ij.Restitution(r)))
    start = ij.InitialState(height, velocity)
    return ij.simulate(model, start, ts, t0=t0, step=STEPS[step], max_steps=32, max_impacts=8)


START, REST = 0, 1  # lanes: one that ends where it starts, and one that ends at rest
EDGES = jnp.array([[0.8, 0.2, 0.3, 0.0], [0.4, 0.2, 0.0, 5.0]])


@functools.cache
def edges(step):
    """End and begin of the rest, position, velocity by r, height, velocity and end of the run."""

    def told(parameters):
        r, height, velocity, t1 = parameters
        run = drop(step, r, height, velocity, G, t1[None])
        return jnp.stack([run.rests.end[0], run.rests.begin[0], run.position[0], run.velocity[0]])

    return jax.jit(jax.vmap(lambda p: [told(p), *(way(told)(p) for way in WAYS)]))(EDGES)


@pytest.mark.parametrize("step", mostly_thorough(STEPS, "Taylor"))
def test_derivatives_of_rest_at_end_of_run(step):
    value, *slopes = (each[REST] for each in edges(step))
    r, height, _, t1 = map(float, EDGES[REST])
    fall, loss = np.sqrt(2 * height / G), 1 - r
    begin = fall * (1 + 2 * r / loss)
    by_height, by_velocity = begin / (2 * height), 1 / G  # of a ball thrown up at v = 0
    np.testing.assert_allclose(value, [t1, begin, 0.0, 0.0], rtol=1e-12, atol=1e-12)
    for slope in slopes:
        end, beginning, *place = slope
        np.testing.assert_allclose(end, [0.0, 0.0, 0.0, 1.0], rtol=1e-12, atol=1e-12)
        expected = [2 * fall / loss**2, by_height, by_velocity, 0.0]
        np.testing.assert_allclose(beginning, expected, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(place, np.zeros((2, 4)), atol=1e-12)


@pytest.mark.parametrize("step", mostly_thorough(STEPS, "Taylor"))
def test_derivative_of_single_sample_at_start(step):
    """Its derivative by that state is one; by r it is zero."""
    value, *slopes = (each[START] for each in edges(step))
    np.testing.assert_array_equal(value[2:], EDGES[START, 1:3])
    for slope in slopes:
        np.testing.assert_array_equal(slope[2:, :3], [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@thorough
@pytest.mark.parametrize("steps", [128, 32], ids=["runs", "fails"])
def test_overflow_beyond_step_end_gives_no_nan_derivative(steps):
    """A ball thrown up against drag, x = ln(1 + d v t) / d. A step is followed to all times of a
    block of samples, and the drag grows with the square of the speed.
    """
    drag, ts = 1e3, jnp.array([0.0, 1e-5, 1e-4, 1e-3, 1e-2, 1.0])

    def position(velocity):
        ball = ij.ImpactOscillator(ij.BouncingBall(0.0, drag=drag), ij.Stop(ij.Restitution(0.5)))
        start = ij.InitialState(0.0, velocity)
        run = ij.simulate(ball, start, ts, step=ij.RungeKutta(), max_steps=steps)
        return run.position, (run.result == ij.RESULTS.successful, jnp.isnan(run.position))

    slopes, (fine, unknown) = jax.jit(jax.jacrev(position, has_aux=True))(10.0)
    assert fine == (steps == 128)
    assert fine == ~unknown[-1]
    expected = jnp.where(unknown, 0.0, ts / (1 + drag * 10.0 * ts))
    np.testing.assert_allclose(slopes, expected, rtol=1e-6)


NAN = np.nan
GOOD_TIMES = [0.1, 0.3, 0.5]
# r, height, velocity, t0, times
GOOD = [(0.8, 0.2, 0.0, 0.0, GOOD_TIMES), (0.5, 0.1, 0.4, 0.05, GOOD_TIMES)]
BAD = {
    "r is NaN": (NAN, 0.2, 0.0, 0.0, GOOD_TIMES),
    "r is impossible": (1.5, 0.2, 0.0, 0.0, GOOD_TIMES),
    "r is infinite": (np.inf, 0.2, 0.0, 0.0, GOOD_TIMES),
    "height is NaN": (0.8, NAN, 0.0, 0.0, GOOD_TIMES),
    "velocity is infinite": (0.8, 0.2, np.inf, 0.0, GOOD_TIMES),
    "starts inside the stop": (0.8, -0.1, 0.0, 0.0, GOOD_TIMES),
    "t0 is NaN": (0.8, 0.2, 0.0, NAN, GOOD_TIMES),
    "t0 is after the first sample": (0.8, 0.2, 0.0, 0.2, GOOD_TIMES),
    "first time is NaN": (0.8, 0.2, 0.0, 0.0, [NAN, 0.3, 0.5]),
    "one time is NaN": (0.8, 0.2, 0.0, 0.0, [0.1, NAN, 0.5]),
    "last time is NaN": (0.8, 0.2, 0.0, 0.0, [0.1, 0.3, NAN]),
    "last time is infinite": (0.8, 0.2, 0.0, 0.0, [0.1, 0.3, np.inf]),
    "times out of order": (0.8, 0.2, 0.0, 0.0, [0.1, 0.5, 0.3]),
    "times repeat": (0.8, 0.2, 0.0, 0.0, [0.1, 0.3, 0.3]),
}
LANES = [jnp.asarray(column) for column in zip(*GOOD, *BAD.values(), strict=True)]


@pytest.mark.parametrize("step", mostly_thorough(STEPS, "Taylor"))
def test_masked_lanes_do_not_affect_gradients_of_others(step):
    """By a parameter that all lanes share, where the user masks those that did not run."""

    def all_told(gravity):
        def one(r, height, velocity, t0, ts):
            run = drop(step, r, height, velocity, gravity, ts, t0)
            fine = run.result == ij.RESULTS.successful
            log = run.impacts
            columns = run.position, run.velocity, log.time[:2], log.approach_speed[:2]
            told = jnp.concatenate(columns)
            return jnp.sum(jnp.where(fine, told, 0.0)), (fine, run.position, run.velocity)

        return jax.vmap(one)(*LANES)

    def total(gravity):
        return jnp.sum(all_told(gravity)[0])

    def closed(gravity):
        return sum(told_of_a_ball(gravity, *lane) for lane in GOOD)

    (fine, position, velocity), *slopes = jax.jit(
        lambda g: [all_told(g)[1], *(way(total)(g) for way in WAYS)]
    )(jnp.array(G))
    good = np.arange(len(fine)) < len(GOOD)
    np.testing.assert_array_equal(fine, good)
    for column in (position, velocity):
        np.testing.assert_array_equal(np.isnan(column), np.broadcast_to(~good[:, None], (16, 3)))
    for slope in slopes:
        np.testing.assert_allclose(slope, jax.grad(closed)(G), rtol=1e-11)


def told_of_a_ball(gravity, r, height, velocity, t0, times):
    """Sum of positions, velocities, and the times and approach speeds of the first two impacts."""
    speed = jnp.sqrt(velocity**2 + 2 * gravity * height)
    hits = [t0 + (velocity + speed) / gravity]
    for n in range(1, 8):
        hits.append(hits[-1] + 2 * r**n * speed / gravity)
    total = 0.0
    for t in times:
        if t < hits[0]:
            s, x, v = t - t0, height, velocity
        else:
            n = sum(float(hit) <= t for hit in map(jax.lax.stop_gradient, hits))
            s, x, v = t - hits[n - 1], 0.0, r**n * speed
        total += x + v * s - gravity * s**2 / 2 + v - gravity * s
    for n in (0, 1):
        happens = float(jax.lax.stop_gradient(hits[n])) <= times[-1]
        total += hits[n] + r**n * speed if happens else 0.0
    return total


@thorough
def test_masked_lanes_with_compliant_stop_have_finite_gradients():
    """The same by the frequency of a contact in which the lanes are."""

    def positions(omega0):
        def one(gamma, height, t):
            law = ij.KelvinVoigt(omega0, gamma)
            model = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(law))
            start = ij.InitialState(height, -1.0)
            run = ij.simulate(
                model, start, t[None], t0=0.0, tolerance=1e-12, max_steps=32, max_impacts=2
            )
            told = run.position[0] + run.deepest_penetration[0] + run.peak_force[0]
            return jnp.where(run.result == ij.RESULTS.successful, told, 0.0), run.position[0]

        gammas = jnp.array([0.0, NAN, -0.1, 0.0, 0.0])
        heights = jnp.array([0.0, 0.0, 0.0, NAN, 0.0])
        return jax.vmap(one)(gammas, heights, jnp.array([0.1, 0.1, 0.1, 0.1, NAN]))

    def total(omega0):
        return jnp.sum(positions(omega0)[0])

    def closed(omega0):  # during compression, so that depth and force are largest at the end
        return omega0 * jnp.sin(omega0 * 0.1)

    (_, places), *slopes = jax.jit(lambda w: [positions(w), *(way(total)(w) for way in WAYS)])(
        jnp.array(10.0)
    )
    np.testing.assert_array_equal(np.isnan(places), [False, True, True, True, True])
    for slope in slopes:
        np.testing.assert_allclose(slope, jax.grad(closed)(10.0), rtol=1e-10)
