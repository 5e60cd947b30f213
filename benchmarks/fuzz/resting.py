"""Rests on a rigid stop: the chatter that ends in one, and the release that ends it."""

import numpy as np

from .compiled import compiled
from .guards import holding
from .physics import (
    ABSENT,
    DRY,
    FREQUENCY,
    HAS_BASE,
    HAS_DRY,
    LAWS,
    free,
    lever,
    place,
    restitution,
    side,
)


@compiled
def series(kinds, p, stop, t, u, fastest):
    """Tell whether the rest of a chatter is a geometric series to the last digit, and its length.

    `u` is the separation speed at the time t, `fastest` that of the fastest impact.
    """
    friction = p[DRY] if kinds[HAS_DRY] == 1 else 0.0j
    here = place(p, stop)
    push = -side(stop) * free(kinds, p, t, here, 0.0j)
    if u.real <= 0 or u.real > 1e-5 * fastest or push.real <= friction.real:
        return False, 0.0j
    loss = np.sqrt((push - friction) / (push + friction))
    r = restitution(kinds, p, stop, lever(kinds, p) * u * loss)
    rest = restitution(kinds, p, stop, 1e-9 * lever(kinds, p) * u)
    ratio = r * loss
    if ratio.real >= 1 or ratio.real < 0:
        return False, 0.0j
    flight = u / (push + friction) + u * loss / (push - friction)
    length = flight / (1 - ratio)
    height = (u**2 / (2 * push)).real
    other = 1 - stop
    if kinds[LAWS + other] != ABSENT and height > 0.5 * abs((place(p, other) - here).real):
        return False, 0.0j
    change = max(
        abs((r - rest).real) / (1 - ratio.real),
        change_of_push(kinds, p, stop, t, length, height, u.real, friction),
    )
    return length.real * change < 1e-13 and u.real * change < 1e-13 * fastest, length


@compiled
def small_series(kinds, p, stop, t, u):
    """Length of the chatter of a small r, after a separation at a complex speed whose real part is
    zero; none where dry friction would hold the mass above the stop.
    """
    friction = p[DRY] if kinds[HAS_DRY] == 1 else 0.0j
    push = -side(stop) * free(kinds, p, t, place(p, stop), 0.0j)
    if push.real <= friction.real:
        return 0.0j
    loss = np.sqrt((push - friction) / (push + friction))
    return u / (push + friction) + u * loss / (push - friction)


@compiled
def change_of_push(kinds, p, stop, t, length, height, speed, friction):
    """Largest relative change of the push onto a stop over the times, heights and speeds of a
    chatter.
    """
    here, sign = place(p, stop), side(stop)
    push = -sign * free(kinds, p, t, here, 0.0j)
    change = 0.0
    for i in range(1, 9):
        later = -sign * free(kinds, p, t + length * (i / 8), here, 0.0j)
        change = max(change, abs((later - push).real / (push - friction).real))
    for i in range(4):
        x = here + (height * sign if i % 2 == 0 else 0.0)
        v = speed if i < 2 else -speed
        other = -sign * free(kinds, p, t, x, v + 0.0j)
        change = max(change, abs((other - push).real / (push - friction).real))
    return change


@compiled
def least_hold(kinds, p, stop, a, b):
    """Time between a and b at which what keeps a mass on a stop has a minimum."""
    for _ in range(80):
        c, d = a + 0.382 * (b - a), a + 0.618 * (b - a)
        if holding(kinds, p, stop, complex(c)).real < holding(kinds, p, stop, complex(d)).real:
            b = d
        else:
            a = c
    return b


@compiled
def release_between(kinds, p, stop, a, b, width):
    """Complex time between a and b at which a stop lets go; the slope is of a part of `width`."""
    for _ in range(200):
        c = 0.5 * (a + b)
        if holding(kinds, p, stop, complex(c)).real >= 0:
            a = c
        else:
            b = c
    root = complex(b)
    d = 1e-4 * width
    change = (holding(kinds, p, stop, root + d) - holding(kinds, p, stop, root - d)).real
    slope = change / (2 * d)
    for _ in range(3):
        root -= 1j * holding(kinds, p, stop, root).imag / slope
    return root


@compiled
def release(kinds, p, stop, t, end):
    """Time at which a mass that rests on a rigid stop is let go, and whether before the end."""
    if kinds[HAS_BASE] == 0:
        return complex(end), False
    width = 2 * np.pi / p[FREQUENCY].real / 100
    low, before = t.real, holding(kinds, p, stop, t).real
    older = before
    while low < end:
        high = min(low + width, end)
        now = holding(kinds, p, stop, complex(high)).real
        a, b, least = low, high, now
        if now >= 0 and before < now and before <= older:  # a dip
            a = max(low - width, t.real)
            b = least_hold(kinds, p, stop, a, high)
            least = holding(kinds, p, stop, complex(b)).real
        if least < 0:
            return release_between(kinds, p, stop, a, b, width), True
        older, before, low = before, now, high
    return complex(end), False
