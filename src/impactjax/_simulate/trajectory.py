"""What a simulation returns."""

import equinox as eqx
from jaxtyping import Array, Float, Int

from impactjax._known import is_known
from impactjax._results import RESULTS
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.rest_log import RestLog


class Stats(eqx.Module):
    """How much work a lane was."""

    steps: Int[Array, "..."]


class Trajectory(eqx.Module):
    """A simulated lane.

    - `ts`: the times asked for [s].
    - `position`: the coordinate at these times [rad] or [m].
    - `velocity`: its rate [rad/s] or [m/s].
    - `impacts`: the impact log.
    - `rests`: when the mass lay on a rigid stop.
    - `nearest_miss`: how close the mass came to a stop that it did not touch, at the closest turn
      before one or at the end of the run on its way to one; infinite without [m]. Together with the
      smallest approach speed in the impact log it tells how far the number of impacts is from
      changing: derivatives hold as long as neither comes to zero.
    - `magnification`: by how much a single impact, or near miss, magnifies an error at most, at
      least 1 [1]. Large where the motion nearly grazes a stop: errors are then about the tolerance
      times this number, and several such impacts multiply theirs.
    - `result`: what became of the lane.
    - `stats`: how much work it was.

    At the time of an impact samples show the state after it. Samples beyond the point where a lane
    failed are NaN.
    """

    ts: Float[Array, "... samples"]
    position: Float[Array, "... samples"]
    velocity: Float[Array, "... samples"]
    impacts: ImpactLog
    rests: RestLog
    nearest_miss: Float[Array, "..."]
    magnification: Float[Array, "..."]
    result: RESULTS
    stats: Stats

    def __repr__(self) -> str:
        if not is_known(self) or self.ts.ndim != 1:
            return eqx.tree_pformat(self)
        words = str(RESULTS[self.result]).split(".")[0]
        counts = f"{int(self.impacts.count)} impacts, {int(self.rests.count)} rests"
        return f"Trajectory({self.ts.shape[0]} samples, {counts}: {words})"
