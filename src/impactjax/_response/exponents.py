"""Lyapunov exponents, from the growth of disturbances."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._hybrid.lane import Start
from impactjax._response.sampler import Growth
from impactjax._results import RESULTS
from impactjax._simulate.lane_state import LaneState
from impactjax._types import Scalar


class Exponents(eqx.Module):
    """Lyapunov exponents of a motion.

    - `values`: the exponents per unit of time, the largest first.
    - `errors`: their standard errors, by batch means; they hold if the batches are longer than the
      memory of the motion. NaN for an exponent of −∞.
    - `growth`: logarithms of the growth in each period, from which all follows.
    - `final`: the end of the motion, from which a `section`, or `simulate`, goes on.
    - `result`: result code.
    """

    values: Float[Array, "... numbers"]
    errors: Float[Array, "... numbers"]
    growth: Float[Array, "... periods numbers"]
    final: Start | LaneState
    result: RESULTS

    @property
    def sum(self) -> Float[Array, "..."]:
        """Sum of all exponents: the mean rate at which volumes of states grow."""
        return self.values.sum(-1)


def exponents_of(growth: Growth, period: Scalar) -> Exponents:
    """Exponents of a motion and their errors, the largest exponent first."""
    good = growth.result == RESULTS.successful
    known = jnp.where(good, growth.logarithms, jnp.nan)
    known = known[:, jnp.argsort(-known.mean(0))]
    count, numbers = known.shape
    batches = math.isqrt(count)
    means = known[count % batches :].reshape(batches, -1, numbers).mean(1)
    errors = jnp.std(means, axis=0, ddof=1) / math.sqrt(batches)
    return Exponents(known.mean(0) / period, errors / period, known, growth.final, growth.result)
