"""Branch of orbits with a complete chatter: a ball on a vibrating table, which comes to rest on it.

Release from rest resets the motion, so that all later impacts follow from the amplitude alone, by
flights in closed form.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from mpmath import mp
from scipy import optimize

import impactjax as ij
from impactjax._hybrid.equations import Equations
from tiers import mostly_thorough, quick

G, R, OMEGA = 9.80665, 0.4, 2 * np.pi * 5.0
FLYING, RESTING = jnp.int32(0), jnp.int32(1)
ONSET = 1.756897373473  # ratio at which a chatter ends just at the next release


class Table(ij.HybridSystem):
    """Height of a ball above a table that moves by A sin ωt.

    - `ratio`: A ω² / g.
    - `longest`: duration from which on a series is summed [s].
    """

    ratio: jax.Array
    longest: jax.Array

    def push(self, t):
        return G * (1 - self.ratio * jnp.sin(OMEGA * t))

    def flow(self, t, y, mode):
        flies = mode == FLYING
        zero = jnp.zeros_like(y["v"])
        return {"x": jnp.where(flies, y["v"], zero), "v": jnp.where(flies, -self.push(t), zero)}

    def transitions(self):
        def guard(t, y, mode):
            return jnp.where(mode == FLYING, y["x"], self.push(t))

        def jump(t, y, mode):
            del t, mode
            return {"x": y["x"], "v": -R * y["v"]}, FLYING

        def tail(t, y, mode):
            del mode
            fall = self.push(t)
            duration = 2 * y["v"] / (fall * (1 - R))
            holds = (fall > 0) & (y["v"] > 0) & (duration < self.longest)
            return ij.Tail(holds, duration, jax.tree.map(jnp.zeros_like, y), RESTING)

        return [ij.Transition(guard, jump, tail)]


def system(longest):
    return Table(jnp.asarray(1.25), jnp.asarray(longest))


def times(ratio, count):
    """Release, and the first impacts after it, from flights in closed form."""
    t, speed = np.arcsin(1 / ratio) / OMEGA, 0.0
    found = [t]
    for _ in range(count - 1):

        def height(s, t=t, speed=speed):
            """Height of the ball above the table, a time s after it has left it."""
            rate = speed + ratio * G / OMEGA * np.cos(OMEGA * t)
            moved = ratio * G / OMEGA**2 * (np.sin(OMEGA * (t + s)) - np.sin(OMEGA * t))
            return rate * s - G * s**2 / 2 - moved

        grid = np.linspace(0.0, 0.3, 300_001)[20:]
        (below,) = np.nonzero(height(grid) < 0)
        last = grid[below[0]]
        s = float(np.asarray(optimize.brentq(height, last - 1e-6, last, xtol=1e-16)))
        rate = speed + ratio * G / OMEGA * (np.cos(OMEGA * t) - np.cos(OMEGA * (t + s))) - G * s
        t, speed = t + s, -R * rate
        found.append(t)
    return np.array(found)


def flight(ratio, t, speed, s):
    """Duration of a flight from time t, and the relative speed at its end, by 120 digits: Newton's
    method from a guess s for the height over the duration. `None` if it does not converge.
    """
    g, w = mp.mpf("9.80665"), 10 * mp.pi
    for _ in range(60):
        turned = w * (mp.cos(w * (t + s)) - mp.cos(w * t))
        bent = mp.sin(w * (t + s)) - mp.sin(w * t) - w * s * mp.cos(w * t)
        height = speed - g * s / 2 - ratio * g * bent / (w**2 * s)
        step = height / (-g / 2 - ratio * g * (turned * s - bent) / (w * s) ** 2)
        s -= step
        if abs(step) < mp.mpf(10) ** -30 * s:
            return s, speed - ratio * g / w**2 * turned - g * s
    return None


def comes_to_rest(ratio):
    """True if the chatter after a release ends before the next one; then the next flight would be
    shorter than 10⁻³⁰ s.
    """
    g, r, w = mp.mpf("9.80665"), mp.mpf("0.4"), 10 * mp.pi
    release = mp.asin(1 / ratio) / w
    t, speed, guess = release, mp.mpf(0), mp.mpf("0.13")
    while guess > mp.mpf(10) ** -30:
        found = flight(ratio, t, speed, guess)
        if found is None or t + found[0] > release + 2 * mp.pi / w:
            return False
        t, speed = t + found[0], -r * found[1]
        guess = 2 * speed / (g * (1 - ratio * mp.sin(w * t)))
    return True


@quick
def test_onset_of_sticking():
    with mp.workdps(120):
        assert comes_to_rest(mp.mpf(ONSET) - mp.mpf("1e-11"))
        assert not comes_to_rest(mp.mpf(ONSET) + mp.mpf("1e-11"))


@quick
@pytest.mark.parametrize(
    ("speed", "towards", "sums"),
    [
        pytest.param(1e-6, None, True, id="short series"),
        pytest.param(1e-3, None, False, id="long series"),
        pytest.param(1e-3, RESTING, True, id="long series of an orbit that rests"),
        pytest.param(1e-6, FLYING, False, id="short series of an orbit that flies on"),
    ],
)
def test_series_is_summed_where_the_orbit_rests(speed, towards, sums):
    with jax.enable_x64(True):
        before = {"x": jnp.zeros(()), "v": jnp.asarray(-speed / R)}
        jump = Equations(system(1e-5)).jump(jnp.int32(0), jnp.zeros(()), before, FLYING, towards)
        assert int(jump.mode) == int(RESTING if sums else FLYING)
        expected = 2 * speed / (G * (1 - R)) if sums else 0.0
        np.testing.assert_allclose(jump.wait, expected, rtol=1e-12)


@pytest.mark.parametrize("longest", mostly_thorough([1e-5, 1e-6, 1e-8, 1e-10], 1e-5))
def test_branch_with_complete_chatter_ends_at_the_onset_of_sticking(longest):
    start = ij.Start(0.0, {"x": jnp.asarray(0.01), "v": jnp.asarray(0.0)}, FLYING)
    orbit = ij.periodic_orbit(system(longest), start, 2 * np.pi / OMEGA, settle=5)
    np.testing.assert_allclose(np.abs(orbit.multipliers), 0.0, atol=1e-12)
    branch = ij.follow(orbit, lambda each: each.ratio, (1.15, 3.0), longest=0.3)
    assert branch.complete
    end, onset = branch.special
    assert (end.kind, onset.kind) == ("end of the range", "onset of sticking")
    assert onset.parameter == pytest.approx(ONSET, abs=10 * longest)
    for index in (0, -1):
        found = branch.t[index]
        np.testing.assert_allclose(found[:8], times(branch.parameter[index], 8), atol=1e-9)
    first = np.argmin(np.abs(branch.parameter - 1.25))
    assert 0 < branch.summed[0] < branch.summed[first] < longest < branch.summed[-1]
    with pytest.raises(ValueError, match="there are curves of folds"):
        ij.special_curve(onset, lambda each: each.longest, (0.0, 1.0), (1.0, 3.0))
