"""Ten thousand random forced runs, half of them near grazing: none missed, none invented."""

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from forced import SLOW, Forced, impacts, steady
from tiers import thorough

LANES, END, COUNT, TOGETHER = 10_000, 12.0, 16, 100
TOLERANCE = 1e-10
ROUNDING = 100 * TOLERANCE  # error of a state, generously


def drawn() -> Forced:
    rng = np.random.default_rng(7)
    zeta = rng.uniform(0.0, 0.1, LANES)
    frequency = rng.uniform(0.3, 4.0, LANES)
    force = rng.uniform(0.05, 2.0, LANES)
    r = rng.uniform(0.3, 0.95, LANES)
    gap = rng.uniform(-0.1, 1.0, LANES)
    position = -gap + rng.uniform(0.05, 1.0, LANES)
    velocity = rng.uniform(-1.0, 1.0, LANES)
    lanes = Forced(zeta, force, frequency, r, gap, position, velocity)
    # the second half moves in its steady state and misses or touches the stop by a hair
    p, q = steady(lanes)
    hair = 1 + rng.choice([-1, 1], LANES) * 10.0 ** rng.uniform(-6, -2, LANES)
    graze = np.arange(LANES) >= LANES // 2
    return lanes._replace(
        gap=np.where(graze, np.hypot(p, q) * hair, gap),
        position=np.where(graze, q, position),
        velocity=np.where(graze, p * frequency, velocity),
    )


def simulated(lane: Forced):
    def run(state):
        base = ij.HarmonicMotion(lane.force / lane.frequency**2, lane.frequency)
        oscillator = ij.LinearOscillator(1.0, lane.zeta, base=base)
        model = ij.ImpactOscillator(oscillator, ij.Stop(ij.Restitution(lane.r), lane.gap))
        return ij.simulate(
            model,
            ij.InitialState(*state),
            jnp.array([0.0, END]),
            tolerance=TOLERANCE,
            max_steps=256,
            max_impacts=COUNT,
        )

    state = jnp.stack([lane.position, lane.velocity])
    times, pull = jax.linearize(lambda state: run(state).impacts.time, state)
    slopes = jnp.stack([pull(unit) for unit in jnp.eye(2)])
    return times, run(state).impacts.count, jnp.sum(jnp.abs(slopes), axis=0)


@thorough
def test_forced_runs_have_exactly_the_reference_impacts():
    lanes = drawn()
    arrays = jax.tree.map(jnp.asarray, lanes)
    batch = jax.jit(lambda lanes: jax.lax.map(simulated, lanes, batch_size=TOGETHER))
    times, count, sensitivity = jax.tree.map(np.asarray, batch(arrays))
    exact, exact_speeds = impacts(lanes, END, COUNT)
    happens = np.isfinite(exact)
    ours = np.where(np.arange(COUNT) < count[:, None], times, np.inf)
    fastest = np.maximum.accumulate(exact_speeds, axis=1)
    slow = np.cumsum(happens & (exact_speeds < SLOW * fastest), axis=1) > 0
    unstable = _from_the_next(np.isfinite(ours) & (ROUNDING * sensitivity > 1e-3))
    followed = ~slow & ~unstable
    assert np.all(np.isfinite(ours)[followed] == happens[followed])
    both = followed & happens
    apart = np.abs(np.where(both, exact, 0.0) - np.where(both, ours, 0.0))
    nearly_grazing = 1e-12 / np.maximum(exact_speeds, 1e-9) ** 2
    assert np.all(apart[both] <= (1e-8 + ROUNDING * sensitivity + nearly_grazing)[both])
    # nothing is dropped in silence: what was compared, and what was told apart
    assert both.sum() > 1.5 * LANES
    assert (unstable & happens).sum() < 0.05 * both.sum()


def _from_the_next(marked):
    """All columns after the first that is marked."""
    reached = np.cumsum(marked, axis=1) > 0
    return np.concatenate([np.zeros((LANES, 1), bool), reached[:, :-1]], axis=1)
