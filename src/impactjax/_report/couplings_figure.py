"""Figure of what different measurements tell of a contact law."""

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from impactjax._identify.couplings import OPEN, Couplings
from impactjax._identify.directions import DETERMINED
from impactjax._identify.words import findings
from impactjax._refusal import check_kind
from impactjax._report.style import FAINT, LAWS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STEP = 0.18  # between the parameters of a row, in rows


def plot_couplings(ax: "Axes", found: Couplings) -> "Axes":
    """Relative bounds of a law's parameters by measurement; an arrow at the edge stands for a
    parameter that the measurement does not determine, and a diamond for a combination that it
    determines better than its parameters. Beyond the dashed line a 95 % interval reaches zero.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `couplings`.
    """
    check_kind("found", found, Couplings, "couplings(model, initial, ts)")
    from matplotlib.ticker import FuncFormatter

    bounds = np.array([*found.bounds.values()])
    rows, count = np.arange(len(bounds)), len(found.names)
    across = ax.get_yaxis_transform()
    ax.hlines(rows, 0, 1, transform=across, color=FAINT, linewidth=0.6, zorder=0)
    ax.axvline(DETERMINED, color="black", linewidth=0.6, linestyle="--")
    for i, (name, color) in enumerate(zip(found.names, cycle(LAWS), strict=False)):
        at, told = rows + _STEP * (i - (count - 1) / 2), bounds[:, i] < OPEN
        ax.plot(np.where(told, bounds[:, i], np.nan), at, "o", color=color, ms=6, label=name)
        edge = np.where(told, np.nan, 1.0)
        ax.plot(edge, at, ">", color=color, ms=7, mfc="white", clip_on=False, transform=across)
    _combinations(ax, found)
    ax.set_yticks(rows, list(found.bounds))
    ax.set(xscale="log", xlabel="relative standard error", ylim=(len(rows) - 0.5, -0.5))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{100 * x:g} %"))
    beside = {"loc": "upper left", "bbox_to_anchor": (1.02, 1.0), "borderaxespad": 0.0}
    ax.legend(frameon=False, handletextpad=0.2, **beside)
    ax.set_title(found.law, loc="left", fontsize="medium")
    return ax


def _combinations(ax: "Axes", found: Couplings) -> None:
    """Marks what is determined of several parameters together."""
    for row, told in enumerate(found.measurements.values()):
        for each in findings(told):
            if each.determined and each.combination not in told.names:
                ax.plot(each.relative_error, row, "D", color="black", ms=4)
                ax.annotate(
                    *(each.combination, (each.relative_error, row)),
                    xytext=(-6, 0),
                    textcoords="offset points",
                    ha="right",
                    va="center",
                    fontsize="small",
                )
