"""Samples that are added to a recording, so that recordings of one length share a program."""

import numpy as np

from impactjax._known import AnyArray, namespace
from impactjax._parameter import plain

_SPACING = 0.02  # spacing of the times of padding samples, relative to that of the others


def continued(ts: AnyArray, more: int) -> AnyArray:
    """Times, and as many more after them."""
    ts, xp = plain(ts), namespace(ts)
    beyond = xp.arange(1, more + 1, dtype=ts.dtype)
    return xp.concatenate([ts, ts[-1] + _SPACING * (ts[-1] - ts[-2]) * beyond])


def padded(samples: AnyArray, more: int, value: float | bool | None = None) -> AnyArray:
    """Samples, and as many more after them: the last one again, or a `value`."""
    samples, xp = plain(samples), namespace(samples)
    last = samples[-1] if value is None else np.asarray(value, samples.dtype)
    return xp.concatenate([samples, xp.full(more, last, samples.dtype)])
