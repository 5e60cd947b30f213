"""Stand-ins for the thesis's measurements, which are lost."""

import math

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from impactjax._thesis.constants import CUTOFF, OMEGA0
from impactjax._thesis.motions import Motion

LOST = "simulated record (measurement lost)"
"""Label of a stand-in in figures and tables."""
NOISE = math.radians(0.2)  # of a sample; the thesis's noise is not known [rad]
_ORDER = 2  # of the filter, which the thesis does not say
DELAY = math.sqrt(2) / (2 * math.pi * CUTOFF)  # of slow motions by this filter [s]
_SEED = 2005


def sensor() -> ij.Sensor:
    """The thesis's potentiometer with its filter, and noise of a plausible size."""
    return ij.Sensor(low_pass=ij.Butterworth(CUTOFF, order=_ORDER), sigma=NOISE)


def recorded(motion: Motion) -> np.ndarray:
    """A record of a motion by the thesis's sensor [rad]."""
    noise = np.random.default_rng(_SEED).standard_normal(motion.ts.size)
    low_pass = ij.Butterworth(CUTOFF, order=_ORDER)
    return np.asarray(_filtered(low_pass, *map(jnp.asarray, motion[:3]))) + NOISE * noise


_filtered = jax.jit(ij.Butterworth.filtered)


def material() -> ij.KelvinVoigtLinearRestitution:
    """The contact behind the simulated records of chapter 3: that of Figure 3.9 (b)."""
    return ij.KelvinVoigtLinearRestitution(OMEGA0, 0.58, 0.015)
