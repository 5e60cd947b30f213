"""A forced linear oscillator against a stop, impact by impact, in closed form and NumPy alone.

x″ + 2 ζ x′ + x = F sin Ωt above x = −gap, v⁺ = −r v⁻. Flights are looked at on a dense grid, where
each crossing and each local minimum is refined.
"""

from typing import NamedTuple

import numpy as np

GRID = 40  # points a radian of the fastest motion


class Forced(NamedTuple):
    """Parameters of many lanes, each of shape (lanes,)."""

    zeta: np.ndarray
    force: np.ndarray
    frequency: np.ndarray
    r: np.ndarray
    gap: np.ndarray
    position: np.ndarray
    velocity: np.ndarray


def steady(lanes: Forced) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients P, Q of the steady motion P sin Ωt + Q cos Ωt."""
    stiff = 1 - lanes.frequency**2
    loss = 2 * lanes.zeta * lanes.frequency
    norm = stiff**2 + loss**2
    return lanes.force * stiff / norm, -lanes.force * loss / norm


def motion(lanes: Forced, t0, x0, v0, s):
    """Position and velocity a time `s` after a flight began; lanes lead."""
    p, q = steady(lanes)
    w = lanes.frequency

    def column(values):
        return values.reshape(values.shape + (1,) * (s.ndim - 1))

    p, q, w, zeta = column(p), column(q), column(w), column(lanes.zeta)
    begin = column(t0)
    rate = np.sqrt(1 - zeta**2)
    a = column(x0) - (p * np.sin(w * begin) + q * np.cos(w * begin))
    u = column(v0) - w * (p * np.cos(w * begin) - q * np.sin(w * begin))
    b = (u + zeta * a) / rate
    fade, c, d = np.exp(-zeta * s), np.cos(rate * s), np.sin(rate * s)
    t = begin + s
    x = fade * (a * c + b * d) + p * np.sin(w * t) + q * np.cos(w * t)
    v = fade * ((rate * b - zeta * a) * c - (rate * a + zeta * b) * d)
    return x, v + w * (p * np.cos(w * t) - q * np.sin(w * t))


def next_impact(lanes: Forced, t0, x0, v0, horizon):
    """Time to the next impact and the velocity then; infinite where there is none in time."""
    size = int(GRID * horizon * max(1.0, lanes.frequency.max()))
    s = np.broadcast_to(np.linspace(0, horizon, size), (len(t0), size))
    x, v = motion(lanes, t0, x0, v0, s)
    clear = x + lanes.gap[:, None]
    crosses = (clear[:, 1:] < 0) & (clear[:, :-1] >= 0)
    crosses[:, 0] = clear[:, 1] < 0  # a flight begins on the stop
    turns = (v[:, :-1] < 0) & (v[:, 1:] >= 0) & (clear[:, :-1] > 0) & (clear[:, 1:] > 0)
    # a dip between two points of the grid is no deeper than speed times half the interval
    dips = turns & (np.minimum(clear[:, :-1], clear[:, 1:]) < np.abs(v[:, :-1]) * horizon / size)
    found = np.full(len(t0), np.inf)
    candidates = crosses | dips
    while (open_lanes := np.flatnonzero(candidates.any(1) & np.isinf(found))).size:
        k = candidates[open_lanes].argmax(1)
        own = Forced(*(column[open_lanes] for column in lanes))
        start = t0[open_lanes], x0[open_lanes], v0[open_lanes]
        low, high = s[open_lanes, k], s[open_lanes, k + 1]
        found[open_lanes] = _first_zero(own, start, low, high, dips[open_lanes, k])
        candidates[open_lanes, k] = False
    hit = np.where(np.isfinite(found), found, 0.0)
    return found, motion(lanes, t0, x0, v0, hit[:, None])[1][:, 0]


def _first_zero(lanes: Forced, start, low, high, dips):
    """First contact of each lane with the stop in its interval; infinite where it only turns."""

    def at(s):
        x, v = motion(lanes, start[0], start[1], start[2], s[:, None])
        return x[:, 0] + lanes.gap, v[:, 0]

    falls, bottom = low, high
    for _ in range(60):
        middle = (falls + bottom) / 2
        falling = at(middle)[1] < 0
        falls, bottom = np.where(falling, middle, falls), np.where(falling, bottom, middle)
    turns_above = dips & (at(bottom)[0] >= 0)
    high = np.where(dips, bottom, high)
    for _ in range(60):
        middle = (low + high) / 2
        # on the stop itself a flight has just begun: what counts is where it comes down
        inside = at(middle)[0] < 0
        low, high = np.where(inside, low, middle), np.where(inside, middle, high)
    return np.where(turns_above, np.inf, (low + high) / 2)


def impacts(lanes: Forced, end: float, count: int):
    """Times and approach speeds of the first `count` impacts, infinite and zero beyond the end."""
    n = len(lanes.r)
    times, speeds = np.full((n, count), np.inf), np.zeros((n, count))
    t, x, v = np.zeros(n), lanes.position.copy(), lanes.velocity.copy()
    going = np.ones(n, bool)
    for k in range(count):
        rows = np.flatnonzero(going)
        if rows.size == 0:
            break
        own = Forced(*(column[rows] for column in lanes))
        wait, velocity = next_impact(own, t[rows], x[rows], v[rows], end - t[rows].min())
        reached = t[rows] + wait
        hits = reached <= end
        times[rows[hits], k], speeds[rows[hits], k] = reached[hits], -velocity[hits]
        t[rows], x[rows] = np.where(hits, reached, t[rows]), -own.gap
        v[rows] = -own.r * velocity
        going[rows[~hits]] = False
        slow = speeds[rows, k] < SLOW * speeds[rows].max(1)
        going[rows[slow]] = False
    return times, speeds


SLOW = 4e-3  # relative speed below which impacts are not followed
