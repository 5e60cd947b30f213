"""An impact oscillator simulated without any of the package's code.

Every impact is followed by itself, in distances from the stop that was hit last, until the rest of
a chatter is a geometric series to the last digit. Steps end at every turn within a contact or
under friction. Events are looked for between all turns of the dense output and then approached by
Newton's method with steps of their own.
"""

import numpy as np

from .compiled import compiled
from .events import first_event, until
from .guards import (
    FORCE_FALLS,
    IMPACT,
    NOTHING,
    SLIP,
    SURFACE,
    TURN,
    clearance,
    direction,
    holding,
    is_held,
)
from .log import (
    FASTEST,
    IMPACTS,
    LARGEST,
    RESTS,
    close_rebound,
    close_row,
    note_end,
    note_rest,
    note_stay,
    note_step,
    open_row,
)
from .physics import (
    ABSENT,
    FREQUENCY,
    HAS_BASE,
    LAWS,
    POSITION,
    VELOCITY,
    free,
    is_rigid,
    lever,
    place,
    restitution,
    side,
    touched,
)
from .resting import release, series, small_series
from .stepping import CONTACT, DETACHED, FLIGHT, REST, after, step_from

RUNNING = -1
FINE, TOO_MANY_STEPS, TOO_MANY_IMPACTS, TOO_SMALL, OUT_OF_RANGE, STUCK, STARTS_INSIDE = range(7)


@compiled
def run(kinds, p, most_steps, kick, log):
    """Simulate from t = 0 to the last sample; fills the log and returns a code.

    Each separation speed is changed by a `kick` in units of the largest speed so far, in turn up
    and down, as long as it is much faster than that.
    """
    t, y = 0.0j, np.zeros(4, np.complex128)
    y[3], y[1] = p[POSITION], p[VELOCITY]
    log.speeds[LARGEST] = abs(y[1].real)
    f, k = np.zeros((7, 4), np.complex128), np.zeros((16, 4), np.complex128)
    code, m = begin(kinds, p, y)
    h, steps, end = first_length(m), 0, log.times[-1]
    while code == RUNNING:
        if m[0] == REST:
            code, t, m = rest(kinds, p, t, m, y, log)
            h = first_length(m)
            continue
        if steps >= most_steps:
            return TOO_MANY_STEPS
        h = bounded(kinds, p, m, h)
        is_last = h >= end - t.real
        if is_last:
            h = end - t.real
        step, trials, grown = step_from(kinds, p, m, t, y, h, log.speeds[LARGEST], k, f)
        if grown == 0:
            return TOO_SMALL
        steps += trials
        event = first_event(kinds, p, step, log.speeds[LARGEST])
        is_last = is_last and step.h == h and event.kind == NOTHING
        taken, to = followed(kinds, p, step, event, is_last, end)
        note_step(kinds, p, step, event, taken, to, is_last, log)
        t, y, h = t + taken, to, grown
        if not np.isfinite(t.real):
            return STUCK
        if is_last:
            note_end(kinds, p, m, y, log)
            return FINE
        if event.kind != NOTHING:
            kick = -kick
            code, t, m = jump(kinds, p, m, t, y, event, kick, log)
            if event.kind != TURN or step.m[0] == CONTACT:
                h = first_length(m)
    return code


@compiled
def begin(kinds, p, y):
    """A code and the mode at the start; changes a state inside a stop to distances from it."""
    phase, stop = FLIGHT, 0
    for i in range(2):
        if kinds[LAWS + i] == ABSENT:
            continue
        gap = clearance(p, i, y)
        if is_rigid(kinds, i):
            if gap.real < 0:
                return STARTS_INSIDE, (phase, stop, 0)
            inwards = -side(i) * free(kinds, p, 0.0j, place(p, i), 0.0j).real
            if gap.real == 0 and y[1].real == 0 and inwards >= 0:
                phase, stop = REST, i
        elif gap.real < 0:
            phase, stop = CONTACT, i
            y[0] = side(i) * gap
            y[3] = place(p, i)
            y[2] = touched(kinds, p, i, 0.0j)
    if y[1].real != 0:
        return RUNNING, (phase, stop, 1 if y[1].real > 0 else -1)
    return RUNNING, (phase, stop, direction(kinds, p, (phase, stop, 0), 0.0j, y, False))


@compiled
def first_length(m):
    """Length of the first step after an event."""
    return 1e-3 if m[0] == FLIGHT else 1e-6


@compiled
def bounded(kinds, p, m, h):
    """A step's length such that no slip of a mass that friction holds is missed."""
    if not is_held(kinds, m):
        return h
    if kinds[HAS_BASE] == 1:
        h = min(h, 0.3 / p[FREQUENCY].real)
    return min(max(h, 1e-4), 0.05)


@compiled
def followed(kinds, p, step, event, is_last, end):
    """Complex length of a step that ends on its event or at the end, and the state there."""
    if event.kind != NOTHING:
        taken = until(kinds, p, step, event)
    elif is_last:
        taken = complex(end) - step.t
    else:
        return complex(step.h), step.to
    return taken, after(kinds, p, step.m, step.t, step.y, taken)


@compiled
def rest(kinds, p, t, m, y, log):
    """Code, time and mode after a rest; sets the state."""
    _, stop, sigma = m
    end, released = release(kinds, p, stop, t, log.times[-1])
    note_stay(p, stop, end.real if released else np.inf, log)
    note_rest(stop, t, end, released, log)
    if not released or log.counts[RESTS] >= log.rests.shape[0]:
        return FINE, end, m
    y[0], y[1], y[2], y[3] = 0, 0, 0, place(p, stop)
    sigma = 1 if side(stop) > 0 else -1
    return RUNNING, end, (FLIGHT, 0, sigma)


@compiled
def jump(kinds, p, m, t, y, event, kick, log):
    """Code, time and mode after an event; changes the state."""
    phase, stop, sigma = m
    blow = kick * log.speeds[LARGEST]
    if abs(y[1].real) < 100 * abs(blow):
        blow = 0.0
    if event.kind == TURN:
        y[1] = 0
        return RUNNING, t, (phase, stop, direction(kinds, p, m, t, y, False))
    if event.kind == SLIP:
        return RUNNING, t, (phase, stop, direction(kinds, p, m, t, y, True))
    if event.kind == SURFACE:
        if phase == CONTACT:
            close_row(kinds, p, stop, t, y, log)
        y[0], y[2], y[3] = 0, 0, place(p, stop)
        y[1] += blow
        return RUNNING, t, (FLIGHT, 0, sigma)
    if event.kind == FORCE_FALLS:
        close_row(kinds, p, stop, t, y, log)
        y[1] += side(stop) * abs(blow)  # away, so that the stop stays behind
        return RUNNING, t, (DETACHED, stop, sigma)
    if log.counts[IMPACTS] >= log.impacts.shape[0]:
        return TOO_MANY_IMPACTS, t, m
    approach = -side(event.stop) * y[1]
    if approach.real < 0:
        approach = 0.0j
    log.speeds[FASTEST] = max(log.speeds[FASTEST], approach.real)
    open_row(event.stop, t, lever(kinds, p) * approach, log)
    if event.kind == IMPACT and is_rigid(kinds, event.stop):
        return rebound(kinds, p, event.stop, t, y, approach, blow, log)
    if event.kind == IMPACT:
        y[0], y[3] = 0, place(p, event.stop)
        y[2] = touched(kinds, p, event.stop, lever(kinds, p) * approach)
        if not np.isfinite(y[2].real):
            return OUT_OF_RANGE, t, m
    return RUNNING, t, (CONTACT, event.stop, sigma)


@compiled
def rebound(kinds, p, stop, t, y, approach, blow, log):
    """Code, time and mode after an impact on a rigid stop; sets the state."""
    sigma = 1 if side(stop) > 0 else -1
    flying, resting = (FLIGHT, 0, sigma), (REST, stop, sigma)
    r = restitution(kinds, p, stop, lever(kinds, p) * approach)
    if r.real < 0 or r.real > 1:
        return OUT_OF_RANGE, t, flying
    u = r * approach
    if u.real > 100 * abs(blow):
        u += blow
    if r.real == 0:
        u = complex(0.0, u.imag)
    close_rebound(t, lever(kinds, p) * u, log)
    y[0], y[1], y[2], y[3] = 0, side(stop) * u, 0, place(p, stop)
    if u.real == 0:
        if holding(kinds, p, stop, t).real < 0:
            return RUNNING, t, flying
        return RUNNING, t + small_series(kinds, p, stop, t, u), resting
    is_series, length = series(kinds, p, stop, t, u, log.speeds[FASTEST])
    if not is_series:
        return RUNNING, t, flying
    t += length
    note_stay(p, stop, t.real, log)
    return (RUNNING if t.real < log.times[-1] else FINE), t, resting
