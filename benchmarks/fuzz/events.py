"""The first event in a step, and its time."""

from .compiled import compiled
from .falls import Event, clearance_at, fall_in, last_fall, passes
from .guards import (
    FORCE_FALLS,
    FORCE_RISES,
    IMPACT,
    NOTHING,
    SLIP,
    SURFACE,
    TURN,
    guard,
    is_held,
    slope,
)
from .physics import ABSENT, HAS_DRY, LAWS, SEPARATIONS
from .stepping import CONTACT, DETACHED, FLIGHT, NODES, after


@compiled
def first_event(kinds, p, step, largest):
    """The first event in a step; `largest` is the largest speed so far."""
    found = slip_or_turn(kinds, p, step, largest)
    if step.m[0] == FLIGHT:
        return impact_or(kinds, p, step, found)
    found = surface_or(kinds, p, step, found)
    if kinds[SEPARATIONS + step.m[1]] == 1:
        found = force_or(kinds, p, step, found)
    return found


@compiled
def slip_or_turn(kinds, p, step, largest):
    """The slip of a mass that friction holds, or the turn that ends a step; shares 2 if none."""
    if is_held(kinds, step.m):
        share = fall_in(kinds, p, step, SLIP)
        if share <= 1:
            return Event(SLIP, step.m[1], share, share)
    elif step.turned > 0 and (
        kinds[HAS_DRY] == 1 or (step.m[0] == CONTACT and step.speed > 1e-9 * largest)
    ):
        return Event(TURN, step.m[1], step.turns[0], step.turns[0])
    return Event(NOTHING, 0, 2.0, 2.0)


@compiled
def impact_or(kinds, p, step, found):
    """The first impact of a flight unless `found` is earlier."""
    for i in range(2):
        if kinds[LAWS + i] != ABSENT and not is_held(kinds, step.m):
            low, high = passes(p, step, i, -1)
            if high <= found.high and high <= 1:
                found = Event(IMPACT, i, low, high)
    return found


@compiled
def surface_or(kinds, p, step, found):
    """The passage of the surface, where this ends a phase of contact, unless `found` is earlier."""
    stop = step.m[1]
    if kinds[SEPARATIONS + stop] == (1 if step.m[0] == DETACHED else 0):
        low, high = passes(p, step, stop, 1)
        if high <= found.high and high <= 1 and not is_held(kinds, step.m):
            return Event(SURFACE, stop, low, high)
    return found


@compiled
def force_or(kinds, p, step, found):
    """The change of the force's sign, or the surface before it, unless `found` is earlier."""
    stop = step.m[1]
    kind = FORCE_FALLS if step.m[0] == CONTACT else FORCE_RISES
    share = fall_in(kinds, p, step, kind)
    if share > 1 and step.m[0] == CONTACT and not is_held(kinds, step.m):
        low, high = passes(p, step, stop, 1)
        if high <= found.high and high <= 1:
            share = last_fall(kinds, p, step, low, high)
            if share > 1:
                found = Event(SURFACE, stop, low, high)
    if share < found.high:
        return Event(kind, stop, share, share)
    return found


@compiled
def until(kinds, p, step, event):
    """The complex time after the beginning of a step at which an event happens."""
    h, low, high = step.h, event.low, event.high
    if low == high:
        low, high = max(low - 0.5 / NODES, 0.0), min(high + 0.5 / NODES, 1.0)
        return polished(kinds, p, step, event, event.low * h, low * h, high * h)
    a, b = low, high
    sign = -1.0 if event.kind == IMPACT else 1.0
    for _ in range(45):
        c = 0.5 * (a + b)
        if sign * clearance_at(p, step, event.stop, c) > 0:
            b = c
        else:
            a = c
    return polished(kinds, p, step, event, b * h, low * h, high * h)


@compiled
def polished(kinds, p, step, event, guess, low, high):
    """The time of an event by Newton's method from a guess, with steps of its own."""
    s = complex(guess)
    t, y, m = step.t, step.y, (step.m[0], event.stop, step.m[2])
    for _ in range(30):
        at = after(kinds, p, step.m, t, y, s)
        value = guard(kinds, p, m, event.kind, t + s, at)
        if event.kind in (IMPACT, SURFACE, TURN):
            rate = slope(kinds, p, m, event.kind, t + s, at)
        else:
            d = 1e-5 * (high - low) + 1e-12
            up = guard(kinds, p, m, event.kind, t + s + d, after(kinds, p, step.m, t, y, s + d))
            down = guard(kinds, p, m, event.kind, t + s - d, after(kinds, p, step.m, t, y, s - d))
            rate = (up - down) / (2 * d)
        if rate == 0:
            return s
        change = value / rate
        s -= change
        if s.real < low or s.real > high:
            s = complex(min(max(s.real, low), high), s.imag)
        if abs(change.real) < 1e-16 * (1 + abs(t.real)) + 1e-15 * abs(s.real):
            # once more, so that the derivative is that of the root
            value = guard(kinds, p, m, event.kind, t + s, after(kinds, p, step.m, t, y, s))
            return complex(s.real, (s - value / rate).imag)
    return s
