"""Searches for one event between the nodes of a step's dense output."""

from typing import NamedTuple

import numpy as np

from .compiled import compiled
from .guards import clearance, guard
from .physics import place, side
from .stepping import NODES, component, inside, pushing


class Event(NamedTuple):
    """An event at a stop, between two shares of a step or, where these are equal, near them."""

    kind: int
    stop: int
    low: float
    high: float


@compiled
def clearance_at(p, step, stop, share):
    """Distance from a stop at a share of the step."""
    return side(stop) * ((step.y[3] - place(p, stop)) + component(step.y, step.f, share, 0)).real


@compiled
def value_at(kinds, p, step, event, share):
    """An event's guard at a share of the step."""
    at = inside(step.y, step.f, share)
    return guard(kinds, p, step.m, event, step.t + step.h * share, at).real


@compiled
def lowest(kinds, p, step, event, a, b):
    """Share of the step between a and b at which a guard has a minimum."""
    for _ in range(40):
        c, d = a + 0.382 * (b - a), a + 0.618 * (b - a)
        if value_at(kinds, p, step, event, c) < value_at(kinds, p, step, event, d):
            b = d
        else:
            a = c
    return a


@compiled
def positive_before(kinds, p, step, event, share):
    """A smaller share of the step at which a guard is positive; -1 if there is none."""
    for _ in range(30):
        share *= 0.5
        if value_at(kinds, p, step, event, share) > 0:
            return share
    return -1.0


@compiled
def fall_between(kinds, p, step, event, low, high):
    """Share of the step at which a guard falls through zero, by bisection."""
    for _ in range(50):
        middle = 0.5 * (low + high)
        if value_at(kinds, p, step, event, middle) > 0:
            low = middle
        else:
            high = middle
    return high


@compiled
def fall_in(kinds, p, step, event):
    """Share of the step at which a guard first falls through zero; 2 if it does not."""
    g = np.zeros(NODES + 1)
    for j in range(NODES + 1):
        g[j] = value_at(kinds, p, step, event, j / NODES)
    for j in range(NODES):
        low, bottom = j / NODES, 2.0
        if g[j + 1] < 0:
            bottom = (j + 1) / NODES
        elif j > 0 and g[j] > 0 and g[j] < g[j - 1] and g[j] < g[j + 1]:
            # a dip may go below zero between the nodes
            dip = lowest(kinds, p, step, event, (j - 1) / NODES, (j + 1) / NODES)
            if value_at(kinds, p, step, event, dip) < 0:
                bottom, low = dip, (j - 1) / NODES
        if bottom > 1:
            continue
        if j == 0:
            # an event that has just been may have left the guard at zero
            low = positive_before(kinds, p, step, event, bottom)
            if low < 0:
                return 0.0
        return fall_between(kinds, p, step, event, low, bottom)
    return 2.0


@compiled
def passes(p, step, stop, direction):
    """Bracket of the first share of the step at which the mass passes a stop; (2, 2) if none.

    `direction` -1: inwards, +1: outwards.
    """
    before, last = clearance(p, stop, step.y).real, 0.0
    first = True
    node, turn = 1, 0
    while node <= NODES:
        share = node / NODES
        if turn < step.turned and step.turns[turn] < share:
            share = step.turns[turn]
            turn += 1
        else:
            node += 1
        now = clearance_at(p, step, stop, share)
        if direction < 0 and now < 0 and now < before and (before > 0 or not first):
            return last, share
        if direction < 0 and first and before <= 0 and now < 0:
            return 0.0, share
        if direction > 0 and now > 0 and now > before and not (first and before >= 0):
            return last, share
        if share > 0:
            first = False
        before, last = now, share
    return 2.0, 2.0


@compiled
def surface_between(p, step, low, high):
    """Share of the step at which the mass comes out of the stop in contact."""
    for _ in range(50):
        middle = 0.5 * (low + high)
        if clearance_at(p, step, step.m[1], middle) < 0:
            low = middle
        else:
            high = middle
    return low


@compiled
def last_fall(kinds, p, step, a, b):
    """Share of the step at which the force falls through zero just before the mass leaves the stop
    between the shares a and b; 2 if the force lasts until then.
    """
    surface = surface_between(p, step, a, b)
    low, width = 0.0, surface
    for _ in range(40):
        width *= 0.5
        high = surface - width
        if pushing(kinds, p, step.m, inside(step.y, step.f, high)).real < 0:
            for _ in range(50):
                middle = 0.5 * (low + high)
                if pushing(kinds, p, step.m, inside(step.y, step.f, middle)).real > 0:
                    low = middle
                else:
                    high = middle
            return high
        low = high
    return 2.0
