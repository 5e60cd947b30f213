"""Figures of forced response: branches, diagrams, exponents, basins of attraction, spectra."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike, Bool, Float

from impactjax._report.style import FITTED, OTHER
from impactjax._response.attractors import NONE
from impactjax._response.basins import Basins
from impactjax._response.branch import Branch
from impactjax._response.delay_embedding import Divergence
from impactjax._response.diagram import Diagram
from impactjax._response.exponents import Exponents

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MARGINAL = 1e-6  # a multiplier beyond the unit circle by less belongs to a special point
_MARKERS = {
    "fold": "s",
    "period doubling": "D",
    "Neimark-Sacker": "^",
    "grazing": "o",
    "onset of sticking": "P",
    "another itinerary": "v",
}


def plot_branch(ax: "Axes", found: Branch, values: Float[np.ndarray, " points"]) -> "Axes":
    """A branch of orbits: stable ones as a line, unstable ones dashed, special points as markers
    with their names in the legend.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `follow`.
    - `values`: a number of each orbit, such as its impact speed `found.before["v"][:, 0]`.
    """
    size = np.max(np.abs(found.multipliers), axis=1)
    stable = np.maximum(size[:-1], size[1:]) < 1 + _MARGINAL
    for own, style in ((stable, "-"), (~stable, "--")):
        pieces = [_pieces(column, own) for column in (found.parameter, values)]
        ax.plot(*pieces, style, color=OTHER, linewidth=1.2)
    named = set(ax.get_legend_handles_labels()[1])
    for each in found.special:
        if each.kind in _MARKERS:
            label = None if each.kind in named else each.kind
            named.add(each.kind)
            ax.plot(
                each.parameter,
                values[each.place],
                _MARKERS[each.kind],
                color=FITTED,
                markersize=5,
                label=label,
                linestyle="none",
            )
    if named:
        ax.legend(frameon=False, fontsize="small")
    return ax


def _pieces(column: Float[np.ndarray, " points"], own: Bool[np.ndarray, " pieces"]) -> np.ndarray:
    """The ends of some pieces of a line, with a gap after each."""
    return np.stack([column[:-1], column[1:], np.full(own.size, np.nan)], axis=1)[own].ravel()


def plot_diagram(ax: "Axes", found: Diagram, states: ArrayLike) -> "Axes":
    """A bifurcation diagram: all stroboscopic states over the parameter.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `diagram`.
    - `states`: one number of its states, such as `found.states["x"]`.
    """
    columns = np.asarray(states)
    values = np.broadcast_to(np.asarray(found.values)[:, None], columns.shape)
    ax.plot(values.ravel(), columns.ravel(), ",", color=OTHER)
    return ax


def plot_basins(ax: "Axes", found: Basins, across: ArrayLike, along: ArrayLike) -> "Axes":
    """Basins of attraction: the start of each motion in the colour of its attractor, black where it
    approaches none.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `basins`.
    - `across`, `along`: the numbers of its starts to draw, such as their angles and velocities.
    """
    points = 72 * ax.bbox.width / ax.figure.dpi
    size = points / np.sqrt(found.attractor.size)
    for name in (*range(len(found.attractors)), NONE):
        own = found.attractor == name
        if np.any(own):
            x, y = np.asarray(across)[own], np.asarray(along)[own]
            label = "none" if name == NONE else f"period {found.attractors[name].period}"
            colour = "black" if name == NONE else f"C{name % 10}"
            ax.plot(x, y, "s", color=colour, markersize=size, markeredgewidth=0, label=label)
    ax.legend(loc="upper left", bbox_to_anchor=(1, 1), markerscale=8 / size, frameon=False)
    return ax


def plot_exponents(ax: "Axes", found: Exponents, values: ArrayLike) -> "Axes":
    """Lyapunov exponents over the parameter, the largest in colour. Those of −∞ are left out.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `lyapunov_diagram`.
    - `values`: values of the parameter.
    """
    exponents = np.where(np.isfinite(found.values), found.values, np.nan)
    ax.axhline(0.0, color=OTHER, linewidth=0.6, linestyle=":")
    ax.plot(np.asarray(values), exponents[:, 1:], color=OTHER, linewidth=0.8)
    ax.plot(np.asarray(values), exponents[:, 0], color=FITTED, linewidth=1.0)
    return ax


def plot_divergence(ax: "Axes", found: Divergence) -> "Axes":
    """The mean divergence of neighbouring states, and the line whose slope is the exponent.

    **Arguments:**

    - `ax`: axes to draw on.
    - `found`: result of `divergence`.
    """
    ax.plot(found.after, found.logarithm, color=OTHER, linewidth=1.2)
    own = (found.after >= found.begin) & (found.after <= found.end)
    middle = np.mean(found.after[own]), np.mean(found.logarithm[own])
    line = middle[1] + found.exponent * (found.after[own] - middle[0])
    ax.plot(found.after[own], line, color=FITTED, linewidth=1.5)
    ax.set(xlabel="time [s]", ylabel="mean logarithm of distance")
    return ax


def plot_spectrum(
    ax: "Axes", values: ArrayLike, interval: float, frequency: float, multiple: int = 1
) -> "Axes":
    """The power density of a record with a Hann window, the harmonics of a frequency as lines, and
    the subharmonics as dotted ones.

    **Arguments:**

    - `ax`: axes to draw on.
    - `values`: samples at equal intervals.
    - `interval`: time between two samples [s].
    - `frequency`: that of the force [Hz].
    - `multiple`: periods of the force after which the motion repeats.
    """
    from scipy.signal import periodogram

    lines, density = periodogram(np.asarray(values, float), 1 / interval, "hann")
    for number in range(1, int(lines[-1] / frequency * multiple) + 1):
        style = "-" if number % multiple == 0 else ":"
        place = number * frequency / multiple
        ax.axvline(place, linestyle=style, color=FITTED, linewidth=0.6, alpha=0.5)
    ax.semilogy(lines[1:], density[1:], color=OTHER, linewidth=0.8)
    ax.set(xlabel="frequency [Hz]", ylabel="power density")
    return ax
