"""Result of `solve`."""

import equinox as eqx
from jaxtyping import Array, Float, Int

from impactjax._hybrid.event_log import EventLog
from impactjax._hybrid.lane import Start
from impactjax._hybrid.system import Mode, State
from impactjax._results import RESULTS


class Solution(eqx.Module):
    """A solved lane of a hybrid system.

    - `ts`: sample times.
    - `ys`, `modes`: state and mode at these times; at an event, those after it. NaN after a failure
      and after an event that ends the run.
    - `events`: the event log.
    - `final`: start of the step that contains the last sample time. A run from there goes on
      exactly as if there had been no cut; after an event that ends the run it does not go on.
    - `result`: result code.
    - `steps`: number of steps.
    """

    ts: Float[Array, "... samples"]
    ys: State
    modes: Mode
    events: EventLog
    final: Start
    result: RESULTS
    steps: Int[Array, "..."]
