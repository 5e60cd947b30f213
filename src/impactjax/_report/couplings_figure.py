"""Figure of what different measurements tell of a contact law."""

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from impactjax._identify.couplings import Couplings
from impactjax._identify.directions import DETERMINED
from impactjax._report.style import LAWS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_OPEN = 10.0  # relative bounds from here on are drawn as open


def plot_couplings(ax: "Axes", found: Couplings) -> "Axes":
    """Relative bounds of a law's parameters by measurement; an arrow stands for a parameter that
    the measurement does not determine. Beyond the dashed line a 95 % interval reaches zero.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `couplings`.
    """
    bounds = np.array([*found.bounds.values()])
    rows, count = np.arange(len(bounds)), len(found.names)
    for i, (name, color) in enumerate(zip(found.names, cycle(LAWS), strict=False)):
        at = rows + 0.15 * (i - (count - 1) / 2)
        told = bounds[:, i] < _OPEN
        shown = np.where(told, bounds[:, i], _OPEN)
        ax.plot(shown[told], at[told], "o", color=color, markersize=6, label=name)
        ax.plot(shown[~told], at[~told], ">", color=color, markersize=8, markerfacecolor="none")
    ax.axvline(DETERMINED, color="black", linewidth=0.6, linestyle="--")
    ax.set_yticks(rows, list(found.bounds))
    ax.set(xscale="log", xlabel="relative standard error", ylim=(len(rows) - 0.5, -0.5))
    ax.legend(frameon=False, fontsize="small", title=found.law)
    return ax
