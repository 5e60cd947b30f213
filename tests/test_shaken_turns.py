"""Nearest miss, deepest penetration and peak force of a shaken oscillator, in closed form."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from tiers import thorough
from turns import check

# A linear oscillator on a shaken base, in flight or in one contact from its start: a mass on a
# linear spring and dashpot in both, in closed form, with several turns in a step or a contact.

MASS, OMEGA, ZETA = 0.3, 2.0, 0.01
SHAKEN = ("omega0", "gamma", "amplitude", "frequency", "phase", "position", "velocity", "end")
FAR = 20.0


def shaken(order, tolerance, gap, parameters):
    omega0, gamma, amplitude, frequency, phase, x, v, end = parameters
    base = ij.HarmonicMotion(amplitude, frequency, phase)
    oscillator = ij.LinearOscillator(OMEGA, ZETA, mass=MASS, base=base)
    run = ij.simulate(
        ij.ImpactOscillator(oscillator, ij.Stop(ij.KelvinVoigt(omega0, gamma), gap)),
        ij.InitialState(x, v),
        end[None],
        t0=0.0,
        step=ij.TaylorStep(order),
        tolerance=tolerance,
        max_steps=512,
        max_impacts=8,
    )
    found = jnp.stack([run.nearest_miss, run.deepest_penetration[0], run.peak_force[0]])
    return jnp.where(run.result == ij.RESULTS.successful, found, jnp.nan)


def driven(parameters, touching, t):
    """Position and velocity at time t."""
    omega0, gamma, amplitude, frequency, phase, x, v, _ = parameters
    stiffness = OMEGA**2 + jnp.where(touching, omega0**2, 0.0)
    damping = 2 * ZETA * OMEGA + jnp.where(touching, 2 * gamma * omega0, 0.0)
    response = _complex(amplitude * frequency**2)
    response /= jax.lax.complex(stiffness - frequency**2, damping * frequency)

    def forced(t):
        turning = response * jnp.exp(jax.lax.complex(0.0 * t, frequency * t + phase))
        return turning.imag, frequency * turning.real

    (x0, v0), (xt, vt) = forced(jnp.zeros(())), forced(t)
    x, v = x - x0, v - v0
    half = _complex(-damping / 2)
    root = jnp.sqrt(_complex(damping**2 / 4 - stiffness))
    one, other = half + root, half - root
    x, v = _complex(x), _complex(v)
    first, second = (v - other * x) / (2 * root), (one * x - v) / (2 * root)
    first, second = (c * jnp.exp(rate * _complex(t)) for c, rate in ((first, one), (second, other)))
    return xt + (first + second).real, vt + (one * first + other * second).real


def _complex(x):
    return jax.lax.complex(x, jnp.zeros_like(x))


def levels(parameters, touching, t):
    """Levels whose maxima are the nearest miss, the deepest penetration and the peak force."""
    x, v = driven(parameters, touching, t)
    omega0, gamma = parameters[:2]
    return jnp.stack([-x, -x, -MASS * omega0 * (omega0 * x + 2 * gamma * v)])


def highest(which, parameters, touching):
    """The highest level and its derivatives, with the time held: it is a turn, or an end that is
    given. In flight the start does not count.
    """

    def level(p, t):
        return levels(p, touching, t)[which]

    rate = jax.grad(level, 1)
    ts = jnp.linspace(0.0, parameters[-1], 4001)
    x = jax.vmap(lambda t: driven(parameters, touching, t)[0])(ts)
    inside = ~touching | (jnp.cumsum((x > 0) & (ts > 0)) == 0)  # until the contact ends
    rates = jax.vmap(rate, (None, 0))(parameters, ts)
    last = (jnp.arange(4001) == 4000) & (rates > 0)
    falls = jnp.append((rates[:-1] > 0) & (rates[1:] <= 0), jnp.zeros((), bool))
    first = (jnp.arange(4001) == 0) & touching
    heights = jax.vmap(level, (None, 0))(parameters, ts)
    best = jnp.argmax(jnp.where(inside & (falls | last | first), heights, -jnp.inf))

    def halved(_, bracket):
        low, high = bracket
        middle = (low + high) / 2
        rises = rate(parameters, middle) > 0
        return jnp.where(rises, middle, low), jnp.where(rises, high, middle)

    bracket = ts[best], jnp.where(falls[best], ts[jnp.minimum(best + 1, 4000)], ts[best])
    turn = jax.lax.fori_loop(0, 60, halved, bracket)[1]
    slope = jax.grad(level)(parameters, turn)
    by_end = jnp.where(last[best], rate(parameters, turn), 0.0)
    turns = jnp.sum(inside & falls)
    return level(parameters, turn), slope.at[-1].add(by_end), turns


def shaken_lanes():
    """16 flights and 48 contacts, in half of which little shakes and much is damped."""
    draw = np.random.default_rng(5).uniform
    flies, quiet = np.arange(64) < 16, np.arange(64) >= 40
    omega0 = draw(15.0, 25.0, 64)
    gamma = np.where(quiet, draw(0.2, 1.2, 64), draw(0.02, 0.3, 64))
    slow, fast = draw(6.0, 10.0, 64), draw(120.0, 160.0, 64)
    frequency = np.where(flies | quiet, slow, fast)
    amplitude = np.where(flies, 0.3, np.where(quiet, 0.0, 0.9 / frequency))
    start = np.where(flies, draw(-2.0, 2.0, 64), 0.0)
    velocity = np.where(flies, draw(-2.0, 2.0, 64), -1.0)
    end = np.where(flies, draw(2.0, 3.0, 64), draw(0.2, 1.3, 64) * np.pi / omega0)
    lanes = omega0, gamma, amplitude, frequency, draw(0.0, 6.0, 64), start, velocity, end
    return jnp.stack(lanes, axis=1), flies


@pytest.fixture(scope="module")
def shaken_runs():
    """Values with derivatives by short steps, and values by steps of several turns."""
    lanes, flies = shaken_lanes()
    gaps = jnp.where(flies, FAR, 0.0)

    def short(gap, p):
        told = functools.partial(shaken, 8, 1e-11, gap)
        return told(p), jax.jacfwd(told)(p), jax.jacrev(told)(p)

    def long(gap, p):
        return shaken(24, 1e-5, gap, p)

    return [jax.jit(jax.vmap(each))(gaps, lanes) for each in (short, long)]


@thorough
@pytest.mark.parametrize("which", [0, 1, 2], ids=["nearest miss", "deepest penetration", "peak"])
def test_extremes_of_shaken_oscillator(shaken_runs, which):
    lanes, flies = shaken_lanes()
    chosen = flies if which == 0 else ~flies
    level, slope, turns = jax.jit(jax.vmap(lambda p, here: highest(which, p, here)))(lanes, ~flies)
    sign, far = (-1.0, FAR) if which == 0 else (1.0, 0.0)
    expected, slope = far + sign * level[chosen], sign * slope[chosen]
    assert np.sum(turns[chosen] >= 3) > 3  # the case has several turns
    short, long = shaken_runs
    value, *slopes = (np.asarray(x)[:, which][chosen] for x in short)
    # A contact begins where its mass is at the start: by this position slopes have two sides.
    smooth = np.array([which == 0 or name != "position" for name in SHAKEN])
    check([value, *(each[:, smooth] for each in slopes)], expected, slope[:, smooth], rtol=1e-8)
    np.testing.assert_allclose(long[:, which][chosen], expected, rtol=1e-4)
