"""Restitution against speed: the impacts of the fitted motion, and the laws' own curves."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from impactjax._fit.compare import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._fit.system import System, replaced
from impactjax._identify.identifiability import identifiability
from impactjax._model.equivalents import Equivalents
from impactjax._model.law import AbstractImpactLaw
from impactjax._report.style import LAWS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 200
_MARGIN = 0.03  # of the restitutions shown

Curve = Float[Array, " speeds"]


@runtime_checkable
class _ClosedForm(Protocol):
    def equivalents(self, speed: ArrayLike, mass: ArrayLike) -> Equivalents: ...


def plot_restitution(ax: "Axes", fits: Sequence[Fitted]) -> "Axes":
    """Restitution of each impact of the fitted motions against approach speed, with the curves of
    the laws and their 95 % bands. A law without a closed form is a line through its impacts.
    """
    fastest = max(float(np.max(_impacts(each.estimate)[0], initial=0)) for each in fits)
    for fitted, color in zip(fits, LAWS, strict=False):
        speeds, ratios = _impacts(fitted.estimate)
        ax.plot(speeds, ratios, "o", color=color, markersize=4, label=fitted.law)
        curve = restitution_curve(fitted.estimate, jnp.linspace(1e-3, 1.05, _POINTS) * fastest)
        if curve is None:
            order = np.argsort(speeds)
            ax.plot(speeds[order], ratios[order], ":", color=color, linewidth=1)
            continue
        at, middle, half = (np.asarray(each) for each in curve)
        ax.plot(at, middle, color=color, linewidth=1)
        ax.fill_between(at, middle - half, middle + half, color=color, alpha=0.15, linewidth=0)
    low, high = ax.get_ylim()
    limits = max(low - _MARGIN, 0), min(high + _MARGIN, 1.02)
    ax.set(xlabel="approach speed [m/s]", ylabel="restitution", ylim=limits, xlim=(0, None))
    ax.legend(frameon=False, fontsize="small", ncols=2 if len(fits) > 3 else 1)
    return ax


def restitution_curve(estimate: Estimate, speeds: Curve) -> tuple[Curve, Curve, Curve] | None:
    """Speeds, the fitted law's restitution there, and half the width of its 95 % band; nothing for
    a law whose restitution has no closed form.
    """
    stop = estimate.system.model.lower
    if stop is None or not isinstance(stop.law, AbstractImpactLaw | _ClosedForm):
        return None
    told = identifiability(estimate)
    middle, slopes = _sloped(estimate.problem.system, estimate.names, estimate.values, speeds)
    own = np.array(told.of_model)
    errors = jax.vmap(told.directions.error)((slopes * told.scale)[:, own])
    return speeds, middle, 1.96 * errors


@eqx.filter_jit
def _sloped(
    system: System, names: tuple[str, ...], values: Array, speeds: Curve
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


def _impacts(estimate: Estimate) -> tuple[np.ndarray, np.ndarray]:
    """Approach speeds and restitutions of the complete impacts."""
    log = estimate.impacts
    shown = np.asarray(log.happened & log.complete)
    return np.asarray(log.approach_speed)[shown], np.asarray(log.restitution)[shown]
