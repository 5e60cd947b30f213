"""Steps of order eight (Dormand and Prince's DOP853) in one mode, and their dense output.

A mode is (phase, stop, direction of sliding); a state is (s, v, w, place that s is counted from).

Source of the coefficients: Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from .compiled import compiled
from .physics import (
    HAS_DRY,
    KELVIN_VOIGT_LINEAR,
    LAWS,
    MASS,
    creep,
    force,
    free,
    is_rigid,
    lever,
    place,
    side,
)

FLIGHT, CONTACT, DETACHED, REST = range(4)
NODES = 8  # of every search in a step
TOLERANCE = 1e-13
A = np.zeros((16, 16))
A[:12, :12], A[13:, :] = DOP853.A, DOP853.A_EXTRA
A[12, :12] = DOP853.B
C = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
B, D, E3, E5 = DOP853.B.copy(), DOP853.D.copy(), DOP853.E3.copy(), DOP853.E5.copy()


class Step(NamedTuple):
    """A step of the length `h` in the mode `m` from the state `y` at the time `t`.

    - `to`: state at its end.
    - `f`: coefficients of its dense output.
    - `turns`: shares of it at which the velocity passes zero, the first `turned` of the array.
    - `speed`: largest of it, or of what its acceleration makes of it.
    """

    t: complex
    y: np.ndarray
    h: float
    m: tuple[int, int, int]
    to: np.ndarray
    f: np.ndarray
    turns: np.ndarray
    turned: int
    speed: float


@compiled
def indented(kinds, p, stop, from_stop, s):
    """Penetration [m] of a stop at a displacement `s` from the place `from_stop`."""
    return -lever(kinds, p) * side(stop) * ((from_stop - place(p, stop)) + s)


@compiled
def pushing(kinds, p, m, y):
    """Force [N] of the stop in contact, or of the one whose indentation the mass is in."""
    depth = indented(kinds, p, m[1], y[3], y[0])
    rate = -lever(kinds, p) * side(m[1]) * y[1]
    return force(kinds, p, m[1], depth, rate, y[2])


@compiled
def drive(kinds, p, m, t, y):
    """Acceleration by everything but dry friction."""
    acceleration = free(kinds, p, t, y[3] + y[0], y[1])
    if m[0] == CONTACT:
        push = pushing(kinds, p, m, y)
        acceleration += side(m[1]) * push / (p[MASS] * lever(kinds, p))
    return acceleration


@compiled
def rates(kinds, p, m, t, y, out):
    """Time derivative of the state y in the mode m."""
    out[3] = 0
    out[2] = 0
    if m[0] == CONTACT and not is_rigid(kinds, m[1]):
        out[2] = creep(kinds, p, m[1], indented(kinds, p, m[1], y[3], y[0]), y[2])
    if m[0] == REST or (kinds[HAS_DRY] == 1 and m[2] == 0):
        out[0] = 0
        out[1] = 0
        return
    out[0] = y[1]
    out[1] = drive(kinds, p, m, t, y)
    if kinds[HAS_DRY] == 1:
        out[1] -= m[2] * p[6]


@compiled
def stages(kinds, p, m, t, y, h, first, last, k):
    """Fill k[first:last] with the slopes of the stages."""
    at = y.copy()
    for i in range(first, last):
        for c in range(3):
            total = 0.0j
            for j in range(i):
                if A[i, j] != 0:
                    total += A[i, j] * k[j, c]
            at[c] = y[c] + h * total
        rates(kinds, p, m, t + C[i] * h, at, k[i])


@compiled
def moved(y, h, k):
    """The state after the step."""
    end = y.copy()
    for c in range(3):
        total = 0.0j
        for j in range(12):
            total += B[j] * k[j, c]
        end[c] += h * total
    return end


@compiled
def after(kinds, p, m, t, y, h):
    """The state a time h, which may be complex, after y: a step of its own."""
    k = np.zeros((16, 4), np.complex128)
    stages(kinds, p, m, t, y, h, 0, 12, k)
    return moved(y, h, k)


@compiled
def step_error(h, k, scale):
    """Estimated error of a step, in units of the error allowed; `scale` has one for s, v and w."""
    e3, e5 = 0.0, 0.0
    for c in range(3):
        a, b = 0.0j, 0.0j
        for j in range(13):
            a += E3[j] * k[j, c]
            b += E5[j] * k[j, c]
        e3 += (a.real / scale[c]) ** 2
        e5 += (b.real / scale[c]) ** 2
    if e3 == 0 and e5 == 0:
        return 0.0
    return abs(h) * e5 / np.sqrt(3 * (e5 + 0.01 * e3))


@compiled
def dense(y, end, h, k, f):
    """Coefficients f[7, 4] of the interpolant; k must have all sixteen stages."""
    for c in range(3):
        change = end[c] - y[c]
        f[0, c] = change
        f[1, c] = h * k[0, c] - change
        f[2, c] = 2 * change - h * (k[12, c] + k[0, c])
        for i in range(4):
            total = 0.0j
            for j in range(16):
                total += D[i, j] * k[j, c]
            f[3 + i, c] = h * total


@compiled
def component(y, f, share, c):
    """One component of the interpolant at a share of the step."""
    total = 0.0j
    for i in range(7):
        total += f[6 - i, c]
        total *= share if i % 2 == 0 else 1 - share
    return y[c] + total


@compiled
def inside(y, f, share):
    """The interpolant at a share of the step."""
    out = y.copy()
    for c in range(3):
        out[c] = component(y, f, share, c)
    return out


@compiled
def turns_in(y, f, sigma):
    """Shares of the step at which the velocity passes zero, and their number.

    A mass that stands at its beginning slides in the direction `sigma`.
    """
    found = np.full(NODES, 2.0)
    count = 0
    before = y[1].real if y[1].real != 0 else float(sigma)
    for j in range(NODES):
        low, high = j / NODES, (j + 1) / NODES
        behind = component(y, f, high, 1).real
        if before * behind < 0:
            for _ in range(50):
                middle = 0.5 * (low + high)
                if component(y, f, middle, 1).real * before > 0:
                    low = middle
                else:
                    high = middle
            found[count] = 0.5 * (low + high)
            count += 1
        before = behind
    return found, count


@compiled
def trial(kinds, p, m, t, y, h, largest, k):
    """State after a step, its error in units of what is allowed, and its speed."""
    stages(kinds, p, m, t, y, h, 0, 13, k)
    to = moved(y, h, k)
    speed = max(abs(y[1].real), abs(to[1].real), h * abs(k[0, 1].real))
    unit = max(speed, (1e-6 if m[0] == FLIGHT else 1e-4) * largest, 1e-30)
    depth = 0.0
    if m[0] == CONTACT:
        depth = abs(indented(kinds, p, m[1], y[3], y[0]).real)
    inner = TOLERANCE * max(abs(y[2].real), lever(kinds, p).real * unit * h, depth)
    if kinds[LAWS + m[1]] == KELVIN_VOIGT_LINEAR:
        inner = 1.0
    error = step_error(h, k, (TOLERANCE * unit * h, TOLERANCE * unit, inner))
    return to, error if np.isfinite(error) else 1e10, speed


@compiled
def step_from(kinds, p, m, t, y, h, largest, k, f):
    """A step of at most h, the number of trials, and the length of the next.

    `largest` is the largest speed so far, `k` and `f` are filled. The length is zero if no step is
    short enough.
    """
    to, error, speed = trial(kinds, p, m, t, y, h, largest, k)
    trials = 1
    while error > 1:
        h *= max(0.1, 0.85 * error ** (-1 / 8))
        if h < 1e-15 * (1 + t.real) * 1e-3:
            break
        to, error, speed = trial(kinds, p, m, t, y, h, largest, k)
        trials += 1
    stages(kinds, p, m, t, y, h, 13, 16, k)
    dense(y, to, h, k, f)
    turns, turned = turns_in(y, f, m[2])
    grown = 0.0 if error > 1 else h * min(4.0, 0.85 * max(error, 1e-10) ** (-1 / 8))
    return Step(t, y, h, m, to, f, turns, turned, speed), trials, grown
