"""Falls of a guard that are events: on a clock, whose guards are polynomials of time."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from hybrid_systems import Clock

EVENTS = 6


@jax.jit
@jax.vmap
def falls(roots_or_coefficients):
    start, ts = ij.Start(0.0, jnp.zeros(1)), jnp.array([2.5, 5.0])
    return ij.solve(Clock(roots_or_coefficients), start, ts, max_events=EVENTS, max_steps=512)


def polynomial(*roots, sign=1.0, lift=0.0):
    """Σ cₖ tᵏ of fourth order with these roots, plus `lift`."""
    own = sign * np.atleast_1d(np.poly(roots))
    own[-1] += lift
    return np.concatenate([np.zeros(5 - own.size), own])


GUARDS = {  # polynomial and the times of its falls after t = 0
    "one fall": (polynomial(1.0, sign=-1.0), [1.0]),
    "negative at the start": (polynomial(-1.0, sign=-1.0), []),
    "negative at the start, rises and falls": (polynomial(1.0, 3.0, sign=-1.0), [3.0]),
    "falls, rises and falls": (polynomial(1.0, 2.0, 4.0, sign=-1.0), [1.0, 4.0]),
    "falls twice in a thousandth": (polynomial(1.0, 1.001, 1.002, sign=-1.0), [1.0, 1.002]),
    "falls and rises at once": (polynomial(2.0, 2.0 + 1e-4), [2.0]),
    "just missed": (polynomial(2.0, 2.0, lift=1e-12), []),
    "at the start": (polynomial(0.0, sign=-1.0), [0.0]),
    "zero at the start and rises": (polynomial(0.0, 3.0, sign=-1.0), [3.0]),
    "always zero": (np.zeros(5), []),
    "always one": (polynomial(), []),
    "four falls and rises": (polynomial(0.5, 1.5, 3.0, 4.5), [0.5, 3.0]),
}


@pytest.fixture(scope="module")
def found():
    return falls(jnp.array([coefficients for coefficients, _ in GUARDS.values()]))


@pytest.mark.parametrize("name", GUARDS)
def test_falls(found, name):
    own = jax.tree.map(lambda x: x[list(GUARDS).index(name)], found)
    times = np.array(GUARDS[name][1])
    assert own.result == ij.RESULTS.successful
    assert own.events.count == times.size
    np.testing.assert_allclose(own.events.t[: times.size], times, rtol=1e-8, atol=1e-12)
    np.testing.assert_array_equal(own.ys[:, 0], [np.sum(times <= t) for t in own.ts])


def test_just_touched():
    """A double root is one event or none, as rounding decides, and the run goes on."""
    own = falls(jnp.array([polynomial(2.0, 2.0, lift=lift) for lift in (0.0, -1e-16, 1e-16)]))
    assert np.all(own.result == ij.RESULTS.successful)
    assert np.all(own.events.count <= 1)
    assert np.all(np.isnan(own.events.t[:, 0]) | (np.abs(own.events.t[:, 0] - 2.0) < 1e-6))


def counted(number):
    return lambda t, y, args: y.at[number].add(1.0)


def wave(t, y, args):
    return jnp.cos(args["omega"] * t + args["phase"])


DIRECTIONS = [
    ij.Reset(wave, counted(number), direction=direction)
    for number, direction in enumerate((True, False, None))
]
STILL = diffrax.ODETerm(lambda t, y, args: jnp.zeros_like(y))


@pytest.mark.parametrize("solver", [ij.TaylorStep(order=12), diffrax.Tsit5()])
def test_directions_that_pass_without_reset(solver):
    """Rises, falls and both of a cosine, each counted at its own times."""

    def run(phase):
        return ij.solve_events(
            STILL,
            solver,
            0.0,
            6.0,
            jnp.zeros(3),
            {"omega": 2.0, "phase": phase},
            events=DIRECTIONS,
            max_events=16,
            max_steps=512,
        )

    phases = jnp.array([0.1, 2.0, 4.0])
    own = jax.jit(jax.vmap(run))(phases)
    for phase, counts in zip(phases, own.ys[:, -1], strict=True):
        zeros = (np.arange(-2, 8) + 0.5) * np.pi
        inside = (zeros > phase) & (zeros < 12 + phase)
        rises = np.sin(zeros) < 0
        np.testing.assert_array_equal(
            counts, [np.sum(inside & rises), np.sum(inside & ~rises), np.sum(inside)]
        )
    assert np.all(own.result == ij.RESULTS.successful)


@pytest.mark.parametrize("direction", [None, True])
@pytest.mark.parametrize("solver", [ij.TaylorStep(order=8), diffrax.Tsit5()])
def test_reflection_from_below(solver, direction):
    """A ball thrown up at a ceiling at x = 0 with x″ = 1 and r = 1/2, and again."""

    def reflected(t, y, args):
        return y * jnp.array([1.0, -0.5])

    own = ij.solve_events(
        diffrax.ODETerm(lambda t, y, args: jnp.stack([y[1], jnp.ones_like(t)])),
        solver,
        0.0,
        2.25,
        jnp.array([-0.5, 0.0]),
        events=[ij.Reset(lambda t, y, args: y[0], reflected, direction=direction)],
        max_events=4,
        max_steps=128,
    )
    np.testing.assert_allclose(own.events.t, [1.0, 2.0, np.nan, np.nan], rtol=1e-8)
    np.testing.assert_allclose(own.ys[-1], [-1 / 32, 0.0], atol=1e-7)


class Balls(ij.HybridSystem):
    """Two balls that do not touch each other; all flights are parabolas."""

    restitution: jax.Array

    def flow(self, t, y, mode):
        return {"x": y["v"], "v": -jnp.ones(2)}

    def transitions(self):
        return [self.impact(0), self.impact(1)]

    def impact(self, own):
        def bounce(t, y, mode):
            return {**y, "v": y["v"].at[own].multiply(-self.restitution)}, mode

        return ij.Transition(lambda t, y, mode: y["x"][own], bounce)


@pytest.mark.parametrize("step", [None, ij.RungeKutta()])
def test_an_event_does_not_draw_another_one_near(step):
    """Exact flights allow steps of any length: the guard of the other ball is then not zero."""
    apart = 1e-3
    heights = jnp.array([0.5, 0.5 * (1 + apart) ** 2])
    start = ij.Start(0.0, {"x": heights, "v": jnp.zeros(2)})
    own = ij.solve(Balls(jnp.array(0.5)), start, jnp.array([2.4]), step=step, max_events=6)
    falls = [1.0, 1 + apart, 2.0, 2 * (1 + apart), np.nan, np.nan]
    np.testing.assert_allclose(own.events.t, falls, rtol=1e-8)
    np.testing.assert_array_equal(own.events.transition, [0, 1, 0, 1, -1, -1])
