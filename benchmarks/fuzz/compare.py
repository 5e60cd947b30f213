"""A run of the package beside the independent one.

What may differ is the tolerance, in units of the motion, plus what the motion makes of a change of
that size in all parameters and in the start, each ten times.
"""

from typing import Any, NamedTuple

import numpy as np

from . import physics as ph
from . import simulator as sim
from .classes import Class, Draw, kinds
from .package import COLUMNS
from .reference import CHANGES, UNIT, Motion

SLOW = 1e-3  # impacts slower than this share of the fastest may be summed
FACTOR = 10.0
REVERSE = 1e-7
Vector = Any  # an array, real or complex


class Verdict(NamedTuple):
    """Result of the comparison of a run.

    - `kind`: "right", "wrong", "ill-conditioned", or why there is nothing to compare.
    - `value`, `gradient`: largest error in units of what is allowed.
    - `reverse`: difference of reverse and forward derivative, relative to its largest term.
    - `wrong`: what is, by column.
    """

    kind: str
    value: float = 0.0
    gradient: float = 0.0
    reverse: float = 0.0
    wrong: dict[str, str] | None = None


class Ours(NamedTuple):
    """One lane of the package's outputs."""

    values: dict[str, Vector]
    rest: dict[str, Any]
    slopes: dict[str, Vector] | None
    along: float


def pairs(motion: Motion, time: Vector, begins: Vector, full: bool) -> Vector | str:
    """Rows of `motion` beside those of another log that they belong to; or why there are none.

    Impacts before a rest may be missing in either at the end of their group, if they are slow.
    """
    chosen, beside = [], []
    row = 0
    mine = motion.impacts["time"].real
    speed = motion.impacts["approach_speed"].real
    fastest = np.maximum.accumulate(speed) if speed.size else speed
    edges = [*motion.rests["rests.begin"].real, np.inf]
    start = 0
    for group, edge in enumerate(edges):
        stopped = np.searchsorted(mine, edge, side="right") if np.isfinite(edge) else mine.size
        limit = begins[group] if group < len(begins) else np.inf
        count = 0
        while row + count < time.size and time[row + count] <= limit:
            count += 1
        have = stopped - start
        extra = have - count
        if full and row + count == time.size:
            chosen += range(start, start + min(count, have))
            beside += range(row, row + min(count, have))
            return np.array([chosen, beside], int)
        if extra < 0:
            more = time[row + have : row + count]
            if have == 0 or group == len(edges) - 1 or np.any(more < mine[stopped - 1]):
                return f"{-extra} impacts too many after {have} of group {group}"
            count_used = have
        else:
            left = slice(start + count, stopped)
            if extra and np.any(speed[left] > SLOW * 1.001 * fastest[left]):
                which = start + count + int(np.argmax(speed[left] > SLOW * fastest[left]))
                return f"impact {which} at {mine[which]:.9g} is missing"
            count_used = count
        chosen += range(start, start + count_used)
        beside += range(row, row + count_used)
        row += count
        start = stopped
    if row != time.size:
        return f"{time.size - row} impacts too many"
    return np.array([chosen, beside], int)


def _rested(motion: Motion, other: Motion) -> bool:
    return (
        motion.rest_stop.size == other.rest_stop.size
        and bool(np.all(motion.rest_stop == other.rest_stop))
        and bool(np.all(motion.released == other.released))
    )


def _same_events(motion: Motion, other: Motion) -> Vector | None:
    """Rows of `other` beside those of `motion` that must be in a log; None if they differ."""
    if not _rested(motion, other):
        return None
    speed = motion.impacts["approach_speed"].real
    fastest = np.maximum.accumulate(speed) if speed.size else speed
    must = speed > 1e-4 * fastest
    if abs(speed.size - other.stop.size) > 3 + 2 * motion.rest_stop.size:
        return None
    rows = []
    for group in [*range(motion.rest_stop.size), -1]:
        a = np.flatnonzero(motion.chatter == group)
        b = np.flatnonzero(other.chatter == group)
        n = min(a.size, b.size)
        if np.any(must[a[n:]]):
            return None
        if np.any(motion.stop[a[:n]] != other.stop[b[:n]]):
            return None
        if np.any(motion.complete[a[:n]] != other.complete[b[:n]]):
            return None
        if b.size > n:
            other_speed = other.impacts["approach_speed"].real
            if np.any(other_speed[b[n:]] > 1e-4 * motion.fastest * _lever(motion)):
                return None
        rows.append(np.stack([a[:n], b[:n]]))
    return np.concatenate(rows, axis=1)


def _lever(motion: Motion) -> float:
    speed = motion.impacts["approach_speed"].real
    return float(speed.max() / motion.fastest) if speed.size and motion.fastest > 0 else 1.0


class _Spread(NamedTuple):
    """Changes of samples, log columns and rests by a change of one tolerance."""

    position: Vector
    velocity: Vector
    columns: dict[str, Vector]
    rests: dict[str, Vector]
    miss: complex


def _largest(spread: Vector, a: Vector, b: Vector, size: float) -> Vector:
    change = (a - b) * (UNIT / size)
    return np.maximum(spread.real, np.abs(change.real)) + 1j * np.maximum(
        spread.imag, np.abs(change.imag)
    )


def _spread(motion: Motion, others: list[Motion]) -> _Spread | None:
    """The spread, or None if the events differ."""
    position, velocity = np.zeros_like(motion.position), np.zeros_like(motion.velocity)
    columns = {name: np.zeros_like(motion.impacts[name]) for name in COLUMNS}
    rests = {name: np.zeros_like(value) for name, value in motion.rests.items()}
    miss = 0j
    for other, size in zip(others, CHANGES, strict=True):
        if other.code != sim.FINE:
            return None
        same = _same_events(motion, other)
        if same is None or np.isfinite(other.miss) != np.isfinite(motion.miss):
            return None
        position = _largest(position, motion.position, other.position, size)
        velocity = _largest(velocity, motion.velocity, other.velocity, size)
        for name in COLUMNS:
            a, b = motion.impacts[name][same[0]], other.impacts[name][same[1]]
            columns[name][same[0]] = _largest(columns[name][same[0]], a, b, size)
        for name in rests:
            rests[name] = _largest(rests[name], motion.rests[name], other.rests[name], size)
        if np.isfinite(motion.miss):
            miss = _largest(np.array(miss), np.array(motion.miss), np.array(other.miss), size)[()]
    return _Spread(position, velocity, columns, rests, miss)


class _Worst:
    """The largest errors in units of what is allowed, by column."""

    def __init__(self, prefix: str = "") -> None:
        self.ratio, self.prefix = 0.0, prefix
        self.wrong: dict[str, tuple[float, str]] = {}

    def see(self, name: str, error: Vector, allowed: Vector) -> None:
        ratio = np.atleast_1d(np.abs(error) / allowed)
        ratio = np.where(np.isnan(ratio), np.inf, ratio)
        if not ratio.size:
            return
        i = int(ratio.argmax())
        self.ratio = max(self.ratio, float(ratio[i]))
        if ratio[i] > 1:
            size = np.atleast_1d(np.broadcast_to(np.abs(error), ratio.shape))[i]
            said = f"[{i}] off by {size:.2g}, {ratio[i]:.2g} times what is allowed"
            self.wrong[self.prefix + name] = float(ratio[i]), said


def compare(
    each: Class, draw: Draw, motions: list[Motion], ours: Ours, result: str, tolerance: float
) -> Verdict:
    """The verdict on one run."""
    motion, others = motions[0], motions[1:]
    if motion.code != sim.FINE:
        return Verdict(f"reference {motion.code}, package {result}")
    if result not in ("successful", "max_impacts_reached"):
        return Verdict(f"refused: {result}")
    spread = _spread(motion, others)
    full = result == "max_impacts_reached"
    within = FACTOR * tolerance * _start(each, draw, motion)
    if (
        spread is None
        or min(motion.nearest_miss.real, _least_overshoot(each, draw, motion)) < within
    ):
        return Verdict("ill-conditioned")
    wrong = _events(motion, ours, full)
    if isinstance(wrong, str):
        return Verdict("wrong", np.inf, wrong={"events": wrong})
    value, gradient = _Worst(), _Worst("d ")
    for part, worst in ((np.real, value), (np.imag, gradient)):
        source = ours.values if part is np.real else ours.slopes
        if source is None:
            continue
        promise = tolerance if part is np.real else max(tolerance, each.derivatives)
        count = int(ours.rest["count"])
        _see(each, draw, motion, spread, source, wrong, count, part, promise, worst, full)
    found = {name: said for name, (_, said) in (value.wrong | gradient.wrong).items()}
    if not ours.along < REVERSE:
        found["reverse"] = f"differs from forward by {ours.along:.2g} of its largest term"
    kind = "wrong" if found else "right"
    return Verdict(kind, value.ratio, gradient.ratio, ours.along, found)


def _events(motion: Motion, ours: Ours, full: bool) -> Vector | str:
    """Rows of the motion beside those of the package's log, or the error in the events."""
    count, rests = int(ours.rest["count"]), int(ours.rest["rests.count"])
    stop = ours.rest["stop"][:count]
    if rests != motion.rest_stop.size and not full:
        return f"{rests} rests for {motion.rest_stop.size}"
    rests = min(rests, motion.rest_stop.size)
    if np.any(ours.rest["rests.stop"][:rests] != motion.rest_stop[:rests]):
        return "stop of a rest"
    if np.any(ours.rest["rests.released"][:rests] != motion.released[:rests]):
        return "released"
    found = pairs(motion, ours.values["time"][:count], ours.values["rests.begin"][:rests], full)
    if isinstance(found, str):
        return found
    rows, beside = found
    if np.any(stop[beside] != motion.stop[rows]):
        return "stop of an impact"
    if not full and np.any(ours.rest["complete"][beside] != motion.complete[rows]):
        return "complete"
    return found


def _start(each: Class, draw: Draw, motion: Motion) -> float:
    """The size of the motion in units of the coordinate."""
    if each.close:
        return abs(draw.parameters[[ph.STOPS, ph.STOPS + ph.WIDTH]].sum())
    return max(abs(draw.parameters[ph.POSITION]), np.max(np.abs(motion.position.real)))


def _least_overshoot(each: Class, draw: Draw, motion: Motion) -> float:
    """How far at least the mass would have gone beyond a stop, had this not been there.

    An impact at the speed v against a pull a away from the stop is missed if the stop stands
    v² / 2a farther off. A mass that is pulled onto the stop comes to it wherever it stands.
    """
    which, p = kinds(each), draw.parameters + 0j
    least = np.inf
    for i, stop in enumerate(motion.stop):
        t, speed = motion.impacts["time"][i], motion.impacts["approach_speed"][i].real
        away = ph.side(stop) * ph.free(which, p, t.real + 0j, ph.place(p, stop), 0j).real
        away += p[ph.DRY].real if each.dry else 0.0
        if away > 0 and speed > 0:
            least = min(least, (speed / ph.lever(which, p).real) ** 2 / (2 * away))
    return least


def _see(
    each: Class,
    draw: Draw,
    motion: Motion,
    spread: _Spread,
    source: dict[str, Vector],
    pairs: Vector,
    count: int,
    part: Any,
    tolerance: float,
    worst: _Worst,
    full: bool,
) -> None:
    """Look at all columns of values or of derivatives.

    A direction changes every parameter by a part of itself, so that derivatives have at least the
    size of the values.
    """
    is_value = part is np.real
    end, start = draw.times[-1], _start(each, draw, motion)
    speed = max(float(np.max(np.abs(motion.velocity.real))), motion.fastest, 1e-12)

    def allowed(change: Vector, values: Vector, size: Vector | float) -> Vector:
        if not is_value:
            size = np.maximum(size, np.max(np.abs(values.imag), initial=0.0))
        return FACTOR * (tolerance * size + part(change)) + 1e-300

    x, v = motion.position, motion.velocity
    jump = np.where(_near_event(motion, draw.times, spread, tolerance), np.inf, 0.0)
    worst.see(
        "position",
        source["position"] - part(x),
        allowed(spread.position, x, start) + (0.0 if is_value else jump),
    )
    worst.see("velocity", source["velocity"] - part(v), allowed(spread.velocity, v, speed) + jump)
    rows, beside = pairs
    speeds = motion.impacts["approach_speed"].real
    fastest = float(np.max(speeds, initial=0.0))
    # a change δE of the energy in flight changes a speed v by δE / v
    slow = fastest**2 / np.clip(np.abs(speeds[rows]), 1e-300, None)
    sizes = {
        "time": end,
        "restitution": 1.0,
        "approach_speed": slow,
        "separation_speed": slow,
        "energy_lost": fastest**2 * draw.parameters[ph.MASS],
    }
    for name in COLUMNS:
        if full and name not in ("time", "approach_speed"):
            continue
        mine = motion.impacts[name][rows]
        size = sizes.get(name, float(np.max(np.abs(mine.real), initial=0.0)))
        change = spread.columns[name][rows]
        if name in ("approach_speed", "energy_lost"):
            # a stop that recovers may catch up with a mass that moves away: no speed of approach
            change = np.where(motion.impacts["approach_speed"][rows].real > 0, change, np.inf)
        worst.see(name, source[name][beside] - part(mine), allowed(change, mine, size))
        if not full and np.any(source[name][count:] != 0):
            worst.see(name + " beyond count", np.array(np.inf), np.array(1.0))
    for name, mine in motion.rests.items():
        k = min(mine.size, source[name].size)
        error = source[name][:k] - part(mine[:k])
        if not full:
            worst.see(name, error, allowed(spread.rests[name][:k], mine, end))
    # a chatter that is summed may outlast the run: then it approaches nothing at the end
    summed = (
        rows.size > 0 and rows[-1] < motion.stop.size - 1 and motion.chatter[-1] < 0 and not full
    )
    miss = motion.nearest_miss if summed else motion.miss
    if np.isfinite(miss) and np.isfinite(source["nearest_miss"]):
        error = source["nearest_miss"] - part(miss)
        change, mine = np.asarray(spread.miss), np.asarray(miss)
        worst.see("nearest_miss", error, allowed(change, mine, start))
    elif is_value and np.isfinite(source["nearest_miss"]) != np.isfinite(miss):
        worst.see("nearest_miss", np.array(np.inf), np.array(1.0))


def _near_event(motion: Motion, times: Vector, spread: _Spread, tolerance: float) -> Vector:
    """Mark the samples so close to an impact that they may be on its other side."""
    near = np.zeros(times.size, bool)
    end = times[-1]
    events = motion.impacts["time"].real
    width = FACTOR * (np.abs(spread.columns["time"].real) + max(tolerance, 1e-8) * end)
    for at, wide in zip(events, width, strict=True):
        near |= np.abs(times - at) < wide
    for name in ("rests.begin", "rests.end"):
        for at, wide in zip(motion.rests[name].real, spread.rests[name].real, strict=True):
            near |= np.abs(times - at) < FACTOR * (wide + 1e-8 * end)
    # what may be summed has no impacts to compare with: around the slow impacts before a rest
    speed = motion.impacts["approach_speed"].real
    fastest = np.maximum.accumulate(speed) if speed.size else speed
    for group in range(motion.rest_stop.size):
        slow = np.flatnonzero((motion.chatter == group) & (speed < 1e-6 * fastest))
        if slow.size:
            from_, to = events[slow[0]], motion.rests["rests.begin"].real[group]
            near |= (times >= from_) & (times <= to)
    return near
