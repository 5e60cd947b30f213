"""Points of a branch of orbits, and the correction of a guess to the branch."""

from typing import NamedTuple

import numpy as np

from impactjax._response.linear import Linear, Vector, linearised
from impactjax._response.newton import Constraint, solved


class Point(NamedTuple):
    """Point of a branch.

    - `linear`: the equations of its orbit.
    - `place`: its unknowns in units of their sizes.
    - `tangent`: direction of the branch there, of length 1.
    - `steps`: number of Newton steps that led to it.
    """

    linear: Linear
    place: Vector
    tangent: Vector
    steps: int

    def reversed(self) -> "Point":
        """The same point in the other direction."""
        return self._replace(tangent=-self.tangent)


def first_point(linear: Linear, sizes: Vector) -> Point:
    """The point of an orbit, with a tangent along which the parameter grows."""
    parameter = np.zeros_like(sizes)
    parameter[-1] = 1.0
    tangent = tangent_at(linear, sizes, parameter)
    return Point(linear, linear.unknowns / sizes, tangent, 0)


def corrected(point: Point, guess: Vector, sizes: Vector, length: float) -> Point | None:
    """The point of the branch in the plane across the tangent of another one, `length` ahead;
    `None` if Newton's method does not find it.
    """
    plane = Constraint(point.tangent, float(point.tangent @ point.place) + length)
    found = solved(linearised(point.linear.following(), guess * sizes), sizes, plane)
    if not found.converged:
        return None
    tangent = tangent_at(found.linear, sizes, point.tangent)
    return Point(found.linear, found.linear.unknowns / sizes, tangent, found.steps)


def tangent_at(linear: Linear, sizes: Vector, like: Vector) -> Vector:
    """Direction of the branch of an orbit, on the side of another direction."""
    matrix = linear.jacobian() * sizes
    *_, tangent = np.linalg.svd(matrix)[2]
    return tangent * np.copysign(1.0, tangent @ like)
