"""The thesis's own model of rest: a mass that has come to rest on the stop never leaves it."""

import numpy as np

from impactjax._thesis.motions import Motion


def stuck_for_ever(motion: Motion) -> np.ndarray:
    """Angle of the thesis's model, from a motion of the same system with a rest that ends [rad].

    Both are equal until the first infinite series of impacts has ended. The thesis's motion is at
    rest from there on, "in effect a fixed point attractor", although the base still moves.
    """
    return np.where(motion.ts < stuck_from(motion), motion.position, 0.0)


def stuck_from(motion: Motion) -> float:
    """Time at which the thesis's model comes to rest; infinite if it does not [s]."""
    return float(motion.rests.begin[0]) if int(motion.rests.count) else np.inf
