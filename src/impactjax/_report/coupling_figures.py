"""Figures of the coupling of parameters: correlations, directions and sensitivities."""

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from impactjax._identify.information import Information
from impactjax._identify.words import findings
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._refusal import check_kind
from impactjax._report.style import FITTED, LAWS, OTHER

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_OPEN = 1e3  # largest relative error drawn


def plot_correlation(ax: "Axes", information: Information) -> "Axes":
    """Correlation matrix of the parameters' errors, as a colour map with numbers."""
    check_kind("information", information, Information, "identifiability(estimate)")
    matrix = np.asarray(information.correlation)
    count = range(len(information.names))
    ax.imshow(matrix, cmap="RdBu_r", vmin=-1, vmax=1)
    for i in count:
        for j in count:
            dark = abs(matrix[i, j]) > 0.6
            text = f"{matrix[i, j]:.2f}".replace("-0.00", "0.00")
            color = "white" if dark else "black"
            ax.text(j, i, text, ha="center", va="center", fontsize="x-small", color=color)
    ax.set_xticks(count, information.names, rotation=40, ha="right")
    ax.set_yticks(count, information.names)
    ax.spines[:].set_visible(False)
    ax.tick_params(length=0)
    return ax


def plot_directions(ax: "Axes", information: Information) -> "Axes":
    """Relative standard errors of the stiff and sloppy directions as bars, the best determined
    first; red for directions that the data do not determine.
    """
    found = findings(information)
    errors = np.array([each.relative_error for each in found])
    shown = np.minimum(np.maximum(errors, 1e-6), _OPEN)
    rows = range(len(found))
    colors = [OTHER if each.determined else FITTED for each in found]
    left = shown.min() / 3
    ax.barh(rows, shown - left, left=left, color=colors, height=0.5)
    for row, each, error in zip(rows, found, shown, strict=True):
        words = each.combination if each.determined else f"{each.combination}: not determined"
        ax.text(left * 1.1, row - 0.3, words, fontsize="small", va="bottom")
        amount = each.amount.removeprefix("to ").strip("()") or "no end"
        ax.text(error * 1.15, row, amount, va="center", fontsize="small")
    ax.set(xscale="log", xlim=(left, shown.max() * 30), yticks=[], ylim=(len(found) - 0.5, -0.9))
    ax.set_xlabel("relative standard error")
    return ax


def plot_sensitivities(
    ax: "Axes", information: Information, recording: AbstractRecording
) -> "Axes":
    """Sensitivity of each observation to each parameter: change of the recorded quantity for an
    increase of the parameter by 1 %, in standard deviations of the noise.

    **Arguments:**

    - `ax`: axes to draw on.
    - `information`: result of `identifiability` or `information`.
    - `recording`: the one recording that it is about, measured or planned. Scatter from impact to
      impact mixes the samples.

    **Raises** `ValueError` for information in something else.
    """
    check_kind("information", information, Information, "identifiability(estimate)")
    check_kind("recording", recording, AbstractRecording, "Recording(ts, values, Angle())")
    at, label = recording.axis
    further = len(information.sensitivities) - len(at)
    if not 0 <= further <= len(information.names):  # the rows of prior knowledge come last
        raise ValueError("The information is not about this recording alone.")
    columns = 0.01 * np.asarray(information.sensitivities)[: len(at)].T
    for name, column, color in zip(information.names, columns, cycle(LAWS), strict=False):
        ax.plot(at, column, color=color, linewidth=1, label=name)
    ax.axhline(0, color="black", linewidth=0.5)
    ax.set_yscale("symlog", linthresh=0.1)
    ax.set(xlabel=label, ylabel="noise sizes per 1 %")
    ax.legend(
        frameon=False, fontsize="small", ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0)
    )
    return ax
