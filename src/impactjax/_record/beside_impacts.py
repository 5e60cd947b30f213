"""The samples of a recording that impacts may show."""

import numpy as np

from impactjax._known import AnyArray, namespace
from impactjax._simulate.impact_log import ImpactLog

_BESIDE = 2  # samples before and after an impact


def beside_impacts(ts: AnyArray, impacts: ImpactLog, delay: AnyArray) -> AnyArray:
    """Mask of the samples during impacts, and of two before and after each.

    **Arguments:**

    - `ts`: times of the samples [s].
    - `impacts`: impacts of the system.
    - `delay`: time from the motion to its record [s].
    """
    xp = namespace(ts, impacts, delay)
    begin = xp.where(impacts.happened, impacts.time, xp.inf) + delay
    end = xp.where(impacts.complete, begin + impacts.duration, xp.inf)
    number = np.arange(ts.shape[0])
    behind, ahead = (ts[np.clip(number + n, 0, number[-1])] for n in (-_BESIDE, _BESIDE))
    return xp.any((ahead[:, None] >= begin) & (behind[:, None] <= end), axis=-1)
