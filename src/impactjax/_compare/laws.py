"""Table of contact laws by the names of the command line, each with its starting values.

A search starts from a law with the restitution that the first look found at the speed it found, and
with a contact as long as the pulses in the record, or else as a few samples.
"""

import math
from collections.abc import Callable

from scipy import special

from impactjax._first_look.first_look import FirstLook
from impactjax._model.hertz import Hertz
from impactjax._model.hertz_dashpot import HertzDashpot
from impactjax._model.hunt_crossley import HuntCrossley
from impactjax._model.kelvin_voigt import KelvinVoigt
from impactjax._model.kelvin_voigt_linear_restitution import KelvinVoigtLinearRestitution
from impactjax._model.law import AbstractLaw
from impactjax._model.linear_restitution import LinearRestitution
from impactjax._model.maxwell import Maxwell
from impactjax._model.power_law import PowerLaw
from impactjax._model.power_restitution import PowerRestitution
from impactjax._model.pust_peterka import PustPeterka
from impactjax._model.restitution import Restitution
from impactjax._model.simon import Simon
from impactjax._model.walton import Walton

__all__ = [
    "LAWS",
    "Hertz",
    "HertzDashpot",
    "HuntCrossley",
    "KelvinVoigt",
    "KelvinVoigtLinearRestitution",
    "LinearRestitution",
    "Maxwell",
    "PowerLaw",
    "PowerRestitution",
    "PustPeterka",
    "Restitution",
    "Simon",
    "Walton",
]

NO_LAW = "none"  # free flight


def _kelvin_voigt(look: FirstLook) -> KelvinVoigt:
    return KelvinVoigt.from_restitution(look.contact_frequency, look.restitution)


def _stiffness(look: FirstLook, n: float) -> float:
    """Stiffness k of an undamped spring k δⁿ with the contact duration of the first look,
    T = 2 δ_max B(1/2, 1/(n+1)) / ((n+1) v) and k δ_max^(n+1)/(n+1) = m v²/2.
    """
    m, v = float(look.oscillator.mass), look.speed
    duration = math.pi / look.contact_frequency
    deepest = (n + 1) * v * duration / (2 * special.beta(1 / 2, 1 / (n + 1)))
    return (n + 1) * m * v**2 / (2 * deepest ** (n + 1))


def _walton(look: FirstLook) -> Walton:
    return Walton.from_restitution(_stiffness(look, 1.0), look.restitution, look.speed)


def _simon(look: FirstLook) -> Simon:
    return Simon.from_restitution(_stiffness(look, 1.5), look.restitution, look.speed)


def _hunt_crossley(look: FirstLook) -> HuntCrossley:
    return HuntCrossley.from_restitution(_stiffness(look, 1.5), look.restitution, look.speed)


def _pust_peterka(look: FirstLook) -> PustPeterka:
    """Pust and Peterka's law with q = 1, where it is Simon's."""
    simon = _simon(look)
    return PustPeterka(simon.k, simon.c)


def _hertz_dashpot(look: FirstLook) -> HertzDashpot:
    """A Hertzian spring with the dashpot of the Kelvin-Voigt law."""
    linear = _kelvin_voigt(look)
    return HertzDashpot(
        _stiffness(look, 1.5), 2 * linear.gamma * linear.omega0 * look.oscillator.mass
    )


def _power_law(look: FirstLook) -> PowerLaw:
    """Tsuji's law, with the same restitution at every speed: c = √5 γ √(m k), n = 3/2, p = 1/4."""
    k, gamma = _stiffness(look, 1.5), _kelvin_voigt(look).gamma
    return PowerLaw(k, gamma * math.sqrt(5 * k * float(look.oscillator.mass)), 1.5, 0.25, 1.0)


LAWS: dict[str, Callable[[FirstLook], AbstractLaw]] = {
    "restitution": lambda look: Restitution(look.restitution),
    "linear-restitution": lambda look: LinearRestitution(*look.restitution_line),
    "power-restitution": lambda look: PowerRestitution(*look.restitution_power),
    "kelvin-voigt": _kelvin_voigt,
    "kelvin-voigt-linear-restitution": lambda look: KelvinVoigtLinearRestitution(
        look.contact_frequency, *look.restitution_line
    ),
    "maxwell": lambda look: Maxwell.from_restitution(look.contact_frequency, look.restitution),
    "walton": _walton,
    "hertz": lambda look: Hertz(_stiffness(look, 1.5)),
    "simon": _simon,
    "hunt-crossley": _hunt_crossley,
    "pust-peterka": _pust_peterka,
    "hertz-dashpot": _hertz_dashpot,
    "power-law": _power_law,
}

USUAL_FORCE_LAWS = ("kelvin-voigt", "hunt-crossley")  # those for a record of force
USUAL_LAWS = ("restitution", "linear-restitution", "kelvin-voigt")  # tried if none is named
