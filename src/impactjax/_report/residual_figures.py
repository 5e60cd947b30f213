"""Figures that compare residuals with independent normal noise."""

from typing import TYPE_CHECKING

import numpy as np
from scipy import special

from impactjax._fit.estimate import Estimate
from impactjax._identify.residual_diagnostics import residual_diagnostics
from impactjax._problem.problem import Problem
from impactjax._refusal import check_kind
from impactjax._report.style import FAINT, FITTED, OTHER, RECORDED

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_autocorrelation(ax: "Axes", estimate: Estimate[Problem]) -> "Axes":
    """Autocorrelation of the residuals, with the 95 % band of independent residuals."""
    found = residual_diagnostics(estimate)
    rho, band = np.asarray(found.autocorrelation), float(found.band)
    lags = np.arange(1, len(rho) + 1)
    ax.axhspan(-band, band, color=FAINT, linewidth=0)
    ax.vlines(lags, 0, rho, color=FITTED, linewidth=2)
    ax.axhline(0, color="black", linewidth=0.5)
    ax.set(xlabel="lag [samples]", ylabel="autocorrelation", ylim=(min(-0.3, rho.min()), 1))
    return ax


def plot_quantiles(ax: "Axes", estimate: Estimate[Problem]) -> "Axes":
    """Quantiles of the residuals against those of a normal distribution, with the diagonal."""
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
    valid = np.asarray(estimate.problem.recording.valid)
    size = float(estimate.rms) or 1.0  # zero without a successful simulation
    left = np.sort(-np.asarray(estimate.residuals)[valid]) / size
    normal = special.ndtri((np.arange(len(left)) + 0.5) / len(left))
    ends = [normal[0], normal[-1]]
    ax.plot(ends, ends, color=RECORDED, linewidth=2)
    ax.plot(normal, left, ".", color=FITTED, markersize=3)
    ax.set(xlabel="normal quantile", ylabel="residual / rms")
    return ax


def plot_impact_residuals(ax: "Axes", estimate: Estimate[Problem]) -> "Axes":
    """Rms of the residuals just after each impact, divided by that of all. It is large for a law
    that does not describe the contact.
    """
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
    log = estimate.impacts
    after = np.asarray(residual_diagnostics(estimate).after_impacts)
    after = after[: int(log.count)] if len(after) == len(log.time) else after
    ax.axhline(1, color=RECORDED, linewidth=2)
    ax.bar(np.arange(1, len(after) + 1), after, color=OTHER, width=0.6)
    ax.set(xlabel="impact number", ylabel="rms just after it / rms of all")
    return ax
