"""Loss functions: the cost of a residual.

Source: P. J. Huber and E. M. Ronchetti (2009), "Robust statistics", for losses that limit the
influence of outliers.
"""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._parameter import as_parameter, is_positive, raise_if_violated
from impactjax._shown import with_numbers

Residuals = Float[AnyArray, "..."]


class AbstractLoss(eqx.Module):
    """The cost ρ(e) of a residual e, which is about e²/2 for small e."""

    @abc.abstractmethod
    def cost(self, residuals: Residuals) -> Residuals:
        """Cost ρ of each residual, in its unit squared."""

    @eqx.filter_jit
    def score(self, residuals: Residuals) -> Residuals:
        """Derivative ρ′: the influence of each residual."""
        return jax.jvp(self.cost, (residuals,), (jnp.ones_like(residuals),))[1]

    @eqx.filter_jit
    def stiffness(self, residuals: Residuals) -> Residuals:
        """Second derivative ρ″ at each residual."""
        return jax.jvp(self.score, (residuals,), (jnp.ones_like(residuals),))[1]

    @eqx.filter_jit
    def weight(self, residuals: Residuals) -> Residuals:
        """Weight ρ′(e) / e of each residual: 1 for least squares, less for outliers."""
        zero = residuals == 0
        safe = jnp.where(zero, 1.0, residuals)
        return jnp.where(zero, 1.0, self.score(safe) / safe)

    __repr__ = with_numbers


class Squares(AbstractLoss):
    """Least squares: e² / 2. The most efficient loss for normal noise; sensitive to outliers."""

    def cost(self, residuals: Residuals) -> Residuals:
        return residuals**2 / 2


class SoftL1(AbstractLoss):
    """Squares for small residuals, absolute values for large ones: s² (√(1 + (e/s)²) − 1).

    **Arguments:**

    - `scale`: s, beyond which a residual is large: about the noise's standard deviation, in its
      unit.
    """

    scale: Float[AnyArray, "..."] = eqx.field(converter=as_parameter)

    def __check_init__(self) -> None:
        raise_if_violated(self, [is_positive("scale", self.scale)])

    def cost(self, residuals: Residuals) -> Residuals:
        z = (residuals / self.scale) ** 2
        return self.scale**2 * (namespace(z).sqrt(1 + z) - 1)


class Cauchy(AbstractLoss):
    """Logarithmic loss, with which large residuals hardly count: s²/2 ln(1 + (e/s)²).

    **Arguments:**

    - `scale`: s, beyond which a residual is large: about twice the noise's standard deviation.
    """

    scale: Float[AnyArray, "..."] = eqx.field(converter=as_parameter)

    def __check_init__(self) -> None:
        raise_if_violated(self, [is_positive("scale", self.scale)])

    def cost(self, residuals: Residuals) -> Residuals:
        z = (residuals / self.scale) ** 2
        return self.scale**2 / 2 * namespace(z).log1p(z)


class StudentT(AbstractLoss):
    """Negative log-likelihood of Student's t distribution with ν degrees of freedom, scaled to
    e²/2 for small residuals: ν s²/2 ln(1 + (e/s)² / ν).

    **Arguments:**

    - `scale`: s, the standard deviation of the noise without its outliers, in its unit.
    - `freedom`: ν; 4 is usual; the smaller, the less an outlier counts.
    """

    scale: Float[AnyArray, "..."] = eqx.field(converter=as_parameter)
    freedom: Float[AnyArray, "..."] = eqx.field(converter=as_parameter, default=4.0)

    def __check_init__(self) -> None:
        raise_if_violated(
            self, [is_positive("scale", self.scale), is_positive("freedom", self.freedom)]
        )

    def cost(self, residuals: Residuals) -> Residuals:
        z = (residuals / self.scale) ** 2
        return self.freedom * self.scale**2 / 2 * namespace(z).log1p(z / self.freedom)
