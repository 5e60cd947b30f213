"""Figure of a recording before any fit: the record with its impacts marked."""

import errno
import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from impactjax._check.check import Check
from impactjax._record.recording import Recording
from impactjax._refusal import check_kind
from impactjax._report.picture import PLAIN, figure
from impactjax._report.style import FAINT, FITTED, OTHER, RECORDED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE = 9.0, 3.6  # inches
_DPI = 144


def plot_check(ax: "Axes", check: Check) -> "Axes":
    """The recording with its impacts, or with the extremes of a free swing. Parts that are not
    fitted are shaded or faint. Of impact times, the durations of the flights.
    """
    check_kind("check", check, Check, "check(file)")
    recording, look = check.survey.recording, check.survey.look
    if not isinstance(recording, Recording):
        return _flights(ax, check)
    unit, factor = recording.shown
    _left_out(ax, check, factor)
    ts, valid = np.asarray(recording.ts), np.asarray(recording.valid)
    values = np.asarray(recording.values) * factor
    ax.plot(ts, np.where(valid, values, np.nan), color=RECORDED, linewidth=1.2)
    if not valid.all():
        ax.plot(ts[~valid], values[~valid], "x", color=FITTED, markersize=4, label="left out")
    at = np.interp(look.marks, ts[valid], values[valid])
    what = "extremes" if look.swings_freely else "impacts"
    ax.plot(look.marks, at, "v", color=OTHER, markersize=6, label=f"{len(look.marks)} {what}")
    pulses = recording.quantity.contacts(values[valid])
    for begin, end in pulses:
        ends = ts[valid][[begin, min(end, np.count_nonzero(valid) - 1)]]
        ax.axvspan(*ends, color=OTHER, alpha=0.15, linewidth=0)
    ax.set(xlabel="time [s]", ylabel=f"{recording.observed} [{unit}]")
    ax.legend(frameon=False, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return ax


def _left_out(ax: "Axes", check: Check, factor: float) -> None:
    """The parts of the file that are not used, such as those with a hand."""
    file, used = check.survey.file, np.asarray(check.survey.recording.instants)
    if file is None or not isinstance(file.recording, Recording):
        return
    ts, values = np.asarray(file.recording.ts), np.asarray(file.recording.values) * factor
    for part in (ts < used[0], ts > used[-1]):
        if part.any():
            ax.axvspan(ts[part][0], ts[part][-1], color=FAINT, alpha=0.5, linewidth=0)
            ax.plot(ts[part], values[part], color=FAINT, linewidth=1.2)


def _flights(ax: "Axes", check: Check) -> "Axes":
    recording = check.survey.recording
    times, valid = np.asarray(recording.instants), np.asarray(recording.valid)
    unit, factor = recording.shown
    whole = valid[1:] & valid[:-1]
    number, flights = np.arange(1, len(times)), np.diff(times) * factor
    ax.plot(number[whole], flights[whole], "o-", color=OTHER, markersize=4, linewidth=1)
    if not whole.all():
        ax.plot(number[~whole], flights[~whole], "x", color=FITTED, label="not heard")
        ax.legend(frameon=False)
    ax.set(xlabel="flight number", ylabel=f"duration of flight [{unit}]")
    ax.set_ylim(0, None)
    return ax


def write_check(path: Path, check: Check, force: bool) -> None:
    """Writes the figure of a check as PNG.

    **Raises** `FileExistsError` for a file that exists, unless `force`.
    """
    if os.path.lexists(path) and not force:
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    drawn = figure(partial(plot_check, check=check), *_SIZE, PLAIN)
    with path.open("wb" if force else "xb") as file:
        drawn.savefig(file, format="png", dpi=_DPI)
