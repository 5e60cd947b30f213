"""Array types with their shapes and units.

The package computes in SI units and radians; degrees, ms and mm occur only in files and figures.
The *coordinate* is in rad for a pendulum and in m for everything that moves on a line. A type
describes one lane unless stated otherwise; `jax.vmap` adds the axis of lanes.
"""

from collections.abc import Sequence

from jaxtyping import Array, ArrayLike, Bool, Float, Int

Numbers = ArrayLike | Sequence[float]  # all that becomes an array

Coordinate = Float[Array, "..."]  # [rad] or [m]
CoordinateRate = Float[Array, "..."]  # [rad/s] or [m/s]
CoordinateAcceleration = Float[Array, "..."]  # [rad/s²] or [m/s²]
Time = Float[Array, "..."]  # [s]
AngularFrequency = Float[Array, "..."]  # [rad/s]
AngularAcceleration = Float[Array, "..."]  # [rad/s²]
Acceleration = Float[Array, "..."]  # [m/s²]
Length = Float[Array, "..."]  # [m]
Lever = Float[Array, "..."]  # [m/rad], or [1] on a line
Speed = Float[Array, "..."]  # [m/s], positive
Mass = Float[Array, "..."]  # [kg]
Force = Float[Array, "..."]  # [N]
Energy = Float[Array, "..."]  # [J]
Ratio = Float[Array, "..."]  # [1]
InverseSpeed = Float[Array, "..."]  # [s/m]
InverseLength = Float[Array, "..."]  # [1/m]

Scalar = Float[Array, ""]  # one number of one lane
Flag = Bool[Array, ""]
Code = Int[Array, ""]
Each = Float[Array, "..."]  # one number, or one for each of several functions

Samples = Float[Array, " samples"]
Factors = Float[Array, " impacts"]  # [1]
Steps = Float[Array, " steps"]
