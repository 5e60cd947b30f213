"""Classes of systems, and how the parameters of a run are drawn.

A class has one structure, so that one compiled program serves all its runs.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Array

import impactjax as ij

from . import physics as ph

SAMPLES = 16
Vector = np.ndarray


class Law(NamedTuple):
    """A contact law: its kind, and how its parameters are drawn."""

    kind: int
    make: Callable[[Array], ij.AbstractImpactLaw | ij.AbstractForceLaw]
    draw: Callable[[np.random.Generator, float], list[float]]  # of the mass
    still: int = 5  # parameters from this one on (exponents) are not differentiated
    separation: int = ph.AT_ZERO_PENETRATION


class Class(NamedTuple):
    """Systems of one structure.

    - `pressed`: share of runs whose stop presses onto the mass at its equilibrium.
    - `close`: the stops stand 1e-6 to 1e-3 apart.
    - `derivatives`: what the documentation promises of derivatives, relative to the largest.
    """

    oscillator: int
    lower: Law | None
    upper: Law | None = None
    base: bool = False
    dry: bool = False
    drag: bool = False
    pressed: float = 0.0
    close: bool = False
    duration: float = 2.0
    steps: int = 1024
    derivatives: float = 1e-8


def _restitution(rng: np.random.Generator) -> float:
    kind = rng.random()
    if kind < 0.05:
        return 0.0
    if kind < 0.1:
        return 1.0
    if kind < 0.2:
        return 1 - 10 ** rng.uniform(-3, -1)
    return rng.uniform(0.02, 0.97)


def _frequency(rng: np.random.Generator) -> float:
    return 10 ** rng.uniform(1.9, 2.9)


def _power(rng: np.random.Generator, mass: float, n: float, p: float = 0.0) -> tuple[float, float]:
    """k and c such that contact at 1 m/s has a frequency and damping ratio like others."""
    omega, gamma = _frequency(rng), rng.uniform(0.0, 0.5)
    depth = 1 / omega
    return mass * omega**2 / depth ** (n - 1), 2 * gamma * omega * mass / depth**p


RIGID = Law(ph.RESTITUTION, lambda a: ij.Restitution(a[0]), lambda rng, _: [_restitution(rng)])
RIGID_LINEAR = Law(
    ph.LINEAR_RESTITUTION,
    lambda a: ij.LinearRestitution(a[0], a[1]),
    lambda rng, _: [rng.uniform(0.3, 1.0), rng.uniform(0.0, 0.05)],
)
RIGID_POWER = Law(
    ph.POWER_RESTITUTION,
    lambda a: ij.PowerRestitution(a[0], a[1]),
    lambda rng, _: [rng.uniform(0.2, 0.8), rng.uniform(0.0, 0.25)],
)
KELVIN_VOIGT = Law(
    ph.KELVIN_VOIGT,
    lambda a: ij.KelvinVoigt(a[0], a[1]),
    lambda rng, _: [_frequency(rng), rng.uniform(0.0, 0.6)],
)
KELVIN_VOIGT_FREE = Law(
    ph.KELVIN_VOIGT,
    lambda a: ij.KelvinVoigt(a[0], a[1], separation=ij.AtZeroForce()),
    lambda rng, _: [_frequency(rng), rng.uniform(0.0, 1.5)],
    separation=ph.AT_ZERO_FORCE,
)
KELVIN_VOIGT_LINEAR = Law(
    ph.KELVIN_VOIGT_LINEAR,
    lambda a: ij.KelvinVoigtLinearRestitution(a[0], a[1], a[2]),
    lambda rng, _: [_frequency(rng), rng.uniform(0.4, 1.0), rng.uniform(0.0, 0.05)],
)
MAXWELL = Law(
    ph.MAXWELL,
    lambda a: ij.Maxwell(a[0], a[1]),
    lambda rng, _: [_frequency(rng), rng.uniform(0.0, 0.9)],
    separation=ph.AT_ZERO_FORCE,
)
WALTON = Law(
    ph.WALTON,
    lambda a: ij.Walton(a[0], a[1]),
    lambda rng, m: [m * _frequency(rng) ** 2] * 2 if rng.random() < 0.5 else [1e4 * m, 0.0],
)
HERTZ = Law(ph.HERTZ, lambda a: ij.Hertz(a[0]), lambda rng, m: [_power(rng, m, 1.5)[0]])
HUNT_CROSSLEY = Law(
    ph.HUNT_CROSSLEY,
    lambda a: ij.HuntCrossley(a[0], a[1], a[2]),
    lambda rng, m: [
        _power(rng, m, n := rng.choice([1.0, 1.5, rng.uniform(1, 3)]))[0],
        rng.uniform(0, 1.5),
        n,
    ],
    still=2,
)
HERTZ_DASHPOT = Law(
    ph.HERTZ_DASHPOT,
    lambda a: ij.HertzDashpot(a[0], a[1], separation=ij.AtZeroForce()),
    lambda rng, m: list(_power(rng, m, 1.5)),
    separation=ph.AT_ZERO_FORCE,
)
PUST_PETERKA = Law(
    ph.PUST_PETERKA,
    lambda a: ij.PustPeterka(a[0], a[1], a[2]),
    lambda rng, m: [
        _power(rng, m, 1.5)[0],
        rng.uniform(0, 0.8),
        rng.choice([0.5, 1.0, 1.5, 2.0]),
    ],
    still=2,
)


def _general(rng: np.random.Generator, mass: float) -> list[float]:
    n, p, q = rng.choice([1.0, 1.5, 2.0]), rng.uniform(0.2, 1.0), rng.choice([1.0, 1.5])
    k, c = _power(rng, mass, n, p)
    return [k, c, n, p, q]


POWER_LAW = Law(
    ph.POWER_LAW,
    lambda a: ij.PowerLaw(*a[:5], separation=ij.AtZeroForce()),
    _general,
    still=2,
    separation=ph.AT_ZERO_FORCE,
)
POWER_LAW_PULLS = POWER_LAW._replace(
    make=lambda a: ij.PowerLaw(*a[:5]), separation=ph.AT_ZERO_PENETRATION
)

NOT_ANALYTIC, INFINITE_SLOPE = 1e-6, 1e-4
CLASSES = {
    "ball, rigid": Class(ph.BALL, RIGID),
    "ball, drag, rigid r0 - alpha v": Class(ph.BALL, RIGID_LINEAR, drag=True),
    "ball, base, rigid": Class(ph.BALL, RIGID, base=True),
    "ball, base, two rigid": Class(ph.BALL, RIGID, RIGID_LINEAR, base=True),
    "ball, two rigid close": Class(
        ph.BALL, RIGID, RIGID, base=True, close=True, duration=0.05, steps=4096
    ),
    "linear, rigid, pressed": Class(ph.LINEAR, RIGID, pressed=0.6),
    "linear, dry, rigid, pressed": Class(ph.LINEAR, RIGID, dry=True, pressed=0.5),
    "linear, base, dry, two rigid": Class(ph.LINEAR, RIGID, RIGID, base=True, dry=True),
    "linear, base, rigid, pressed": Class(ph.LINEAR, RIGID, base=True, pressed=0.6),
    "linear, base, two rigid close": Class(
        ph.LINEAR, RIGID, RIGID, base=True, close=True, duration=0.3, steps=4096
    ),
    "linear, dry, rigid r0 v^-alpha": Class(ph.LINEAR, RIGID_POWER, dry=True, pressed=0.2),
    "pendulum, two rigid": Class(ph.HANGING, RIGID, RIGID, pressed=0.3),
    "pendulum, base, dry, rigid": Class(ph.HANGING, RIGID, base=True, dry=True, pressed=0.5),
    "inverted, base, two rigid": Class(ph.INVERTED, RIGID, RIGID, base=True),
    "inverted, two rigid close": Class(
        ph.INVERTED, RIGID, RIGID, base=True, close=True, duration=0.3, steps=4096
    ),
    "ball, Kelvin-Voigt": Class(ph.BALL, KELVIN_VOIGT),
    "ball, base, Kelvin-Voigt at zero force": Class(ph.BALL, KELVIN_VOIGT_FREE, base=True),
    "ball, drag, Maxwell": Class(ph.BALL, MAXWELL, drag=True, steps=4096),
    "linear, base, two Maxwell": Class(ph.LINEAR, MAXWELL, MAXWELL, base=True, pressed=0.3),
    "linear, dry, Kelvin-Voigt at zero force, pressed": Class(
        ph.LINEAR, KELVIN_VOIGT_FREE, dry=True, pressed=0.6
    ),
    "linear, two Kelvin-Voigt close": Class(
        ph.LINEAR, KELVIN_VOIGT, KELVIN_VOIGT, close=True, duration=0.3, steps=4096
    ),
    "pendulum, base, Maxwell and rigid": Class(ph.HANGING, MAXWELL, RIGID, base=True),
    "pendulum, dry, Kelvin-Voigt r0 - alpha v": Class(
        ph.HANGING, KELVIN_VOIGT_LINEAR, dry=True, pressed=0.3
    ),
    "inverted, Walton and Kelvin-Voigt": Class(ph.INVERTED, WALTON, KELVIN_VOIGT, steps=2048),
    "ball, Hertz": Class(ph.BALL, HERTZ, steps=4096, derivatives=NOT_ANALYTIC),
    "ball, drag, Hunt-Crossley": Class(
        ph.BALL, HUNT_CROSSLEY, drag=True, steps=4096, derivatives=NOT_ANALYTIC
    ),
    "linear, base, power law p < 1 at zero force": Class(
        ph.LINEAR, POWER_LAW, base=True, pressed=0.3, steps=4096, derivatives=INFINITE_SLOPE
    ),
    "linear, power law p < 1 and rigid": Class(
        ph.LINEAR, POWER_LAW_PULLS, RIGID, steps=4096, derivatives=INFINITE_SLOPE
    ),
    "linear, dry, Hertz-dashpot and rigid": Class(
        ph.LINEAR, HERTZ_DASHPOT, RIGID, dry=True, steps=4096, derivatives=NOT_ANALYTIC
    ),
    "pendulum, base, two Hunt-Crossley": Class(
        ph.HANGING, HUNT_CROSSLEY, HUNT_CROSSLEY, base=True, steps=4096, derivatives=NOT_ANALYTIC
    ),
    "pendulum, dry, Pust-Peterka, pressed": Class(
        ph.HANGING, PUST_PETERKA, dry=True, pressed=0.4, steps=4096, derivatives=INFINITE_SLOPE
    ),
}


class Draw(NamedTuple):
    """One run's parameters, sample times, and the direction of its derivative."""

    parameters: Vector
    times: Vector
    direction: Vector
    on_stop: int  # the stop that the mass lies on at the start; -1 for none


def kinds(each: Class) -> Vector:
    """Vector of kinds, from which the independent simulator knows which parameters count."""
    laws = [each.lower, each.upper]
    return np.array(
        [
            each.oscillator,
            each.base,
            each.dry,
            *(ph.ABSENT if law is None else law.kind for law in laws),
            *(0 if law is None else law.separation for law in laws),
        ],
        dtype=np.int64,
    )


def tied(parameters: Vector, on_stop: int) -> Vector:
    """Parameters with the mass exactly on its stop, if it starts there."""
    if on_stop >= 0:
        gap = parameters[..., ph.STOPS + ph.WIDTH * on_stop]
        parameters[..., ph.POSITION] = -gap if on_stop == 0 else gap
        parameters[..., ph.VELOCITY] = 0
    return parameters


def draw(each: Class, rng: np.random.Generator) -> Draw:
    """A run."""
    p = np.zeros(ph.SIZE)
    used = []
    _draw_oscillator(each, rng, p, used)
    on_stop = _draw_start(each, rng, p)
    used += [ph.POSITION, ph.VELOCITY]
    for stop, law in enumerate((each.lower, each.upper)):
        if law is not None:
            at = ph.STOPS + ph.WIDTH * stop
            values = law.draw(rng, p[ph.MASS])
            p[at + 1 : at + 1 + len(values)] = values
            used += [at, *range(at + 1, at + 1 + min(len(values), law.still))]
    length = each.duration
    times = np.sort(rng.uniform(0.0, length, SAMPLES))
    times[-1] = length
    direction = np.zeros(ph.SIZE)
    direction[used] = rng.normal(size=len(used)) * np.where(p[used] == 0, 0.1, np.abs(p[used]))
    if p[ph.ZETA] == 0:
        direction[ph.ZETA] = (
            0  # all turns of an undamped motion are as near: their least has a kink
        )
    return Draw(p, times, tied(direction, on_stop), on_stop)


def _draw_oscillator(each: Class, rng: np.random.Generator, p: Vector, used: list[int]) -> None:
    p[ph.MASS] = 10 ** rng.uniform(-2, 0)
    used.append(ph.MASS)
    if each.oscillator == ph.BALL:
        p[ph.GRAVITY] = 9.81
        used.append(ph.GRAVITY)
        strength = 9.81
        if each.drag:
            p[ph.DRAG] = 10 ** rng.uniform(-2, 0.3)
            used.append(ph.DRAG)
    else:
        p[ph.OMEGA] = 10 ** rng.uniform(0.5, 1.2)
        p[ph.ZETA] = rng.choice([0.0, 10 ** rng.uniform(-3, -0.7)])
        used += [ph.OMEGA, ph.ZETA]
        strength = 0.3 * p[ph.OMEGA] ** 2
        if each.dry:
            p[ph.DRY] = p[ph.OMEGA] ** 2 * 10 ** rng.uniform(-3, -1.2)
            used.append(ph.DRY)
    if each.oscillator >= ph.HANGING:
        p[ph.LENGTH] = rng.uniform(0.05, 0.5)
        used.append(ph.LENGTH)
    if each.base:
        scale = p[ph.LENGTH] if each.oscillator >= ph.HANGING else 1.0
        p[ph.FREQUENCY] = 10 ** rng.uniform(0.7, 1.7) * (10 if each.close else 1)
        force = strength * 10 ** rng.uniform(-0.7, 0.5)
        p[ph.AMPLITUDE] = force * scale / p[ph.FREQUENCY] ** 2
        p[ph.PHASE] = rng.uniform(0, 2 * np.pi)
        used += [ph.AMPLITUDE, ph.FREQUENCY, ph.PHASE]


def _draw_start(each: Class, rng: np.random.Generator, p: Vector) -> int:
    lower, upper = ph.STOPS, ph.STOPS + ph.WIDTH
    speed = max(p[ph.OMEGA], 3.0)
    p[lower] = rng.uniform(0.0, 0.2)
    if each.pressed > 0 and rng.random() < each.pressed:
        p[lower] = -(10 ** rng.uniform(-5, -0.7))
    if each.oscillator == ph.BALL:
        p[lower] = rng.choice([0.0, rng.uniform(-0.1, 0.1)])
    if each.close:
        distance = rng.choice([1e-6, 10 ** rng.uniform(-6, -3)])
        p[lower] = rng.uniform(-1e-3, 1e-3)
        p[upper] = distance - p[lower]
        p[ph.POSITION] = -p[lower] + distance * rng.uniform(0.01, 0.99)
        p[ph.VELOCITY] = rng.normal() * 3 * np.sqrt(speed * distance)
    elif each.upper is not None:
        p[upper] = -p[lower] + rng.uniform(0.1, 0.5)
        p[ph.POSITION] = -p[lower] + rng.uniform(0.01, 0.99) * (p[lower] + p[upper])
        p[ph.VELOCITY] = rng.normal() * 0.2 * speed
    else:
        p[ph.POSITION] = -p[lower] + rng.uniform(0.01, 0.4)
        p[ph.VELOCITY] = rng.normal() * 0.1 * speed
    if each.lower is not None and each.lower.kind <= ph.POWER_RESTITUTION and rng.random() < 0.08:
        on_stop = 0 if each.upper is None or rng.random() < 0.5 else 1
        if on_stop == 0 or (each.upper is not None and each.upper.kind <= ph.POWER_RESTITUTION):
            tied(p, on_stop)
            return on_stop
    return -1


def model(each: Class, p: Array) -> tuple[ij.ImpactOscillator, ij.InitialState]:
    """The package's model and start of a vector of parameters."""
    base = None
    if each.base:
        base = ij.HarmonicMotion(p[ph.AMPLITUDE], p[ph.FREQUENCY], p[ph.PHASE])
    dry = p[ph.DRY] if each.dry else None
    if each.oscillator == ph.BALL:
        drag = p[ph.DRAG] if each.drag else None
        oscillator = ij.BouncingBall(p[ph.GRAVITY], mass=p[ph.MASS], drag=drag, base=base)
    elif each.oscillator == ph.LINEAR:
        oscillator = ij.LinearOscillator(
            p[ph.OMEGA], p[ph.ZETA], mass=p[ph.MASS], dry_friction=dry, base=base
        )
    else:
        equilibrium = ij.Hanging() if each.oscillator == ph.HANGING else ij.Inverted()
        oscillator = ij.Pendulum(
            p[ph.OMEGA],
            p[ph.ZETA],
            length=p[ph.LENGTH],
            mass=p[ph.MASS],
            dry_friction=dry,
            base=base,
            equilibrium=equilibrium,
        )
    stops = []
    for stop, law in enumerate((each.lower, each.upper)):
        at = ph.STOPS + ph.WIDTH * stop
        stops.append(None if law is None else ij.Stop(law.make(p[at + 1 : at + 6]), p[at]))
    return ij.ImpactOscillator(oscillator, *stops), ij.InitialState(p[ph.POSITION], p[ph.VELOCITY])
