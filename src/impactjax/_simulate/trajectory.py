"""What a simulation returns."""

import equinox as eqx
from jaxtyping import Array, Float, Int

from impactjax._results import RESULTS
from impactjax._simulate.impact_log import ImpactLog


class Stats(eqx.Module):
    """How much work a lane was."""

    steps: Int[Array, "..."]


class Trajectory(eqx.Module):
    """A simulated lane.

    - `ts`: the times asked for [s].
    - `position`: the coordinate at these times [rad] or [m].
    - `velocity`: its rate [rad/s] or [m/s].
    - `impacts`: the impact log.
    - `result`: what became of the lane.
    - `stats`: how much work it was.

    At the time of an impact samples show the state after it. Samples beyond the point where a lane
    failed are NaN.
    """

    ts: Float[Array, "... samples"]
    position: Float[Array, "... samples"]
    velocity: Float[Array, "... samples"]
    impacts: ImpactLog
    result: RESULTS
    stats: Stats
