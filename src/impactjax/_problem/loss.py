"""How much a residual counts."""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._parameter import as_parameter, is_positive, raise_if_violated
from impactjax._shown import with_numbers

Residuals = Float[Array, "..."]


class AbstractLoss(eqx.Module):
    """The cost ρ(e) of a residual e, about e²/2 where it is small."""

    @abc.abstractmethod
    def cost(self, residuals: Residuals) -> Residuals:
        """ρ of each residual, in its unit squared."""

    def score(self, residuals: Residuals) -> Residuals:
        """ρ′: how much each residual pulls."""
        return jax.jvp(self.cost, (residuals,), (jnp.ones_like(residuals),))[1]

    def stiffness(self, residuals: Residuals) -> Residuals:
        """ρ″: by how much the pull grows with the residual."""
        return jax.jvp(self.score, (residuals,), (jnp.ones_like(residuals),))[1]

    def weight(self, residuals: Residuals) -> Residuals:
        """ρ′(e) / e: one where the loss is that of least squares, less for outliers."""
        zero = residuals == 0
        safe = jnp.where(zero, 1.0, residuals)
        return jnp.where(zero, 1.0, self.score(safe) / safe)

    __repr__ = with_numbers


class Squares(AbstractLoss):
    """Least squares: e² / 2. The most efficient loss for normal noise, led astray by outliers."""

    def cost(self, residuals: Residuals) -> Residuals:
        return residuals**2 / 2


class SoftL1(AbstractLoss):
    """Squares for small residuals, absolute values for large ones: s² (√(1 + (e/s)²) − 1).

    **Arguments:**

    - `scale`: s, beyond which a residual is large: about the size of the noise, in its unit.
    """

    scale: Float[Array, "..."] = eqx.field(converter=as_parameter)

    def __check_init__(self) -> None:
        raise_if_violated(self, [is_positive("scale", self.scale)])

    def cost(self, residuals: Residuals) -> Residuals:
        return self.scale**2 * (jnp.sqrt(1 + (residuals / self.scale) ** 2) - 1)


class Cauchy(AbstractLoss):
    """Large residuals hardly count: s²/2 ln(1 + (e/s)²).

    **Arguments:**

    - `scale`: s, beyond which a residual is large: about twice the size of the noise.
    """

    scale: Float[Array, "..."] = eqx.field(converter=as_parameter)

    def __check_init__(self) -> None:
        raise_if_violated(self, [is_positive("scale", self.scale)])

    def cost(self, residuals: Residuals) -> Residuals:
        return self.scale**2 / 2 * jnp.log1p((residuals / self.scale) ** 2)


class StudentT(AbstractLoss):
    """The likelihood of Student's distribution with ν degrees of freedom, scaled so that it is
    e²/2 for small residuals: ν s²/2 ln(1 + (e/s)² / ν).

    **Arguments:**

    - `scale`: s, the size of the noise without its outliers, in its unit.
    - `freedom`: ν; 4 is usual, the fewer the less an outlier counts.
    """

    scale: Float[Array, "..."] = eqx.field(converter=as_parameter)
    freedom: Float[Array, "..."] = eqx.field(converter=as_parameter, default=4.0)

    def __check_init__(self) -> None:
        raise_if_violated(
            self, [is_positive("scale", self.scale), is_positive("freedom", self.freedom)]
        )

    def cost(self, residuals: Residuals) -> Residuals:
        z = (residuals / self.scale) ** 2
        return self.freedom * self.scale**2 / 2 * jnp.log1p(z / self.freedom)
