"""The contact laws by the names of the command line, each with where a search starts.

A search starts from a law that has the restitution that was seen at the speed that was seen, and a
contact that lasts about as long as a few samples.
"""

import math
from collections.abc import Callable

from scipy import special

from impactjax._first_look.first_estimates import FirstEstimates
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

NO_LAW = "none"  # free flight


def _kelvin_voigt(seen: FirstEstimates) -> KelvinVoigt:
    return KelvinVoigt.from_restitution(seen.contact_frequency, seen.restitution)


def _stiffness(seen: FirstEstimates, n: float) -> float:
    """Stiffness of a spring k δⁿ whose contact, without damping, lasts as long as was guessed."""
    m, v = float(seen.oscillator.mass), seen.speed
    duration = math.pi / seen.contact_frequency
    deepest = (n + 1) * v * duration / (2 * special.beta(1 / 2, 1 / (n + 1)))
    return (n + 1) * m * v**2 / (2 * deepest ** (n + 1))


def _walton(seen: FirstEstimates) -> Walton:
    return Walton.from_restitution(_stiffness(seen, 1.0), seen.restitution, seen.speed)


def _simon(seen: FirstEstimates) -> Simon:
    return Simon.from_restitution(_stiffness(seen, 1.5), seen.restitution, seen.speed)


def _hunt_crossley(seen: FirstEstimates) -> HuntCrossley:
    return HuntCrossley.from_restitution(_stiffness(seen, 1.5), seen.restitution, seen.speed)


def _pust_peterka(seen: FirstEstimates) -> PustPeterka:
    """With q = 1, where it is Simon's."""
    simon = _simon(seen)
    return PustPeterka(simon.k, simon.c)


def _hertz_dashpot(seen: FirstEstimates) -> HertzDashpot:
    """With the dashpot of Kelvin-Voigt."""
    linear = _kelvin_voigt(seen)
    return HertzDashpot(
        _stiffness(seen, 1.5), 2 * linear.gamma * linear.omega0 * seen.oscillator.mass
    )


def _power_law(seen: FirstEstimates) -> PowerLaw:
    """Tsuji's, whose restitution is the same at every speed: c = √5 γ √(m k)."""
    k, gamma = _stiffness(seen, 1.5), _kelvin_voigt(seen).gamma
    return PowerLaw(k, gamma * math.sqrt(5 * k * float(seen.oscillator.mass)), 1.5, 0.25, 1.0)


LAWS: dict[str, Callable[[FirstEstimates], AbstractLaw]] = {
    "restitution": lambda seen: Restitution(seen.restitution),
    "linear-restitution": lambda seen: LinearRestitution(*seen.restitution_line),
    "power-restitution": lambda seen: PowerRestitution(*seen.restitution_power),
    "kelvin-voigt": _kelvin_voigt,
    "kelvin-voigt-linear-restitution": lambda seen: KelvinVoigtLinearRestitution(
        seen.contact_frequency, *seen.restitution_line
    ),
    "maxwell": lambda seen: Maxwell.from_restitution(seen.contact_frequency, seen.restitution),
    "walton": _walton,
    "hertz": lambda seen: Hertz(_stiffness(seen, 1.5)),
    "simon": _simon,
    "hunt-crossley": _hunt_crossley,
    "pust-peterka": _pust_peterka,
    "hertz-dashpot": _hertz_dashpot,
    "power-law": _power_law,
}

USUAL_LAWS = ("restitution", "linear-restitution", "kelvin-voigt")  # tried if none is named
