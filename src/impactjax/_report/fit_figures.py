"""The recording, its fit, and what the fit leaves; each figure takes an `Axes` and returns it."""

from typing import TYPE_CHECKING

import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._record.recording import ImpactTimes
from impactjax._report.style import FITTED, RECORDED
from impactjax._report.units import shown_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_fit(ax: "Axes", estimate: Estimate) -> "Axes":
    """The recording with the fitted motion; for a list of impact times, the flights."""
    recording = estimate.problem.recording
    unit, factor = shown_unit(recording)
    valid, residuals = np.asarray(recording.valid), np.asarray(estimate.residuals)
    if isinstance(recording, ImpactTimes):
        times = np.asarray(recording.times)
        whole = valid[1:] & valid[:-1]
        number = np.arange(1, len(times))[whole]
        flights = np.diff(times)[whole] * factor
        fitted = np.diff(times + residuals)[whole] * factor
        ax.plot(number, flights, "o", color=RECORDED, label="recorded")
        ax.plot(number, fitted, ".-", color=FITTED, label="fitted", linewidth=1)
        ax.set(xlabel="flight number", ylabel=f"duration of flight [{unit}]")
    else:
        ts = np.asarray(recording.ts)
        values = np.where(valid, np.asarray(recording.values), np.nan) * factor
        ax.plot(ts, values, color=RECORDED, linewidth=3, label="recorded")
        ax.plot(ts, values + residuals * factor, color=FITTED, linewidth=1, label="fitted")
        ax.set(xlabel="time [s]", ylabel=f"{recording.quantity.name} [{unit}]")
    ax.legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return ax


def plot_residuals(ax: "Axes", estimate: Estimate) -> "Axes":
    """What the fitted motion leaves, recorded minus fitted; dotted lines mark its impacts."""
    recording = estimate.problem.recording
    unit, factor = shown_unit(recording)
    left = np.where(np.asarray(recording.valid), -np.asarray(estimate.residuals), np.nan) * factor
    if isinstance(recording, ImpactTimes):
        ax.plot(np.arange(len(left)), left, ".-", color=FITTED, linewidth=1)
        ax.set(xlabel="impact number", ylabel=f"residual [{unit}]")
    else:
        for time in np.asarray(estimate.impacts.time)[np.asarray(estimate.impacts.happened)]:
            ax.axvline(time, color=RECORDED, linewidth=0.8, linestyle=":")
        ax.plot(np.asarray(recording.ts), left, ".", color=FITTED, markersize=2)
        ax.set(xlabel="time [s]", ylabel=f"residual [{unit}]")
    ax.axhline(0, color="black", linewidth=0.5)
    return ax
