"""Hints at what else may explain the best of several fits."""

from collections.abc import Mapping

from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import ranked
from impactjax._compare.oscillators import DRAG, may_have_drag

_SLOPE = "alpha"  # of the restitution, positive if it falls with speed


def hints(fits: Mapping[str, Fitted]) -> list[str]:
    """A sentence on air drag, if the restitution of a ball without drag falls with speed: both
    lower fast bounces most.
    """
    best = ranked(fits)[0].estimate
    ball = best.system.model.oscillator
    if not may_have_drag(ball) or getattr(ball, DRAG) is not None or ball.is_forced():
        return []
    if _SLOPE not in best.names or not float(best[_SLOPE].low) > 0:
        return []
    return [
        "A restitution that falls with speed may be air drag, of which nothing is stated: `--free "
        "drag`, or `drag = true` under [system], fits it as well."
    ]
