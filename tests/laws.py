"""Contact laws for all tests: each once, by its name on the command line, with usual values."""

from collections.abc import Callable
from typing import Any, NamedTuple

import impactjax as ij

MASS = 0.02  # of a small pendulum [kg]


class Usual(NamedTuple):
    """A law as a function of its parameters, and usual values of them."""

    make: Callable[..., Any]
    values: tuple[float, ...]

    @property
    def law(self) -> Any:
        return self.make(*self.values)


def without_pull(omega0, gamma):
    return ij.KelvinVoigt(omega0, gamma, separation=ij.AtZeroForce())


RIGID = {
    "restitution": Usual(ij.Restitution, (0.6,)),
    "linear-restitution": Usual(ij.LinearRestitution, (0.7, 0.2)),
    "power-restitution": Usual(ij.PowerRestitution, (0.6, 0.1)),
}
ANALYTIC = {  # force laws with a Taylor series
    "kelvin-voigt": Usual(ij.KelvinVoigt, (727.5, 0.18)),
    "kelvin-voigt without pull": Usual(without_pull, (727.5, 0.18)),
    "kelvin-voigt-linear-restitution": Usual(ij.KelvinVoigtLinearRestitution, (727.5, 0.7, 0.2)),
    "maxwell": Usual(ij.Maxwell, (727.5, 0.18)),
    "walton": Usual(ij.Walton, (1e4, 2e3)),
}
WITH_BROKEN_POWERS = {
    "hertz": Usual(ij.Hertz, (1e6,)),
    "simon": Usual(ij.Simon, (1e6, 0.3)),
    "hunt-crossley": Usual(ij.HuntCrossley, (1e6, 0.3, 1.4)),
    "pust-peterka": Usual(ij.PustPeterka, (1e6, 0.3, 2.0)),
    "hertz-dashpot": Usual(ij.HertzDashpot, (1e6, 2.0)),
    "power-law": Usual(ij.PowerLaw, (1e6, 2e4, 1.5, 1.0, 1.2)),
}
FORCES = ANALYTIC | WITH_BROKEN_POWERS
LAWS = RIGID | FORCES
INTEGRATED = ("pust-peterka", "hertz-dashpot", "power-law")  # without a closed form
CLOSED = tuple(name for name in FORCES if name not in INTEGRATED)

# The same forces as power laws, k δⁿ + c δᵖ |δ′|^q sgn δ′.
AS_POWER_LAWS = {
    "kelvin-voigt": (MASS * 727.5**2, 2 * 0.18 * 727.5 * MASS, 1.0, 0.0, 1.0),
    "walton": (1e4, 2e3, 1.0, 1.0, 1.0),
    "hertz": (1e6, 0.0, 1.5, 0.0, 1.0),
    "simon": (1e6, 3e5, 1.5, 1.5, 1.0),
    "hunt-crossley": (1e6, 3e5, 1.4, 1.4, 1.0),
    "pust-peterka": (1e6, 3e5, 1.5, 1.5, 2.0),
    "hertz-dashpot": (1e6, 2.0, 1.5, 0.0, 1.0),
    "power-law": (1e6, 2e4, 1.5, 1.0, 1.2),
}
