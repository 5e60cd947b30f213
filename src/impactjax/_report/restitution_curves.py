"""Restitution against speed: impacts of the fitted motion, and curves of the laws."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._compare.comparison import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._identify.identifiability import identifiability
from impactjax._identify.information import Information
from impactjax._model.equivalents import ClosedForm
from impactjax._model.law import AbstractImpactLaw
from impactjax._problem.parameters import replaced
from impactjax._problem.problem import Problem
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog

_POINTS = 200

Curve = Float[Array | np.ndarray, " speeds"]


def speeds_of(fits: Sequence[Fitted]) -> Float[Array, " speeds"]:
    """Approach speeds up to those of the fastest impact of several fitted motions [m/s]."""
    fastest = max(float(np.max(impacts(each.estimate.impacts)[0], initial=0)) for each in fits)
    return jnp.asarray(np.linspace(1e-3, 1.05, _POINTS) * fastest)


def restitution_curve(
    estimate: Estimate[Problem], speeds: Float[Array, " speeds"]
) -> tuple[Curve, Curve, Curve] | None:
    """Speeds, the fitted law's restitution there, and half the width of its 95 % band; `None` for a
    law whose restitution has no closed form.
    """
    stop = estimate.system.model.lower
    if stop is None or not isinstance(stop.law, AbstractImpactLaw | ClosedForm):
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
            assert isinstance(law, ClosedForm)
            found = law.equivalents(speeds, model.oscillator.mass).restitution
        return found, found

    slopes, middle = jax.jacfwd(restitution, has_aux=True)(values)
    return middle, slopes


def impacts(log: ImpactLog) -> tuple[np.ndarray, np.ndarray]:
    """Approach speeds and restitutions of the complete impacts."""
    shown = np.flatnonzero(np.asarray(log.complete)[: int(log.count)])
    return np.asarray(log.approach_speed)[shown], np.asarray(log.restitution)[shown]
