"""Result of a simulation."""

import equinox as eqx
from jaxtyping import Array, Float, Int

from impactjax._known import is_known
from impactjax._results import RESULTS
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.jumps import Jumps
from impactjax._simulate.lane_state import LaneState
from impactjax._simulate.rest_log import RestLog


class Stats(eqx.Module):
    """Statistics of a lane.

    - `steps`: number of steps.
    """

    steps: Int[Array, "..."]


class Trajectory(eqx.Module):
    """A simulated lane.

    - `ts`: sample times [s].
    - `position`: coordinate at these times [rad] or [m].
    - `velocity`: its rate [rad/s] or [m/s].
    - `impacts`: the impact log.
    - `rests`: the rest log.
    - `jumps`: times and sizes of the jumps of velocity.
    - `deepest_penetration`, `peak_force`: of the contact of each impact, in the rows of the impact
      log; zero at a rigid stop [m], [N].
    - `nearest_miss`: least distance from a stop without touching it, at a turn in flight or at the
      end of a run on the way to a stop; infinite without either [m]. Together with the smallest
      approach speed in the impact log it shows how far the number of impacts is from changing:
      derivatives are valid as long as neither vanishes.
    - `magnification`: largest factor by which a single impact or near miss magnifies an error; at
      least 1 [1]. It is large if the motion nearly grazes a stop: errors are then about the
      tolerance times this number. The factors of several such impacts multiply.
    - `final`: state of the lane, from which `simulate` goes on as if there had been no cut.
    - `result`: result code.
    - `stats`: number of steps.

    At the time of an impact, samples show the state after it. Samples after a failure are NaN.
    """

    ts: Float[Array, "... samples"]
    position: Float[Array, "... samples"]
    velocity: Float[Array, "... samples"]
    impacts: ImpactLog
    rests: RestLog
    jumps: Jumps
    deepest_penetration: Float[Array, "... impacts"]
    peak_force: Float[Array, "... impacts"]
    nearest_miss: Float[Array, "..."]
    magnification: Float[Array, "..."]
    final: LaneState
    result: RESULTS
    stats: Stats

    def __repr__(self) -> str:
        if not is_known(self) or self.ts.ndim != 1:
            return eqx.tree_pformat(self)
        words = str(RESULTS[self.result]).split(".")[0]
        counts = f"{int(self.impacts.count)} impacts, {int(self.rests.count)} rests"
        return f"Trajectory({self.ts.shape[0]} samples, {counts}: {words})"
