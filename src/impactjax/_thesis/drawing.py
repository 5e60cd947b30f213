"""Drawing of the figures: size, colours and what all of them share."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from impactjax._thesis.claim import Claim

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import LegendLocType

RECORDED, RIGID, SOFT, OTHER, FAINT = "#8fa3b5", "#1f4e79", "#b3261e", "#2e7d32", "#d9e0e7"
_WIDTH = 9.0  # inches


class Made(NamedTuple):
    """A figure that was made, and the claims that stand beside it."""

    picture: "Figure"
    claims: tuple[Claim, ...]


def panels(rows: int, columns: int, height: float) -> tuple["Figure", list["Axes"]]:
    """A figure of a given height in inches with panels, row by row."""
    from matplotlib.figure import Figure  # imported only when needed

    drawn = Figure(figsize=(_WIDTH, height), layout="constrained")
    axes = [*np.ravel(drawn.subplots(rows, columns))]
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
    if len(axes) > 1:
        for ax, letter in zip(axes, "abcdefgh", strict=False):
            ax.set_title(f"({letter})", loc="left", fontsize="medium")
    return drawn, axes


def zero(ax: "Axes") -> None:
    """A line where the stop is."""
    ax.axhline(0, color="black", linewidth=0.5)


def shared(drawn: "Figure", axes: Sequence["Axes"]) -> None:
    """A legend of some panels above all of them."""
    entries: dict[str, Artist] = {}
    for ax in axes:
        handles, labels = ax.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    drawn.legend(
        [*entries.values()],
        [*entries],
        loc="outside upper center",
        ncols=len(entries),
        frameon=False,
        fontsize="small",
    )


def named(ax: "Axes", loc: "LegendLocType" = "best", ncols: int = 1) -> None:
    """A legend without a frame."""
    ax.legend(frameon=False, fontsize="small", loc=loc, ncols=ncols)
