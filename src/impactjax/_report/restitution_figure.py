"""Figures of restitution against speed: impacts of the fitted motion, and curves of the laws."""

from collections.abc import Sequence
from itertools import cycle, islice
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from impactjax._compare.compare import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._fit.learned import Learned
from impactjax._identify.identifiability import identifiability
from impactjax._identify.information import Information
from impactjax._identify.restitution_band import restitution_band
from impactjax._model.equivalents import Equivalents
from impactjax._model.law import AbstractImpactLaw
from impactjax._problem.parameters import replaced
from impactjax._report.style import LAWS
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 200
_MARGIN = 0.03  # margin above and below the restitutions

Curve = Float[Array | np.ndarray, " speeds"]


@runtime_checkable
class _ClosedForm(Protocol):
    """A force law whose impacts have a closed form."""

    def equivalents(self, speed: ArrayLike, mass: ArrayLike) -> Equivalents: ...


def plot_restitution(ax: "Axes", fits: Sequence[Fitted]) -> "Axes":
    """Restitution of each impact of the fitted motions against approach speed, with the curves of
    the laws and their 95 % bands. A law without a closed form is a line through its impacts.
    """
    fastest = max(float(np.max(_impacts(each.estimate.impacts)[0], initial=0)) for each in fits)
    speeds = jnp.asarray(np.linspace(1e-3, 1.05, _POINTS) * fastest)
    for fitted, color in zip(fits, cycle(LAWS), strict=False):
        _draw(ax, fitted.estimate, speeds, fitted.name, color)
    return _framed(ax, 2 if len(fits) > 3 else 1)


def plot_learned_restitution(
    ax: "Axes", learned: Learned, others: Sequence[Estimate] = ()
) -> "Axes":
    """The learned restitution with its 95 % band, over the range of the speeds of the impacts,
    which are marked; and for comparison other laws fitted to the recording.

    **Arguments:**

    - `ax`: axes to draw on.
    - `learned`: result of `learn`.
    - `others`: results of `fit`.
    """
    at, ratios = _impacts(learned.impacts)
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
    ax: "Axes", estimate: Estimate, speeds: Float[Array, " speeds"], label: str, color: str
) -> None:
    at, ratios = _impacts(estimate.impacts)
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


def restitution_curve(
    estimate: Estimate, speeds: Float[Array, " speeds"]
) -> tuple[Curve, Curve, Curve] | None:
    """Speeds, the fitted law's restitution there, and half the width of its 95 % band; `None` for a
    law whose restitution has no closed form.
    """
    stop = estimate.system.model.lower
    if stop is None or not isinstance(stop.law, AbstractImpactLaw | _ClosedForm):
        return None
    told = identifiability(estimate)
    middle, slopes = _sloped(
        estimate.problem.system, estimate.names, jnp.asarray(estimate.values), speeds
    )
    return speeds, middle, 1.96 * _errors(told, np.asarray(slopes))


def _errors(told: Information, slopes: Float[np.ndarray, "speeds parameters"]) -> np.ndarray:
    """Standard errors of a function of the contact's parameters, from its derivatives."""
    own = np.array(told.of_model)
    return np.asarray(told.directions.error((slopes * told.scale)[:, own]))


@eqx.filter_jit
def _sloped(
    system: System, names: tuple[str, ...], values: Array, speeds: Float[Array, " speeds"]
) -> tuple[Curve, Float[Array, "speeds parameters"]]:
    """Restitution at speeds, and its derivatives by the fitted parameters."""

    def restitution(values: Array) -> tuple[Curve, Curve]:
        model = replaced(system, names, list(values)).model
        assert model.lower is not None
        law = model.lower.law
        if isinstance(law, AbstractImpactLaw):
            found = law.restitution(speeds) * jnp.ones_like(speeds)
        else:
            assert isinstance(law, _ClosedForm)
            found = law.equivalents(speeds, model.oscillator.mass).restitution
        return found, found

    slopes, middle = jax.jacfwd(restitution, has_aux=True)(values)
    return middle, slopes


def _impacts(log: ImpactLog) -> tuple[np.ndarray, np.ndarray]:
    """Approach speeds and restitutions of the complete impacts."""
    shown = np.flatnonzero(np.asarray(log.complete)[: int(log.count)])
    return np.asarray(log.approach_speed)[shown], np.asarray(log.restitution)[shown]
