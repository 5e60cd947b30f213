"""Figures as pictures inside a page."""

import base64
import io
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DPI = 144
_NARROW, _WIDE = 4.2, 9.0  # inches


class Margins(NamedTuple):
    """Margins around the axes for labels [inches]. They are fixed, since measuring the labels takes
    longer than drawing them.
    """

    left: float = 0.92
    bottom: float = 0.5
    right: float = 0.15
    top: float = 0.35


PLAIN = Margins()


class Picture(NamedTuple):
    """A figure as PNG, a second one for narrow screens if it is wide, and its description."""

    png: str  # base64
    narrow_png: str | None
    text: str  # alternative text
    width: int
    height: int


def picture(
    draw: Callable[["Axes"], "Axes"], text: str, height: float = 3.2, margins: Margins = PLAIN
) -> Picture:
    """A figure of half the width of a page, which is that of a phone."""
    return Picture(_png(draw, _NARROW, height, margins), None, text, *_pixels(_NARROW, height))


def wide_picture(draw: Callable[["Axes"], "Axes"], text: str, height: float) -> Picture:
    """A figure of the width of a page, with a second one for narrow screens."""
    narrow = _png(draw, _NARROW, height, PLAIN)
    return Picture(_png(draw, _WIDE, height, PLAIN), narrow, text, *_pixels(_WIDE, height))


def _pixels(width: float, height: float) -> tuple[int, int]:
    return round(width * _DPI), round(height * _DPI)


def _png(draw: Callable[["Axes"], "Axes"], width: float, height: float, margins: Margins) -> str:
    buffer = io.BytesIO()
    figure(draw, width, height, margins).savefig(buffer, format="png", dpi=_DPI)
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def figure(
    draw: Callable[["Axes"], "Axes"], width: float, height: float, margins: Margins
) -> "Figure":
    """A figure of a given size with one axes."""
    from matplotlib.figure import Figure  # imported only when needed

    drawn = Figure(figsize=(width, height))
    left, bottom, right, top = margins
    inside = left, bottom, width - left - right, height - bottom - top
    ax = drawn.add_axes(tuple(np.array(inside) / [width, height, width, height]))
    ax.spines[["top", "right"]].set_visible(False)
    draw(ax)
    return drawn
