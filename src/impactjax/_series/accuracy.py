"""The longest step at which the last terms of a Taylor series are within a tolerance."""

import jax.numpy as jnp

from impactjax._series.taylor import Series
from impactjax._types import Each, Scalar

LAST_TERM = 1.0  # of the series allowed, as a fraction of the tolerance


def longest_accurate(speeds: list[Series], tolerance: Scalar) -> Each:
    """The longest step w, in units of the series, whose last terms are within the tolerance ε.

    A series Σ aₖ wᵏ of order p passes if each of its last four terms is small compared with the
    largest of its first three, on a geometric path from there to ε at the last term:

        |aₖ| wᵏ ≤ max over j = 0, 1, 2 of |aⱼ| wʲ ε^((k − j)/(p − j)),

    so w = min over k of max over j of (|aⱼ|/|aₖ|)^(1/(k − j)) ε^(1/(p − j)), computed with
    logarithms. The position follows from its rate and needs no test of its own.

    Source: generalises the step size of Jorba & Zou, Experimental Mathematics 14, 99 (2005),
    section 3, to series with small or vanishing coefficients.
    """
    tiny = jnp.finfo(tolerance.dtype).tiny
    goal = jnp.log(LAST_TERM * tolerance)
    longest = jnp.full_like(goal, jnp.inf)
    for series in speeds:
        last = len(series) - 1
        heads = [jnp.log(jnp.abs(series[j]) + tiny) for j in range(3)]
        for power, term in _last_terms(series):
            end = jnp.log(jnp.abs(term) + tiny)
            ratios = [
                (head - end) / (power - j) + goal / (last - j) for j, head in enumerate(heads)
            ]
            best = jnp.maximum(jnp.maximum(ratios[0], ratios[1]), ratios[2])
            best = jnp.where(term == 0, jnp.inf, best)
            longest = jnp.minimum(longest, best)
    return jnp.exp(longest)


def _last_terms(series: Series) -> list[tuple[Each | int, Each]]:
    """The last four terms with their powers; if all vanish, also the last one that does not.

    A series may have gaps, so that a single last term may be zero and tells nothing. Example: at
    the surface of a cubic spring it has only t, t⁵, t⁹, ...
    """
    last = len(series) - 1
    terms: list[tuple[Each | int, Each]] = [
        (power, series[power]) for power in range(last, max(last - 4, 2), -1)
    ]
    vanish = sum(jnp.abs(term) for _, term in terms) == 0
    power, term = jnp.full_like(series[0], 3), jnp.zeros_like(series[0])
    for j in range(3, last - 3):
        power = jnp.where(series[j] != 0, j, power)
        term = jnp.where(vanish & (series[j] != 0), series[j], term)
    return [*terms, (power, term)]
