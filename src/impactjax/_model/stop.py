"""A stop: its position and its contact law."""

import equinox as eqx

from impactjax._model.law import AbstractLaw
from impactjax._parameter import (
    as_parameter,
    parameter,
    raise_if_violated,
    range_requirements,
)
from impactjax._refusal import of_kind
from impactjax._shown import with_numbers
from impactjax._types import Coordinate


class Stop(eqx.Module):
    """A stop at a distance `gap` from the coordinate's origin, with a contact law.

    As the lower stop of a model it stands at −gap and the mass moves above it; as the upper stop
    it stands at +gap.

    **Arguments:**

    - `law`: contact law.
    - `gap`: distance from the origin to the stop, in units of the coordinate [rad] or [m].
    """

    law: AbstractLaw = eqx.field(converter=of_kind("law", AbstractLaw, "Restitution(0.7)"))
    gap: Coordinate = eqx.field(
        converter=as_parameter, metadata=parameter("rad or m", known=True), default=0.0
    )

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))

    __repr__ = with_numbers
