"""Figures of a recording, its fit and the residuals; each takes an `Axes` and returns it."""

from typing import TYPE_CHECKING

import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._problem.problem import Problem
from impactjax._refusal import check_kind
from impactjax._report.style import FITTED, RECORDED

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_fit(ax: "Axes", estimate: Estimate[Problem]) -> "Axes":
    """The recording with the fitted motion; for impact times, the durations of the flights."""
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
    curves = estimate.problem.recording.curves(np.asarray(estimate.residuals))
    recorded, fitted, width = ("-", "-", 3) if curves.dense else ("o", ".-", 1)
    ax.plot(curves.at, curves.recorded, recorded, color=RECORDED, linewidth=width, label="recorded")
    ax.plot(curves.at, curves.fitted, fitted, color=FITTED, linewidth=1, label="fitted")
    ax.set(xlabel=curves.across, ylabel=curves.along)
    ax.legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return ax


def plot_residuals(ax: "Axes", estimate: Estimate[Problem]) -> "Axes":
    """Residuals of the fit, recorded minus fitted; dotted lines mark the impacts of the motion."""
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
    recording = estimate.problem.recording
    unit, factor = recording.shown
    left = np.where(np.asarray(recording.valid), -np.asarray(estimate.residuals), np.nan) * factor
    at, label = recording.axis
    if not recording.observes_impacts:
        for time in np.asarray(estimate.impacts.time)[np.asarray(estimate.impacts.happened)]:
            ax.axvline(time, color=RECORDED, linewidth=0.8, linestyle=":")
        ax.plot(at, left, ".", color=FITTED, markersize=2)
    else:
        ax.plot(at, left, ".-", color=FITTED, linewidth=1)
    ax.set(xlabel=label, ylabel=f"residual [{unit}]")
    ax.axhline(0, color="black", linewidth=0.5)
    return ax
