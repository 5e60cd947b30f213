"""Derivatives twice and three times, forward and reverse in every order, against closed forms."""

import functools
import itertools

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._series.polynomial import polynomial
from systems import Own
from tiers import mostly_thorough, thorough

MODES = {"forward": jax.jacfwd, "reverse": jax.jacrev}


def lightened(t, x, v, gravity, lift):
    """A ball that grows lighter with time: its flights are cubics, which both steps below
    integrate exactly.
    """
    del x, v
    return lift * t - gravity


EXACT = {"Taylor": ij.TaylorStep(order=4), "Bosh3": ij.RungeKutta(diffrax.Bosh3())}
SAMPLES = (0.1, 0.7, 1.2, 3.0)


def told(step, parameters):
    """All that is told of a drop, in one vector; its flights are exact at any tolerance."""
    r, height, gravity, lift = parameters
    run = ij.simulate(
        ij.ImpactOscillator(
            Own(law=lightened, constants=(gravity, lift)), ij.Stop(ij.Restitution(r))
        ),
        ij.InitialState(height),
        jnp.array(SAMPLES),
        t0=0.0,
        step=step,
        tolerance=1.0,
        max_steps=32,
        max_impacts=4,
        chatter=ij.Chatter(below=0.7),
    )
    log, rests = run.impacts, run.rests
    columns = log.time, log.approach_speed, log.separation_speed, log.energy_lost
    rest = rests.begin[:1], rests.end[:1]
    return jnp.concatenate([run.position, run.velocity, *columns, *rest])


def bounced(parameters):
    """The same for r > 0 without lift: three impacts, then a summed chatter until rest."""
    r, height, gravity, _ = parameters
    fall = jnp.sqrt(2 * height / gravity)
    hits = [fall * (1 + 2 * sum(r**k for k in range(1, n))) for n in (1, 2, 3, 4)]

    def flight(n, t):
        up, s = r**n * gravity * fall, t - hits[n - 1]
        return up * s - gravity * s**2 / 2, up - gravity * s

    start = height - gravity * SAMPLES[0] ** 2 / 2, -gravity * SAMPLES[0]
    nothing = 0 * r
    states = start, flight(2, SAMPLES[1]), flight(4, SAMPLES[2]), (nothing, nothing)
    speeds = [gravity * fall * r**n for n in range(4)]
    losses = [(a**2 - b**2) / 2 for a, b in itertools.pairwise(speeds)]
    return jnp.stack(
        [
            *(position for position, _ in states),
            *(velocity for _, velocity in states),
            *(*hits[:3], nothing),
            *(*speeds[:3], nothing),
            *(*speeds[1:], nothing),
            *(*losses, nothing),
            fall * (1 + 2 * r / (1 - r)),
            SAMPLES[-1] + nothing,
        ]
    )


def lifted(parameters):
    """The same for r = 0: the ball lies where it falls until its weight is gone."""
    _, height, gravity, lift = parameters

    def fallen(t):
        return height - gravity * t**2 / 2 + lift * t**3 / 6, lift * t**2 / 2 - gravity * t

    hit = jnp.sqrt(2 * height / gravity)
    for _ in range(8):  # Newton's method, whose derivatives converge with it
        place, speed = fallen(hit)
        hit = hit - place / speed
    release = gravity / lift
    place, speed = fallen(jnp.asarray(SAMPLES[0]))
    nothing = jnp.zeros(())
    later = SAMPLES[-1] - release
    return jnp.stack(
        [
            *(place, nothing, nothing, lift * later**3 / 6),
            *(speed, nothing, nothing, lift * later**2 / 2),
            *(hit, nothing, nothing, nothing),
            *(-fallen(hit)[1], nothing, nothing, nothing),
            *(nothing, nothing, nothing, nothing),
            *(fallen(hit)[1] ** 2 / 2, nothing, nothing, nothing),
            hit,
            release,
        ]
    )


DROPS = jnp.array([[0.85, 0.2, 9.81, 0.0], [0.0, 0.2, 9.81, 5.0]])
CLOSED = [(bounced, [0, 1, 2]), (lifted, [1, 2, 3])]  # with the parameters that count


def repeated(function, order):
    for name in reversed(order):
        function = MODES[name](function)
    return function


def among(derivative, columns, times):
    for axis in range(1, times + 1):
        derivative = np.take(derivative, columns, axis)
    return derivative


def check(found, function, parameters, columns, times):
    """Right to 1e-10 of the largest derivative of all outputs."""
    exact = repeated(function, ["forward"] * times)
    expected = among(jax.jit(exact)(parameters), columns, times)
    found = among(found, columns, times)
    assert np.all(np.isfinite(found))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.max(np.abs(expected)))


def orders(times):
    return list(itertools.product(MODES, repeat=times))


@pytest.mark.parametrize(
    ("order", "step"),
    mostly_thorough(
        [(order, step) for order in orders(2) for step in EXACT],
        (("forward", "reverse"), "Taylor"),
    ),
    ids=lambda each: each if isinstance(each, str) else "-".join(each),
)
def test_second_derivatives_of_impact_log(order, step):
    """Under `jit` and `vmap`, of a lane that chatters and one that lies and is lifted."""
    derivative = repeated(functools.partial(told, EXACT[step]), order)
    found = jax.jit(jax.vmap(derivative))(DROPS)
    for lane, (function, columns) in enumerate(CLOSED):
        check(found[lane], function, DROPS[lane], columns, 2)


@thorough
def test_third_derivatives_of_impact_log():
    order = ("forward", "reverse", "forward")
    found = jax.jit(jax.vmap(repeated(functools.partial(told, EXACT["Taylor"]), order)))(DROPS)
    for lane, (function, columns) in enumerate(CLOSED):
        check(found[lane], function, DROPS[lane], columns, 3)


@pytest.mark.parametrize("order", orders(3), ids="-".join)
def test_third_derivatives_of_a_polynomial(order):
    """By its coefficients, its argument and a delay of value zero, with the rule of its own."""

    def own(x):
        return polynomial(x[:4], x[4], x[5])[None]

    def plain(x):
        w = x[4] - x[5]
        return (x[0] + w * (x[1] + w * (x[2] + w * x[3])))[None]

    at = jnp.array([0.3, -1.2, 0.7, 2.0, 0.6, 0.0])
    expected = repeated(plain, ["forward"] * 3)(at)
    found = jax.jit(repeated(own, order))(at)
    np.testing.assert_allclose(found, expected, atol=1e-13)
