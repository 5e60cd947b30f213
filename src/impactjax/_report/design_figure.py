"""Figure of the precision that a design is expected to reach."""

from typing import TYPE_CHECKING

import numpy as np

from impactjax._design.plan import Design
from impactjax._refusal import check_kind
from impactjax._report.style import LAWS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_OPEN = 10.0  # relative half-widths from here on are drawn as open


def plot_design(ax: "Axes", found: Design) -> "Axes":
    """Expected half-widths of 95 % intervals, those that refits attained, and those asked for; an
    arrow stands for a parameter that the plan does not determine.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `design`.
    """
    check_kind("found", found, Design, "design(candidates, model, criterion)")
    names = list(found.expected)
    expected = np.array([each.half_width for each in found.expected.values()])
    attained = np.array([each.attained for each in found.expected.values()])
    rows, told = np.arange(len(names)), expected < _OPEN
    ax.plot(expected[told], rows[told], "o", color=LAWS[0], markersize=7, label="expected")
    arrows = np.full(int(np.sum(~told)), _OPEN)
    ax.plot(arrows, rows[~told], ">", color=LAWS[0], markersize=8, markerfacecolor="none")
    refits = told & np.isfinite(attained)
    if refits.any():
        style = {"color": LAWS[1], "markersize": 9, "markeredgewidth": 1.5}
        ax.plot(attained[refits], rows[refits], "x", label=f"{found.refits} refits", **style)
    asked = found.criterion.asked_widths()
    if asked:
        at = [names.index(name) for name in asked]
        style = {"color": "black", "markersize": 18, "markeredgewidth": 1.5}
        ax.plot([*asked.values()], at, "|", label="asked", **style)
    ax.set_yticks(rows, names)
    ax.set(xscale="log", xlabel="relative half-width of the 95 % interval")
    ax.set_ylim(len(rows) - 0.5, -0.5)
    above = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 3}
    ax.legend(frameon=False, fontsize="small", **above)
    return ax
