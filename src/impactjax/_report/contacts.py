"""Penetration and force of the contacts of a fitted motion."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from impactjax._model.equivalents import ClosedForm, Equivalents
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._simulate.flow import walls
from impactjax._simulate.impact_log import ImpactLog
from impactjax._types import Mass

Column = Float[np.ndarray, " impacts"]


class Contacts(NamedTuple):
    """Contacts of a motion, one for each row of its impact log.

    - `soft`: mask of the impacts that have a duration.
    - `penetration`, `force`: deepest penetration [m] and peak force [N] of a contact at this speed
      without weight or drive; NaN without a closed form, and where contact resumes.
    """

    soft: Bool[np.ndarray, " impacts"]
    penetration: Column
    force: Column


def contacts_of(model: ImpactOscillator, log: ImpactLog) -> Contacts:
    """The contacts of a fitted model's motion, from its impact log in NumPy arrays."""
    speeds = np.asarray(log.approach_speed)
    soft, unknown = np.zeros(speeds.shape, bool), np.full(speeds.shape, np.nan)
    penetration, force = unknown, unknown
    for wall in walls(model):
        law, here = wall.stop.law, np.asarray(log.stop) == wall.index
        if not isinstance(law, AbstractForceLaw):
            continue
        soft = soft | here
        if isinstance(law, ClosedForm):
            found = _outcomes(law, jnp.asarray(speeds), model.oscillator.mass)
            known = here & (speeds > 0)
            penetration = np.where(known, found.deepest_penetration, penetration)
            force = np.where(known, found.peak_force, force)
    return Contacts(soft, penetration, force)


@eqx.filter_jit
def _outcomes(law: ClosedForm, speeds: Float[Array, " impacts"], mass: Mass) -> Equivalents:
    return law.equivalents(speeds, mass)
