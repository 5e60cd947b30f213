"""Size of the scatter of restitution from impact to impact."""

import math

import equinox as eqx
from jaxtyping import Float

from impactjax._fit.quantiles import NORMAL
from impactjax._known import AnyArray, namespace


class Scatter(eqx.Module):
    """Scatter of the speed after an impact, relative to that of the law.

    - `size`: standard deviation s of the logarithm of the speed, its median [1].
    - `low`, `high`: ends of its 95 % interval; `low` is 0 if the record may have no scatter [1].
    - `logarithms`: expected deviation of each impact, the logarithm of its factor [1].
    - `jacobian`: derivatives of the residuals by the fitted parameters, in units of scatter and
      noise together, relative to the noise.
    """

    size: Float[AnyArray, "..."]
    low: Float[AnyArray, "..."]
    high: Float[AnyArray, "..."]
    logarithms: Float[AnyArray, "... impacts"]
    jacobian: Float[AnyArray, "... observations parameters"]

    @property
    def single(self) -> tuple[Float[AnyArray, "..."], Float[AnyArray, "..."]]:
        """Factors between which 95 % of single impacts lie, relative to the law [1]."""
        reach = namespace(self.size).exp(NORMAL * self.size)
        return 1 / reach, reach

    def shortened(self, count: int) -> "Scatter":
        """The scatter with the first rows of the derivatives."""
        return eqx.tree_at(lambda each: each.jacobian, self, self.jacobian[:count])

    def __str__(self) -> str:
        if not math.isfinite(float(self.high)):
            return "scatter from impact to impact: not told"
        size, low, high = (100 * float(x) for x in (self.size, self.low, self.high))
        digits = max(1 - math.floor(math.log10(high)), 0) if high > 0 else 1
        if low == 0:
            return f"scatter from impact to impact: less than {high:.{digits}f} %"
        return (
            f"scatter from impact to impact: {size:.{digits}f} % "
            f"({low:.{digits}f} to {high:.{digits}f} %)"
        )
