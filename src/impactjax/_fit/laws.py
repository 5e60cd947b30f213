"""The contact laws by the names of the command line, each with where a search starts."""

from collections.abc import Callable

from impactjax._fit.first_estimates import FirstEstimates
from impactjax._model.kelvin_voigt import KelvinVoigt
from impactjax._model.law import AbstractLaw
from impactjax._model.linear_restitution import LinearRestitution
from impactjax._model.restitution import Restitution

NO_LAW = "none"  # free flight

LAWS: dict[str, Callable[[FirstEstimates], AbstractLaw]] = {
    "restitution": lambda seen: Restitution(seen.restitution),
    "linear-restitution": lambda seen: LinearRestitution(*seen.restitution_line),
    "kelvin-voigt": lambda seen: KelvinVoigt.from_restitution(
        seen.contact_frequency, seen.restitution
    ),
}
