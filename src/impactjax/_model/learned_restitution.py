"""Restitution that is learned rather than named: any curve that does not rise with the speed."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._model.law import AbstractImpactLaw
from impactjax._parameter import Requirement, as_parameter
from impactjax._types import Numbers, Ratio, Speed

_LEAST_SHARE = 1e-3  # the derivative by a weight vanishes with its share

Shares = Float[Array, " shares"]


class LearnedRestitution(AbstractImpactLaw):
    """Any coefficient of restitution between 0 and 1 that does not rise with the speed of impact:

    r(v) = 1 − w₀ − Σ wₖ Iₖ(v),        w = softmax(weights).

    Iₖ rises from 0 to 1 around the kth speed: it is the integral of a hat function over that speed
    and its neighbours. So −r′ is linear between the speeds, r has a continuous slope, and r is
    constant below the first speed and above the last. The shares w add up to one; the last of them
    is r at the last speed.

    The weights are not named parameters: `learn` fits them, `fit` does not.

    Source: monotone regression splines (I-splines of order 2), Ramsay, Statistical Science 3, 425
    (1988).

    **Arguments:**

    - `speeds`: at least two nodes, strictly increasing, over the range of the impacts [m/s].
    - `weights`: two more than speeds, any real numbers [1].

    **Raises** `ValueError` for other speeds or another number of weights.
    """

    speeds: Float[Array, "... speeds"] = eqx.field(converter=as_parameter)
    weights: Float[Array, "... shares"] = eqx.field(converter=as_parameter)

    @staticmethod
    def like(law: AbstractImpactLaw, speeds: Numbers) -> "LearnedRestitution":
        """A law close to another one, to start from.

        Each share is the decrease of r between the midpoints to the neighbouring speeds, but at
        least 0.001, so that all weights can be learned.

        **Arguments:**

        - `law`: impact law to approximate, such as the named law that fits best.
        - `speeds`: nodes of the new law [m/s].
        """
        speeds = as_parameter(speeds)
        halfway = jnp.concatenate([speeds[:1], (speeds[1:] + speeds[:-1]) / 2, speeds[-1:]])
        r = law.restitution(halfway)
        shares = jnp.concatenate([1 - r[:1], r[:-1] - r[1:], r[-1:]])
        return LearnedRestitution(speeds, jnp.log(jnp.maximum(shares, _LEAST_SHARE)))

    def restitution(self, speed: Speed) -> Ratio:
        shares = jax.nn.softmax(self.weights)
        return 1 - shares[0] - _rises(self.speeds, speed) @ shares[1:-1]

    def requirements(self) -> list[Requirement]:
        """Conditions on the nodes and weights."""
        ordered = (jnp.diff(self.speeds) > 0) & (self.speeds[..., :-1] >= 0)
        finite = jnp.isfinite(self.speeds)
        sentence = "Argument `speeds` must be finite, not negative, and increase strictly"
        known = jnp.isfinite(self.weights)
        return [
            Requirement(jnp.all(ordered, axis=-1), sentence),
            Requirement(jnp.all(finite, axis=-1), sentence),
            Requirement(jnp.all(known, axis=-1), "Argument `weights` must be finite"),
        ]

    def __check_init__(self) -> None:
        count = self.speeds.shape[-1] if self.speeds.ndim else 0
        if count < 2:
            raise ValueError("LearnedRestitution: Argument `speeds` must hold at least two speeds.")
        if self.weights.ndim == 0 or self.weights.shape[-1] != count + 2:
            raise ValueError(
                f"LearnedRestitution: Argument `weights` must hold two more weights than the "
                f"{count} speeds, but its shape is {self.weights.shape}."
            )


def _rises(speeds: Shares, speed: Speed) -> Float[Array, "... speeds"]:
    """The integrals Iₖ of the hat functions, each of area one."""
    before = jnp.diff(speeds, prepend=speeds[:1])
    after = jnp.diff(speeds, append=speeds[-1:])
    beyond = speed[..., None] - speeds
    up = jnp.clip(1 + beyond / jnp.where(before > 0, before, 1.0), 0, 1)
    down = jnp.clip(beyond / jnp.where(after > 0, after, 1.0), 0, 1)
    return (before * up**2 + after * down * (2 - down)) / (before + after)
