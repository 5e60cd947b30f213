"""Figures as pictures inside a page."""

import base64
import io
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DPI = 144
_NARROW, _WIDE = 4.2, 9.0  # inches


class Picture(NamedTuple):
    """A figure as PNG, once more for narrow screens if it is a wide one, and in words."""

    png: str  # base64
    narrow_png: str | None
    text: str  # for those who cannot see it
    width: int
    height: int


def picture(draw: Callable[["Axes"], "Axes"], text: str, height: float = 3.2) -> Picture:
    """A figure of the width of a phone or of half a page."""
    return Picture(_png(draw, _NARROW, height), None, text, *_pixels(_NARROW, height))


def wide_picture(draw: Callable[["Axes"], "Axes"], text: str, height: float) -> Picture:
    """A figure of the width of a page, with another one for narrow screens."""
    narrow = _png(draw, _NARROW, height)
    return Picture(_png(draw, _WIDE, height), narrow, text, *_pixels(_WIDE, height))


def _pixels(width: float, height: float) -> tuple[int, int]:
    return round(width * _DPI), round(height * _DPI)


def _png(draw: Callable[["Axes"], "Axes"], width: float, height: float) -> str:
    from matplotlib.figure import Figure  # most users of the package never draw

    figure = Figure(figsize=(width, height), layout="constrained")
    ax = figure.add_subplot()
    ax.spines[["top", "right"]].set_visible(False)
    draw(ax)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI)
    return base64.b64encode(buffer.getvalue()).decode("ascii")
