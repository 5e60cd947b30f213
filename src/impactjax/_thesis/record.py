"""Stand-ins for the thesis's measurements, which are lost."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from impactjax._thesis.constants import CUTOFF, OMEGA0

LOST = "simulated record (measurement lost)"
"""Label of a stand-in in figures and tables."""
NOISE = math.radians(0.2)  # of a sample; the thesis's noise is not known [rad]
SENSOR_ORDER = 2  # of the filter, which the thesis does not say
_SEED = 2005


def sensor() -> ij.Sensor:
    """The thesis's potentiometer with its filter, and noise of a plausible size."""
    return ij.Sensor(low_pass=ij.Butterworth(CUTOFF, order=SENSOR_ORDER), sigma=NOISE)


def recorded(model: ij.ImpactOscillator, motion: ij.Trajectory) -> np.ndarray:
    """A record of a motion by the thesis's sensor [rad]."""
    noise = np.random.default_rng(_SEED).standard_normal(motion.ts.shape)
    return np.asarray(_shown(model, motion)) + NOISE * noise


@eqx.filter_jit
def _shown(model: ij.ImpactOscillator, motion: ij.Trajectory) -> jax.Array:
    return sensor().shown(model, jax.tree.map(jnp.asarray, motion), ij.Angle())


def material() -> ij.KelvinVoigtLinearRestitution:
    """The contact behind the simulated records of chapter 3: that of Figure 3.9 (b)."""
    return ij.KelvinVoigtLinearRestitution(OMEGA0, 0.58, 0.015)
