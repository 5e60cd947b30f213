"""Location of the special points between two neighbours on a branch, to rounding."""

import numpy as np

from impactjax._response.linear import Vector
from impactjax._response.point import Point, corrected
from impactjax._response.special import Kind, Special, signed, special, values_at

_EXACT = 4 * np.finfo(float).eps
_SAME = 1e-9  # distance of two points that are one, in units of that of the neighbours


class LostError(ArithmeticError):
    """Newton's method has lost the branch."""


def specials_between(
    first: Point, second: Point, sizes: Vector, between: tuple[float, float]
) -> list[Special]:
    """The special points between two neighbours, in order, up to one that ends the branch.

    **Raises** `LostError` if a point between them is not found.
    """
    from scipy import optimize  # a tenth of a second that other verbs can do without

    length = float(first.tangent @ (second.place - first.place))
    before, after = (values_at(point, sizes, between) for point in (first, second))

    def on_branch(at: float) -> Point:
        guess = first.place + at / length * (second.place - first.place)
        point = corrected(first, guess, sizes, at)
        if point is None:
            raise LostError
        return point

    def zero(kind: Kind, number: int) -> float:
        def value(at: float) -> float:
            known = {0.0: before, length: after}.get(at)
            values = known or values_at(on_branch(at), sizes, between)
            return float(values[kind][number])

        found = optimize.brentq(value, 0.0, length, xtol=_EXACT * length, rtol=_EXACT)
        return float(np.asarray(found))

    zeros: list[tuple[float, Kind]] = []
    for kind in Kind:
        a, b = before[kind], after[kind]
        changes = (a >= 0) & (b < 0) if signed(kind) else a * b < 0
        zeros += [(zero(kind, int(number)), kind) for number in np.flatnonzero(changes)]
    found: list[Special] = []
    last = -np.inf
    for at, kind in sorted(zeros, key=lambda pair: pair[0]):
        own = special(kind, on_branch(at), sizes)
        again = found and own is not None and own.kind == found[-1].kind
        if own is None or (again and at <= last + _SAME * length):
            continue
        found.append(own)
        last = at
        if own.ends:
            break
    return found
