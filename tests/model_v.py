"""Closed form of the orbits of model V: x″ + b x′ + x + 1 = A cos ωt with a rigid stop at x = 0 of
restitution r, one impact in n periods of the force.

The steady forced motion p = (1 + V w₁, V w₂) above the equilibrium −1 at the impact, of speed V,
follows from the state after a period: (0, V) − p = Φ((0, −r V) − p).
"""

from typing import NamedTuple

import mpmath
import numpy as np

DAMPING, RESTITUTION = mpmath.mpf("0.04"), mpmath.mpf("0.9")


class ClosedForm(NamedTuple):
    """Orbits at one frequency, as functions of their impact speed."""

    omega: mpmath.mpf
    flow: mpmath.matrix
    w: mpmath.matrix

    def amplitude(self, speed):
        """Amplitude A of the force."""
        b, o = DAMPING, self.omega
        x, v = 1 + speed * self.w[0], speed * self.w[1]
        square = ((1 - o**2) ** 2 + (b * o) ** 2) * (x**2 + (v / o) ** 2)
        return float(mpmath.nstr(mpmath.sqrt(square), 20))

    def multipliers(self, speed):
        """Eigenvalues of the monodromy matrix S Φ, with the saltation matrix S."""
        found = np.array([complex(each) for each in mpmath.eig(self._monodromy(speed))[0]])
        return found[np.argsort(-np.abs(found))]

    def fold(self):
        """Speed at which the amplitude has a minimum or maximum."""
        return -self.w[0] / (self.w[0] ** 2 + (self.w[1] / self.omega) ** 2)

    def doubling(self):
        """Speed at which a multiplier is −1."""

        def flip(speed):
            return mpmath.det(self._monodromy(speed) + mpmath.eye(2))

        return mpmath.findroot(flip, (mpmath.mpf("0.003"), mpmath.mpf("0.1")), solver="anderson")

    def _monodromy(self, speed):
        b, r, o = DAMPING, RESTITUTION, self.omega
        push = (1 - o**2) * (1 + speed * self.w[0]) + b * speed * self.w[1] - 1
        return mpmath.matrix([[-r, 0], [(1 + r) * push / speed, -r]]) * self.flow


def closed_form(omega: str, periods: int) -> ClosedForm:
    """Orbits with one impact in a number of periods of the force."""
    o = mpmath.mpf(omega)
    flow = mpmath.expm(mpmath.matrix([[0, 1], [-1, -DAMPING]]) * periods * 2 * mpmath.pi / o)
    kick = mpmath.matrix([0, 1]) + flow * mpmath.matrix([0, RESTITUTION])
    return ClosedForm(o, flow, mpmath.lu_solve(mpmath.eye(2) - flow, kick))
