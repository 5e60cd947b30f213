"""The record of a run: samples, impacts, rests, nearest misses."""

from typing import NamedTuple

import numpy as np

from .compiled import compiled
from .guards import TURN, clearance, is_held
from .physics import ABSENT, LAWS, lever, place, side
from .stepping import CONTACT, FLIGHT, NODES, after, component, indented, inside, pushing

# Columns of the impacts, of the whole numbers beside them (CHATTERS: the rest it ends in), and of
# the rests.
TIME, APPROACH, SEPARATION, APART, DEEPEST, PEAK, COLUMNS = range(7)
STOP, COMPLETE, CHATTERS, MARKS = range(4)
BEGIN, END = range(2)
RELEASED = 1  # beside STOP
# Places in `counts`, `misses` and `speeds`.
SAMPLES, IMPACTS, RESTS, GROUP, OPEN = range(5)
AT_TURN, AT_END = range(2)
FASTEST, LARGEST = range(2)


class Log(NamedTuple):
    """Arrays that a run fills; the complex ones hold a derivative.

    - `times`: of the samples; `x`, `v`: what they show.
    - `impacts`, `marks`, `rests`, `rest_marks`: a row an event.
    - `counts`: samples, impacts and rests so far, first impact since the last rest, row of the
      contact that lasts (-1: none).
    - `misses`: nearest miss at a turn, and distance to a stop that the mass approaches at the end.
    - `speeds`: of the fastest impact, and the largest at all.
    """

    times: np.ndarray
    x: np.ndarray
    v: np.ndarray
    impacts: np.ndarray
    marks: np.ndarray
    rests: np.ndarray
    rest_marks: np.ndarray
    counts: np.ndarray
    misses: np.ndarray
    speeds: np.ndarray


def empty_log(times: np.ndarray, impacts: int, rests: int) -> Log:
    """A log with room for so many impacts and rests."""
    return Log(
        times,
        np.zeros(times.size, complex),
        np.zeros(times.size, complex),
        np.zeros((impacts, COLUMNS), complex),
        np.zeros((impacts, MARKS), np.int64),
        np.zeros((rests, 2), complex),
        np.zeros((rests, 2), np.int64),
        np.array([0, 0, 0, 0, -1]),
        np.full(2, np.inf, complex),
        np.zeros(2),
    )


@compiled
def note_samples(kinds, p, step, taken, is_last, log):
    """Write the samples within a step of the length `taken`, and at its end if it is the last."""
    i = log.counts[SAMPLES]
    while i < log.times.size and (log.times[i] < (step.t + taken).real or is_last):
        here = after(kinds, p, step.m, step.t, step.y, log.times[i] - step.t)
        log.x[i], log.v[i] = here[3] + here[0], here[1]
        i += 1
    log.counts[SAMPLES] = i


@compiled
def note_stay(p, stop, until, log):
    """Write the samples of a mass that stays at a stop until a time."""
    i = log.counts[SAMPLES]
    while i < log.times.size and log.times[i] < until:
        log.x[i], log.v[i] = place(p, stop), 0
        i += 1
    log.counts[SAMPLES] = i


@compiled
def note_miss(kinds, p, here, before, log):
    """Keep the distance from the stop ahead at a turn, if it is the least; `before` it the velocity
    has this sign.
    """
    i = 1 if before > 0 else 0
    if kinds[LAWS + i] != ABSENT:
        miss = lever(kinds, p) * clearance(p, i, here)
        if miss.real < log.misses[AT_TURN].real:
            log.misses[AT_TURN] = miss


@compiled
def note_turns(kinds, p, step, event, taken, to, log):
    """Keep the nearest miss at the turns of a flight up to an event."""
    for j in range(step.turned):
        if (event.kind == TURN and j == 0) or step.turns[j] * step.h >= taken.real:
            continue
        here = after(kinds, p, step.m, step.t, step.y, complex(step.turns[j] * step.h))
        before = component(step.y, step.f, max(step.turns[j] - 1e-3, 0.0), 1).real
        log.speeds[LARGEST] = max(log.speeds[LARGEST], abs(before))
        note_miss(kinds, p, here, before, log)
    if event.kind == TURN:
        note_miss(kinds, p, to, float(step.m[2]), log)


@compiled
def note_end(kinds, p, m, y, log):
    """Keep the distance to the stop that the mass approaches at the end."""
    i = 1 if y[1].real > 0 else 0
    if m[0] == FLIGHT and kinds[LAWS + i] != ABSENT and not is_held(kinds, m):
        log.misses[AT_END] = lever(kinds, p) * clearance(p, i, y)


@compiled
def highest_force(kinds, p, step, least):
    """Share of the step at which the force is largest; 0 if it is not near `least`."""
    best, where = -np.inf, 0
    for j in range(NODES + 1):
        value = pushing(kinds, p, step.m, inside(step.y, step.f, j / NODES)).real
        if value > best:
            best, where = value, j
    if best < 0.9 * least:
        return 0.0
    low, high = max(where - 1, 0) / NODES, min(where + 1, NODES) / NODES
    for _ in range(40):
        a, b = low + 0.382 * (high - low), low + 0.618 * (high - low)
        at_a = pushing(kinds, p, step.m, inside(step.y, step.f, a)).real
        at_b = pushing(kinds, p, step.m, inside(step.y, step.f, b)).real
        if at_a > at_b:
            high = b
        else:
            low = a
    return 0.5 * (low + high)


@compiled
def keep_larger(row, column, value):
    """Write a value into a row of the impacts, if it is larger."""
    if value.real > row[column].real:
        row[column] = value


@compiled
def note_contact(kinds, p, step, taken, to, log):
    """Keep the deepest penetration and the largest force of a step of the length `taken`."""
    row = log.impacts[log.counts[OPEN]]
    for at in (step.y, to):
        keep_larger(row, DEEPEST, indented(kinds, p, step.m[1], step.y[3], at[0]))
        keep_larger(row, PEAK, pushing(kinds, p, step.m, at))
    share = highest_force(kinds, p, step, row[PEAK].real)
    if share * step.h < taken.real and share > 0:
        at = after(kinds, p, step.m, step.t, step.y, complex(share * step.h))
        keep_larger(row, PEAK, pushing(kinds, p, step.m, at))


@compiled
def note_step(kinds, p, step, event, taken, to, is_last, log):
    """Write and keep all there is on the way to an event, or to the end of a step."""
    note_samples(kinds, p, step, taken, is_last, log)
    log.speeds[LARGEST] = max(log.speeds[LARGEST], abs(to[1].real))
    if step.m[0] == FLIGHT:
        note_turns(kinds, p, step, event, taken, to, log)
    if step.m[0] == CONTACT and log.counts[OPEN] >= 0:
        note_contact(kinds, p, step, taken, to, log)


@compiled
def open_row(stop, t, speed, log):
    """Begin the row of an impact at a speed [m/s]."""
    row = log.counts[IMPACTS]
    log.marks[row, STOP], log.marks[row, CHATTERS] = stop, -1
    log.impacts[row, TIME], log.impacts[row, APPROACH] = t, speed
    log.impacts[row, DEEPEST], log.impacts[row, PEAK] = -np.inf, -np.inf
    log.counts[OPEN] = row
    log.counts[IMPACTS] += 1


@compiled
def close_row(kinds, p, stop, t, y, log):
    """End the row of the contact that lasts, if there is one."""
    row = log.counts[OPEN]
    if row >= 0:
        log.impacts[row, APART] = t
        log.impacts[row, SEPARATION] = side(stop) * y[1] * lever(kinds, p)
        log.marks[row, COMPLETE] = 1
    log.counts[OPEN] = -1


@compiled
def close_rebound(t, speed, log):
    """End the row of an impact at a rigid stop with its separation speed [m/s]."""
    row = log.counts[OPEN]
    log.impacts[row, APART], log.impacts[row, SEPARATION] = t, speed
    log.impacts[row, DEEPEST], log.impacts[row, PEAK] = 0, 0
    log.marks[row, COMPLETE] = 1
    log.counts[OPEN] = -1


@compiled
def note_rest(stop, begin, end, released, log):
    """Write a rest, and that the impacts since the one before lead to it."""
    row = log.counts[RESTS]
    log.rests[row, BEGIN], log.rests[row, END] = begin, end
    log.rest_marks[row, STOP], log.rest_marks[row, RELEASED] = stop, 1 if released else 0
    for i in range(log.counts[GROUP], log.counts[IMPACTS]):
        log.marks[i, CHATTERS] = row
    log.counts[GROUP] = log.counts[IMPACTS]
    log.counts[RESTS] += 1
