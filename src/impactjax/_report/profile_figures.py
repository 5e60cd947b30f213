"""Figures of profile likelihoods of one and of two parameters."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from impactjax._identify.profile_curve import Profile
from impactjax._identify.ridge import Ridge
from impactjax._refusal import check_kind
from impactjax._report.style import FAINT, FITTED, OTHER, RECORDED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HIGHEST = 3.0  # rise up to which a profile is drawn, relative to its threshold
_DECADE = 10.0  # ratio of the ends from which an axis is logarithmic
_ROOM = 0.15  # share of an axis that is left around a region
_TICKS = 4  # most intervals between numbers of a linear axis, which may be long
_COARSE = 0.683  # confidence of the inner region

Theory = Callable[[Float[np.ndarray, " points"]], Float[np.ndarray, " points"]]


def plot_profile(ax: "Axes", found: Profile) -> "Axes":
    """A profile: the rise of the sum of squares with the held quantity. The dashed line is the
    threshold of the 95 % interval, which is shaded; the dot is the estimate, crosses below the
    curve mark values at which the fit failed.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: one of the results of `profiles`, or the result of `predicted`.
    """
    check_kind("found", found, Profile, 'profiles(estimate)["k"]')
    failed = np.isnan(found.rise)
    ends = [found.at[0], found.at[-1]]
    low, high = (float(np.clip(end, *ends)) for end in (found.low, found.high))
    if np.isfinite([low, high]).all():
        ax.axvspan(low, high, color=FAINT, linewidth=0)
    ax.axhline(found.threshold, color="black", linewidth=0.6, linestyle="--")
    ax.plot(found.at, found.rise, ".-", color=FITTED, linewidth=1, markersize=3)
    ax.plot(found.at[failed], np.zeros(failed.sum()), "x", color=RECORDED)
    ax.plot(found.value, 0, "o", color=OTHER, markersize=4)
    shown = np.nanmax(np.minimum(found.rise, _HIGHEST * found.threshold))
    ax.set(xlabel=_label(found.name, found.unit), ylabel="rise of S/σ²", title=str(found.shape))
    ax.set_ylim(-0.03 * shown, 1.05 * max(shown, 1.05 * found.threshold))
    if _is_wide(found.at[~failed]):
        ax.set_xscale("log")
    else:
        ax.locator_params(axis="x", nbins=_TICKS)
    return ax


def plot_ridge(ax: "Axes", found: Ridge, theory: Theory | None = None) -> "Axes":
    """The regions of two parameters at 68 and 95 %, with the estimate as a dot and the valley of
    the sum of squares as a dashed line.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `ridge`.
    - `theory`: the second parameter as a function of the first one by a theory, which is drawn over
      the regions: `lambda k: 0.1 * k`.
    """
    check_kind("found", found, Ridge, "ridge(estimate, 'k', 'c')")
    first = np.broadcast_to(found.first[:, None], found.second.shape)
    levels = [found.threshold(_COARSE), found.threshold()]
    rise = np.where(np.isnan(found.rise), 10 * levels[1], found.rise)
    lowest = min(float(rise.min()), 0.0) - 1.0
    colors = [RECORDED, FAINT]
    ax.contourf(first, found.second, rise, levels=[lowest, *levels], colors=colors)
    ax.contour(first, found.second, rise, levels=levels, colors=OTHER, linewidths=0.8)
    inside = found.inside().any(axis=1)
    shown = found.first[inside]
    ax.plot(shown, found.valley[inside], color=OTHER, linewidth=0.8, linestyle="--", label="valley")
    if theory is not None:
        low, high = (shown[0], shown[-1]) if len(shown) else (found.first[0], found.first[-1])
        spaced = np.geomspace if _is_wide(found.first) else np.linspace
        along = spaced(low, high, 200)
        ax.plot(along, theory(along), color=FITTED, linewidth=1.2, label="theory")
        ax.legend(frameon=False, fontsize="small")
    ax.plot(*found.best, "o", color=OTHER, markersize=4)
    labels = [_label(*pair) for pair in zip(found.names, found.units, strict=True)]
    ax.set(xlabel=labels[0], ylabel=labels[1])
    _show(ax, first[found.inside()], found.second[found.inside()])
    return ax


def _show(
    ax: "Axes", first: Float[np.ndarray, " inside"], second: Float[np.ndarray, " inside"]
) -> None:
    """Limits and scales that show some points with room around them."""
    for values, axis, set_scale, set_limits in (
        (first, ax.xaxis, ax.set_xscale, ax.set_xlim),
        (second, ax.yaxis, ax.set_yscale, ax.set_ylim),
    ):
        wide = _is_wide(values)
        set_scale("log" if wide else "linear")
        if wide:
            axis.set_minor_formatter("")
        if len(values) and float(np.ptp(values)) > 0:
            low, high = float(values.min()), float(values.max())
            room = (high / low) ** _ROOM if wide else _ROOM * (high - low)
            set_limits((low / room, high * room) if wide else (low - room, high + room))


def _label(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"


def _is_wide(values: Float[np.ndarray, "..."]) -> bool:
    """True if values are positive and stretch over a large ratio."""
    if not values.size or float(values.min()) <= 0:
        return False
    return float(values.max() / values.min()) > _DECADE
