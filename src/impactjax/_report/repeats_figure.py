"""Figure of a parameter over repeats."""

from typing import TYPE_CHECKING

import numpy as np

from impactjax._compare.repeatability import RepeatedParameter
from impactjax._fit.quantiles import NORMAL
from impactjax._refusal import check_kind
from impactjax._report.style import FITTED, RECORDED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_NUMBERED = 12  # repeats whose numbers all stand at the axis


def plot_repeats(ax: "Axes", parameter: RepeatedParameter) -> "Axes":
    """Results of each recording with 95 % errors, their mean with its 95 % interval as a band, and
    dashed lines between which 95 % of single repeats lie.

    **Arguments:**

    - `ax`: axes to draw on.
    - `parameter`: one of a model of `repeatability`.
    """
    example = "repeatability(comparisons)['restitution']['r']"
    check_kind("parameter", parameter, RepeatedParameter, example)
    over, count = parameter.over, len(parameter.values)
    at = np.arange(1, count + 1)
    reach = NORMAL * parameter.errors
    ax.axhspan(parameter.low, parameter.high, color=FITTED, alpha=0.15, linewidth=0)
    ax.axhline(over.mean, color=FITTED, linewidth=1)
    for end in (over.single_low, over.single_high):
        ax.axhline(end, color=FITTED, linewidth=0.8, linestyle="--")
    ax.errorbar(at, parameter.values, reach, fmt="o", color=RECORDED, markersize=5, capsize=3)
    unit = "" if parameter.unit == "1" else f" [{parameter.unit}]"
    ax.set(xlabel="recording", ylabel=f"{parameter.name}{unit}", xlim=(0.5, count + 0.5))
    if count <= _MOST_NUMBERED:
        ax.set_xticks(at)
    return ax
