"""The order of a Taylor series."""

import math

import numpy as np
from jax.core import Tracer
from jaxtyping import ArrayLike

LOWEST_ORDER = 4


def natural_order(tolerance: ArrayLike) -> int:
    """The order p = 1 − ln(tolerance) / 2, rounded up, at which a Taylor series has the least cost
    per unit of time; at least the lowest order possible. A traced tolerance counts as 1e-12.

    Source: Jorba and Zou, Experimental Mathematics 14 (2005), section 3.
    """
    least = 1e-12 if isinstance(tolerance, Tracer) else float(np.min(tolerance))
    return max(LOWEST_ORDER, math.ceil(1 - math.log(min(least, 1.0)) / 2))
