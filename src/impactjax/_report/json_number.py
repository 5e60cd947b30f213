"""Numbers of JSON files."""

import math

import numpy as np
from jaxtyping import ArrayLike


def json_number(value: ArrayLike) -> float | None:
    """A JSON number; null if it is not finite."""
    number = float(np.asarray(value))
    return number if math.isfinite(number) else None
