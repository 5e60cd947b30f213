"""Equations of motion and contact, written anew in complex numbers.

The real part is the motion, the imaginary part its derivative in one direction of the parameters,
scaled by a tiny number: whatever is analytic carries it along exactly. A run's parameters are one
vector; which of them count is told by a vector of kinds.
"""

import cmath

from .compiled import compiled

# Places in the vector of parameters.
OMEGA, ZETA, GRAVITY, DRAG, LENGTH, MASS, DRY, AMPLITUDE, FREQUENCY, PHASE = range(10)
STOPS, WIDTH = 10, 6  # of each stop its gap and up to five parameters of its law
POSITION, VELOCITY, SIZE = 22, 23, 24

# Places in the vector of kinds.
OSCILLATOR, HAS_BASE, HAS_DRY, LAWS, SEPARATIONS, KINDS = 0, 1, 2, 3, 5, 7
BALL, LINEAR, HANGING, INVERTED = range(4)
ABSENT = -1
(
    RESTITUTION,
    LINEAR_RESTITUTION,
    POWER_RESTITUTION,
    KELVIN_VOIGT,
    KELVIN_VOIGT_LINEAR,
    MAXWELL,
    POWER_LAW,
    WALTON,
    HUNT_CROSSLEY,
    PUST_PETERKA,
    HERTZ,
    HERTZ_DASHPOT,
) = range(12)
AT_ZERO_PENETRATION, AT_ZERO_FORCE = 0, 1


@compiled
def lever(kinds, p):
    """Metres of contact per unit of the coordinate."""
    return p[LENGTH] if kinds[OSCILLATOR] >= HANGING else 1.0 + 0.0j


@compiled
def side(stop):
    """The direction in which a stop pushes."""
    return 1.0 if stop == 0 else -1.0


@compiled
def place(p, stop):
    """Place at which a stop stands."""
    return -side(stop) * p[STOPS + WIDTH * stop]


@compiled
def is_rigid(kinds, stop):
    """Tell whether an impact is a jump."""
    return kinds[LAWS + stop] <= POWER_RESTITUTION


@compiled
def free(kinds, p, t, x, v):
    """Acceleration without dry friction and contact."""
    shake = 0.0j
    if kinds[HAS_BASE] == 1:
        shake = p[AMPLITUDE] * p[FREQUENCY] ** 2 * cmath.sin(p[FREQUENCY] * t + p[PHASE])
    if kinds[OSCILLATOR] == BALL:
        drag = p[DRAG] * v * v
        return -p[GRAVITY] + shake + (drag if v.real < 0 else -drag)
    damping = -2 * p[ZETA] * p[OMEGA] * v
    if kinds[OSCILLATOR] == LINEAR:
        return damping - p[OMEGA] ** 2 * x + shake
    pull = p[OMEGA] ** 2 * cmath.sin(x)
    shake = shake / p[LENGTH] * cmath.cos(x)
    return damping + shake + (pull if kinds[OSCILLATOR] == INVERTED else -pull)


@compiled
def restitution(kinds, p, stop, speed):
    """Coefficient of restitution at an approach speed [m/s]."""
    at = STOPS + WIDTH * stop + 1
    kind = kinds[LAWS + stop]
    if kind == RESTITUTION:
        return p[at]
    if kind == LINEAR_RESTITUTION:
        return p[at] - p[at + 1] * speed
    if speed.real == 0 or speed.real ** p[at + 1].real <= p[at].real:
        return 1.0 + 0.0j
    return p[at] * cmath.exp(-p[at + 1] * cmath.log(speed))


@compiled
def touched(kinds, p, stop, speed):
    """The law's internal state as contact begins at a speed [m/s]."""
    if kinds[LAWS + stop] == KELVIN_VOIGT_LINEAR:
        at = STOPS + WIDTH * stop + 1
        loss = cmath.log(p[at + 1] - p[at + 2] * speed)
        return -loss / cmath.sqrt(cmath.pi**2 + loss**2)
    return 0.0j


@compiled
def raised(x, exponent):
    """xⁿ, zero where x is not positive; one for n = 0."""
    if exponent.real == 0:
        return 1.0 + 0.0j
    if x.real <= 0:
        return 0.0j
    if exponent.imag == 0:
        if exponent.real == 1:
            return x
        if exponent.real == 1.5:
            return x * cmath.sqrt(x)
    return cmath.exp(exponent * cmath.log(x))


@compiled
def force(kinds, p, stop, depth, rate, w):
    """Contact force [N] of penetration [m] and its rate [m/s]; positive pushes the mass off."""
    at = STOPS + WIDTH * stop + 1
    a, b, c = p[at], p[at + 1], p[at + 2]
    kind, m = kinds[LAWS + stop], p[MASS]
    if kind == KELVIN_VOIGT:
        return m * (a**2 * depth + 2 * a * b * rate)
    if kind == KELVIN_VOIGT_LINEAR:
        return m * (a**2 * depth + 2 * a * w * rate)
    if kind == MAXWELL:
        return m * a**2 * (depth - w)
    if kind == WALTON:
        return a * depth + b * depth * rate
    if kind == HUNT_CROSSLEY:
        return a * raised(depth, c) * (1 + b * rate)
    if kind == HERTZ:
        return a * raised(depth, 1.5 + 0.0j)
    if kind == HERTZ_DASHPOT:
        return a * raised(depth, 1.5 + 0.0j) + b * rate
    if kind == PUST_PETERKA:
        n, damping, q = 1.5 + 0.0j, a * b, c
        p_, spring = n, a
    else:
        spring, damping, n, p_, q = a, b, c, p[at + 3], p[at + 4]
    turned = raised(rate, q) if rate.real >= 0 else -raised(-rate, q)
    if rate.real == 0 and q.real > 0:
        turned = 0.0j
    return spring * raised(depth, n) + damping * raised(depth, p_) * turned


@compiled
def creep(kinds, p, stop, depth, w):
    """Rate of the internal state during contact."""
    if kinds[LAWS + stop] == MAXWELL:
        at = STOPS + WIDTH * stop + 1
        return 2 * p[at + 1] * p[at] * (depth - w)
    return 0.0j
