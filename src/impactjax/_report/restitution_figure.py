"""Figures of restitution against speed: impacts of the fitted motion, and curves of the laws."""

from collections.abc import Sequence
from itertools import cycle, islice
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._compare.comparison import Comparison, Fitted
from impactjax._first_look.first_look import FirstLook
from impactjax._fit.estimate import Estimate
from impactjax._fit.learned import Learned
from impactjax._identify.restitution_band import restitution_band
from impactjax._problem.problem import Problem
from impactjax._refusal import check_kind
from impactjax._report.restitution_curves import impacts, restitution_curve, speeds_of
from impactjax._report.style import LAWS, RECORDED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 200
_MARGIN = 0.03  # margin above and below the restitutions


def plot_restitution(ax: "Axes", fits: Sequence[Fitted], look: FirstLook | None = None) -> "Axes":
    """Restitution of each impact of the fitted motions against approach speed, with the curves of
    the laws and their 95 % bands. A law without a closed form is a line through its impacts.

    **Arguments:**

    - `ax`: axes to draw on.
    - `fits`: fits of a comparison.
    - `look`: first look at the recording, whose impacts, measured without any law, are drawn too.
    """
    if not isinstance(fits, Sequence | Comparison):
        raise TypeError("Argument `fits` must be the fits of a comparison, `compare(...).fits`.")
    for each in fits:
        check_kind("fits", each, Fitted, "compare(prepare(file)).fits[0]")
    if look is not None and look.speeds.size and not look.is_blow:
        style = {"marker": "s", "markersize": 6, "linestyle": "", "markerfacecolor": "none"}
        ax.plot(look.speeds, look.restitutions, color=RECORDED, label="measured", **style)
    speeds = speeds_of(fits)
    for fitted, color in zip(fits, cycle(LAWS), strict=False):
        _draw(ax, fitted.estimate, speeds, fitted.name, color)
    return _framed(ax, 2 if len(fits) > 3 else 1)


def plot_learned_restitution(
    ax: "Axes", learned: Learned, others: Sequence[Estimate[Problem]] = ()
) -> "Axes":
    """The learned restitution with its 95 % band, over the range of the speeds of the impacts,
    which are marked; and for comparison other laws fitted to the recording.

    **Arguments:**

    - `ax`: axes to draw on.
    - `learned`: result of `learn`.
    - `others`: results of `fit`.
    """
    check_kind("learned", learned, Learned, "learn(experiment)")
    at, ratios = impacts(learned.impacts)
    ax.plot(at, ratios, "o", color=LAWS[0], markersize=4, label="learned")
    speeds = jnp.asarray(np.linspace(at.min(), at.max(), _POINTS))
    middle, errors = (np.asarray(each) for each in restitution_band(learned, speeds))
    _band(ax, np.asarray(speeds), middle, 1.96 * errors, LAWS[0])
    for estimate, color in zip(others, islice(cycle(LAWS), 1, None), strict=False):
        stop = estimate.system.model.lower
        assert stop is not None
        _draw(ax, estimate, speeds, type(stop.law).__name__, color)
    return _framed(ax, 1)


def _draw(
    ax: "Axes", estimate: Estimate[Problem], speeds: Float[Array, " speeds"], label: str, color: str
) -> None:
    at, ratios = impacts(estimate.impacts)
    ax.plot(at, ratios, "o", color=color, markersize=4, label=label)
    curve = restitution_curve(estimate, speeds)
    if curve is None:
        order = np.argsort(at)
        ax.plot(at[order], ratios[order], ":", color=color, linewidth=1)
    else:
        at, middle, half = (np.asarray(each) for each in curve)
        _band(ax, at, middle, half, color)


def _band(ax: "Axes", speeds: np.ndarray, middle: np.ndarray, half: np.ndarray, color: str) -> None:
    ax.plot(speeds, middle, color=color, linewidth=1)
    ax.fill_between(speeds, middle - half, middle + half, color=color, alpha=0.15, linewidth=0)


def _framed(ax: "Axes", columns: int) -> "Axes":
    low, high = ax.get_ylim()
    limits = max(low - _MARGIN, 0), min(high + _MARGIN, 1.02)
    ax.set(xlabel="approach speed [m/s]", ylabel="restitution", ylim=limits, xlim=(0, None))
    ax.legend(frameon=False, fontsize="small", ncols=columns)
    return ax
