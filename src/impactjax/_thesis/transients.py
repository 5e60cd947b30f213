"""Transients of chapter 3 beside the record that stands in for the measured one."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

import impactjax as ij
from impactjax._thesis.constants import RELEASE, SAMPLING
from impactjax._thesis.drawing import OTHER, RECORDED, SOFT, named, panels, zero
from impactjax._thesis.motions import Motion, runs, transient
from impactjax._thesis.record import DELAY, LOST, material, recorded

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw_record(ax: "Axes", true: Motion) -> None:
    """The stand-in for the measured transient, at the thesis's sampling and without the delay of
    its filter.
    """
    every = round(1 / SAMPLING / (true.ts[1] - true.ts[0]))
    shown = np.degrees(recorded(true))
    ax.plot(true.ts[::every] - DELAY, shown[::every], ".", color=RECORDED, markersize=3, label=LOST)


def two_readings(
    law: str, readings: Mapping[str, ij.PowerLaw], shown: float, columns: int
) -> tuple["Figure", list[Motion]]:
    """A figure of the record and of a law whose constants are read in two ways, and the motions.

    **Arguments:**

    - `law`, `readings`: name of the law, and the law by the name of the reading.
    - `shown`: time up to which the figure shows the motions [s].
    - `columns`: number of columns of the legend.
    """
    (true,) = runs([transient(material(), RELEASE, 1.5)])
    motions = runs([transient(each, RELEASE, 1.5) for each in readings.values()])
    drawn, (ax,) = panels(1, 1, 3.6)
    draw_record(ax, true)
    for name, motion, colour in zip(readings, motions, (OTHER, SOFT), strict=True):
        label = f"{law}, {name}"
        ax.plot(motion.ts, np.degrees(motion.position), color=colour, linewidth=1, label=label)
    ax.set(xlabel="time t [s]", ylabel="angle θ [deg]", xlim=(0, shown), ylim=(-3, 48))
    zero(ax)
    named(ax, ncols=columns, loc="upper right")
    return drawn, motions
