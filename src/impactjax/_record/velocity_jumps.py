"""Jumps of a recorded velocity from one sample to the next, as at impacts on a rigid stop.

A fit whose impact passes a sample beside a jump changes a residual by the whole jump: its
likelihood has a false minimum wherever an impact is about to pass one. The coordinate has no jump.
Beside jumps, a fit therefore compares means of the velocity, over the intervals T from one sample
to the next,

    (x₂ − x₁) / T = (v₁ + v₂) / 2.

In the interval of a jump J, the right side has the standard deviation |J| / √12, since the impact
may be anywhere in it. If contacts or a low-pass make some jumps last longer, all instants may be
wrong alike, and it is larger. In the intervals before and after, the left side changes by J/10 if
the impact passes a sample by a tenth of an interval; that counts as one standard deviation.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._first_look.first_look import noise_size
from impactjax._known import AnyArray, namespace
from impactjax._parameter import as_parameter
from impactjax._record.padded import padded
from impactjax._shown import with_numbers
from impactjax._types import Samples

_BESIDE = 3  # intervals on each side of that of a jump
_GAP = 1.5  # of the usual interval: the length of a gap
_JUMP = 15.0  # least jump, in standard deviations of the noise
_STEEP = 5.0  # least jump, in the usual changes from sample to sample
_SMEARED = 6.0  # change beside a jump that shows that it lasts, in standard deviations of the noise
_SHARE = 0.05  # the same, relative to the jump
_MOST = 0.5  # largest share of jumps that last longer than an interval
_COMMON = 0.6  # error of all instants alike [intervals], relative to the share of jumps that last
_PASSED = 0.1  # part of an interval by which an impact may pass a sample
_ROUNDING = 1e-6  # noise that is none, relative to the span of the record


class MarkedJumps(eqx.Module):
    """Means of a recorded velocity, which a fit compares beside its jumps.

    - `weights`: weight of the mean velocity after each sample, relative to that of a sample; 0
      where samples are compared.
    - `means`: recorded mean velocities.
    """

    weights: Samples = eqx.field(converter=as_parameter)
    means: Samples = eqx.field(converter=as_parameter)

    def rows(self, shown: Float[Array, " intervals"], rows: Samples) -> Samples:
        """The residuals, with those of means beside jumps.

        **Arguments:**

        - `shown`: means of the simulated velocity between successive samples.
        - `rows`: residuals of the samples.
        """
        weighted = self.weights * (jnp.append(shown, 0.0) - self.means)
        return jnp.where(self.weights > 0, weighted, rows)

    def unweighted(self, rows: AnyArray) -> AnyArray:
        """Residuals in the recorded unit."""
        xp = namespace(rows, self.weights)
        marked = self.weights > 0
        return xp.where(marked, rows / xp.where(marked, self.weights, 1.0), rows)

    def shifted(self, rows: Float[AnyArray, " samples"]) -> "MarkedJumps":
        """The means that are smaller by some rows, so that the residuals grow by them."""
        return MarkedJumps(self.weights, self.means - self.unweighted(rows))

    def padded(self, more: int) -> "MarkedJumps":
        """The means, followed by as many more samples, which are compared."""
        return MarkedJumps(padded(self.weights, more, 0.0), padded(self.means, more))

    def turned(self) -> "MarkedJumps":
        """The jumps of a record of the opposite sign."""
        return MarkedJumps(self.weights, -self.means)

    def at(self, kept: AnyArray) -> "MarkedJumps":
        """The jumps at some samples."""
        return MarkedJumps(self.weights[kept], self.means[kept])

    __repr__ = with_numbers


def marked_jumps(ts: np.ndarray, values: np.ndarray, valid: np.ndarray) -> MarkedJumps | None:
    """The jumps of a recorded velocity; `None` if it has none, or if most last longer than an
    interval, by a contact or by a low-pass. A longer interval than others counts as a gap.
    """
    intervals = np.diff(ts)
    short = intervals < _GAP * np.median(intervals)
    changes = np.where(valid[1:] & valid[:-1] & short, np.diff(values), np.nan)
    if np.count_nonzero(np.isfinite(changes)) < 4 * _BESIDE:
        return None
    weights = _all_weights(values[valid], changes)
    if weights is None:
        return None
    means = np.append((values[1:] + values[:-1]) / 2, 0.0)
    return MarkedJumps(weights, np.where(weights > 0, means, 0.0))


class _Jump(NamedTuple):
    """A jump of a velocity.

    - `sizes`: changes of the velocity in its interval and those beside it, less its slopes; NaN
      where a sample is missing.
    - `lasts`: true if it lasts longer than its interval.
    """

    sizes: np.ndarray
    lasts: bool


def _all_weights(values: np.ndarray, changes: np.ndarray) -> np.ndarray | None:
    """Weights of all means, from the values that count and all changes, NaN across a gap."""
    noise = max(noise_size(values), _ROUNDING * float(np.ptp(values)))
    changes = np.pad(changes, _BESIDE, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(changes, 2 * _BESIDE + 1)
    usual = float(np.nanmedian(np.abs(changes)))
    large = np.flatnonzero(np.abs(windows[:, _BESIDE]) > max(_JUMP * noise, _STEEP * usual))
    jumps = {int(at): _jump(windows[at], noise) for at in large}
    found = {at: jump for at, jump in jumps.items() if jump is not None}
    share = float(np.mean([jump.lasts for jump in found.values()])) if found else 1.0
    if share > _MOST:
        return None
    error = np.sqrt(1 / 12 + len(found) * (_COMMON * share) ** 2)
    weights = np.zeros(len(changes) + 1)
    for at, jump in found.items():
        own, near = _weights(jump.sizes, noise, error), slice(at, at + 2 * _BESIDE + 1)
        weights[near] = np.where(weights[near] > 0, np.minimum(weights[near], own), own)
    return weights[_BESIDE:-_BESIDE]


def _jump(changes: np.ndarray, noise: float) -> _Jump | None:
    """The jump in the middle of the changes from sample to sample, if there is one."""
    before, after = changes[:_BESIDE], changes[_BESIDE + 1 :]
    if np.all(np.isnan(before)) or np.all(np.isnan(after)):
        return None
    slopes = np.nanmedian(before), np.nanmedian(after)
    sizes = changes - np.repeat([slopes[0], np.mean(slopes), slopes[1]], [_BESIDE, 1, _BESIDE])
    size, sign = abs(sizes[_BESIDE]), np.sign(changes[_BESIDE])
    beside = np.nan_to_num(sign * sizes[_BESIDE - 1 : _BESIDE + 2 : 2])
    back = np.min(beside) < -size / 2  # a wrong sample
    if back or abs(changes[_BESIDE]) < np.nanmax(np.abs(changes)):
        return None
    smeared = np.max(beside) > max(_SMEARED * noise, _SHARE * size)
    return _Jump(sizes, bool(smeared or size < _STEEP * np.max(np.abs(slopes))))


def _weights(sizes: np.ndarray, noise: float, error: float) -> np.ndarray:
    """Weights of the means in the interval of a jump and those beside it; 0 where one is missing.

    **Arguments:**

    - `sizes`: those of the jump.
    - `noise`: standard deviation of a sample.
    - `error`: that of the instant of a jump, in intervals.
    """
    wrong = np.maximum(error * np.abs(sizes), noise)
    for place in (_BESIDE - 1, _BESIDE + 1):
        wrong[place] = np.maximum(wrong[place], _PASSED * np.abs(sizes[_BESIDE]))
    return np.where(np.isnan(wrong), 0.0, noise / wrong)
