"""Figures of the first look and of the ends of the searches."""

from typing import TYPE_CHECKING

import numpy as np

from impactjax._first_look.first_look import FirstLook
from impactjax._fit.estimate import Estimate
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._refusal import check_kind
from impactjax._report.style import FITTED, OTHER, RECORDED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAME = 1.001  # ratio of sums of squares that count as the same minimum


def plot_starts(ax: "Axes", estimate: Estimate[Problem]) -> "Axes":
    """Rms of the residuals at the end of the search from each start, in order. A long flat step
    means that most starts lead to the best minimum. Starts whose simulation failed are left out.
    """
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
    unit, factor = estimate.problem.recording.shown
    n = int(estimate.problem.recording.observations)
    costs = np.asarray(estimate.start_costs)
    costs = np.sort(costs[np.isfinite(costs)])
    rms = np.sqrt(2 * costs / n) * factor
    reached = int(np.sum(costs <= _SAME * costs[0])) if costs.size else 0
    number = np.arange(1, len(rms) + 1)
    ax.plot(number, rms, "o-", color=RECORDED, linewidth=1)
    ax.plot(number[:reached], rms[:reached], "o", color=FITTED)
    top = 1.2 * rms.max() if rms.size else 1.0
    ax.set(xlabel="start, in order", ylabel=f"rms residual [{unit}]", ylim=(0, top))
    ax.set_title(
        f"{reached} of {estimate.start_costs.shape[0]} starts reach the best", fontsize="medium"
    )
    return ax


def plot_first_look(ax: "Axes", recording: AbstractRecording, look: FirstLook) -> "Axes":
    """The recording with the result of the first look: its impacts, or the extremes of a free
    swing.
    """
    check_kind("recording", recording, AbstractRecording, "Recording(ts, values, Angle())")
    check_kind("look", look, FirstLook, "prepare(file).first_look")
    if recording.observes_impacts:
        ax.vlines(np.asarray(recording.instants), 0, 1, color=OTHER)
        ax.set(xlabel="time [s]", yticks=[], ylabel="impacts heard")
        return ax
    nothing = np.zeros(recording.valid.shape)
    curves = recording.curves(nothing)
    seen = np.isfinite(curves.recorded)
    found = np.interp(look.marks, curves.at[seen], curves.recorded[seen])
    ax.plot(curves.at, curves.recorded, color=RECORDED, linewidth=1)
    ax.plot(look.marks, found, "v", color=OTHER, markersize=6)
    what = "extremes" if look.swings_freely else "impacts"
    ax.set(xlabel=curves.across, ylabel=curves.along)
    ax.set_title(f"{len(look.marks)} {what} found", fontsize="medium")
    return ax
