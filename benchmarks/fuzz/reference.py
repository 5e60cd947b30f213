"""Runs of the independent simulator, and how much they magnify what is changed a little."""

from typing import Any, NamedTuple

import numpy as np

from . import log as lg
from . import physics as ph
from . import simulator as sim
from .classes import Class, Draw, kinds, tied

TINY = 1e-30  # of the imaginary part that carries the derivative
ROWS, RESTS = 20_000, 100
STEPS = 40_000
CHANGES = (1e-8, 1e-8, 1e-7)  # relative, of every parameter, the start and each separation
UNIT = 1e-8
Vector = Any  # an array, real or complex


class Motion(NamedTuple):
    """A run: values are complex, with the derivative as imaginary part."""

    code: int
    position: Vector
    velocity: Vector
    impacts: dict[str, Vector]
    stop: Vector
    complete: Vector
    chatter: Vector  # number of the rest that an impact leads to, -1 for none
    rests: dict[str, Vector]
    rest_stop: Vector
    released: Vector
    nearest_miss: complex  # of turns
    end_miss: complex  # distance to a stop that is approached at the end
    fastest: float

    @property
    def miss(self) -> complex:
        """The nearest miss, at a turn or at the end of the run."""
        return min(self.nearest_miss, self.end_miss, key=lambda z: z.real)


def simulate(
    which: Vector, parameters: Vector, direction: Vector, times: Vector, kick: float = 0.0
) -> Motion:
    """A run of the independent simulator, with or without a small kick at each separation."""
    log = lg.empty_log(times, ROWS, RESTS)
    p = parameters + 1j * TINY * direction
    code = sim.run(which, p, STEPS, kick, log)  # pyright: ignore[reportCallIssue]  as compiled
    n, rest_count = log.counts[lg.IMPACTS], log.counts[lg.RESTS]
    rests, rest_marks = _scaled(log.rests[:rest_count]), log.rest_marks[:rest_count]
    marks = log.marks[:n]
    complete = marks[:, lg.COMPLETE].astype(bool)
    return Motion(
        code=int(code),
        position=_scaled(log.x),
        velocity=_scaled(log.v),
        impacts=_columns(_scaled(log.impacts[:n]), complete, _scaled(p[ph.MASS])),
        stop=marks[:, lg.STOP],
        complete=complete,
        chatter=marks[:, lg.CHATTERS],
        rests={"rests.begin": rests[:, lg.BEGIN], "rests.end": rests[:, lg.END]},
        rest_stop=rest_marks[:, lg.STOP],
        released=rest_marks[:, lg.RELEASED].astype(bool),
        nearest_miss=_distance(log.misses[lg.AT_TURN]),
        end_miss=_distance(log.misses[lg.AT_END]),
        fastest=float(log.speeds[lg.FASTEST]),
    )


def _scaled(z: Vector) -> Vector:
    return z.real + 1j * z.imag / TINY


def _distance(z: complex) -> complex:
    return _scaled(z) if np.isfinite(z.real) else complex(np.inf)


def _columns(log: Vector, complete: Vector, mass: complex) -> dict[str, Vector]:
    approach, separation = log[:, lg.APPROACH], log[:, lg.SEPARATION]

    def product(a: Vector, b: Vector) -> Vector:
        return a.real * b.real + 1j * (a.real * b.imag + a.imag * b.real)

    safe = np.where(np.real(approach) > 0, approach, 1)
    ratio = np.real(separation) / np.real(safe)
    ratio = ratio + 1j * (np.imag(separation) - ratio * np.imag(safe)) / np.real(safe)
    lost = product(mass, product(approach, approach) - product(separation, separation)) / 2
    duration = log[:, lg.APART] - log[:, lg.TIME]
    return {
        "time": log[:, lg.TIME],
        "approach_speed": approach,
        "separation_speed": np.where(complete, separation, 0),
        "restitution": np.where(complete & (approach.real > 0), ratio, 0),
        "duration": np.where(complete, duration, 0),
        "deepest_penetration": log[:, lg.DEEPEST],
        "peak_force": log[:, lg.PEAK],
        "energy_lost": np.where(complete, lost, 0),
    }


def motions(each: Class, draw: Draw, rng: np.random.Generator) -> list[Motion]:
    """The run itself, and one for each of `CHANGES`."""
    which = kinds(each)
    found = [simulate(which, draw.parameters, draw.direction, draw.times)]
    typical = max(1e-30, float(np.max(np.abs(found[0].position.real), initial=0.0)))
    exponents = _exponents(each)
    for size in CHANGES:
        change = size * rng.choice([-1.0, 1.0], ph.SIZE) * rng.uniform(0.5, 1, ph.SIZE)
        change[exponents] = 0
        p = draw.parameters * (1 + change)
        if each.close:
            typical = abs(draw.parameters[[ph.STOPS, ph.STOPS + ph.WIDTH]].sum())
            ratio = 1 + change[ph.STOPS]  # the stops must stay apart
            gaps = [ph.STOPS, ph.STOPS + ph.WIDTH, ph.POSITION]
            p[gaps] = draw.parameters[gaps] * ratio
        p[ph.POSITION] += typical * change[ph.POSITION]
        if _has_restitution_one(each, draw.parameters).any():
            p = np.where(_has_restitution_one(each, draw.parameters), draw.parameters, p)
        found.append(simulate(which, tied(p, draw.on_stop), draw.direction, draw.times, size))
    return found


def _exponents(each: Class) -> list[int]:
    found = []
    for stop, law in enumerate((each.lower, each.upper)):
        if law is not None:
            at = ph.STOPS + ph.WIDTH * stop + 1
            found += range(at + law.still, at + 5)
    return found


def _has_restitution_one(each: Class, p: Vector) -> Vector:
    """Mark the parameters whose change would leave the range of the law."""
    found = np.zeros(ph.SIZE, bool)
    for stop, law in enumerate((each.lower, each.upper)):
        if law is not None and law.kind == ph.RESTITUTION:
            at = ph.STOPS + ph.WIDTH * stop + 1
            found[at] = p[at] == 1
    return found
