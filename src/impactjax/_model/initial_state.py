"""State of the coordinate where a run starts."""

import equinox as eqx

from impactjax._parameter import as_parameter, parameter
from impactjax._types import Coordinate, CoordinateRate


class InitialState(eqx.Module):
    """Where a run starts.

    **Arguments:**

    - `position`: the coordinate [rad] or [m].
    - `velocity`: its rate [rad/s] or [m/s].
    """

    position: Coordinate = eqx.field(converter=as_parameter, metadata=parameter("rad or m"))
    velocity: CoordinateRate = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s or m/s"), default=0.0
    )
