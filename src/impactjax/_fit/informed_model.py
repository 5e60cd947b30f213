"""Linear mixed model with prior knowledge of its parameters.

For each ratio of the model the observations give the parameters p an expectation and a covariance.
Prior knowledge D p + z, with independent standard normal numbers, is combined with them as in a
Kalman filter, and weighs the ratios by its probability. As far as it tells what the observations
tell as well, it is one more observation of the noise: a prior without an error conditions Student's
distribution. Directions without information get a wide distribution first.

Source: S. Kotz and S. Nadarajah (2004), "Multivariate t distributions and their applications",
section 1.11, for the conditional distribution.
"""

from typing import NamedTuple

from jaxtyping import Bool, Float

from impactjax._fit.determined import determined
from impactjax._fit.mixed_model import UNTOLD, MixedModel, Observed
from impactjax._known import AnyArray, namespace
from impactjax._problem.prior import PriorRows

_WIDE = 1e6  # variance of what the observations do not tell, relative to that of a prior

Slopes = Float[AnyArray, "priors parameters"]
Square = Float[AnyArray, "parameters parameters"]
Moves = Float[AnyArray, "ratios parameters"]


class _Updated(NamedTuple):
    """Distributions that were combined with prior knowledge.

    - `moves`: changes of the expectations.
    - `covariances`: covariances.
    - `log_determinants`: log det (I + D C Dᵀ) of the covariances C before.
    - `squares`: squared distances of the prior knowledge, in units of I + D C Dᵀ.
    - `told`: number of parameters that the prior knowledge tells.
    """

    moves: Moves
    covariances: Float[AnyArray, "ratios parameters parameters"]
    log_determinants: Float[AnyArray, " ratios"]
    squares: Float[AnyArray, " ratios"]
    told: Float[AnyArray, " ratios"]


def informed(data: Observed, model: MixedModel, prior: PriorRows) -> MixedModel:
    """The solution of a mixed model with prior knowledge.

    **Arguments:**

    - `data`: observations, of which `model` is the solution.
    - `prior`: deviations z at a change of zero, and their slopes D.
    """
    xp, freedom = namespace(data), model.freedom
    wide, known = _untold(data.jacobian, prior.slopes)
    left = prior.deviations + model.values @ prior.slopes.T
    own = _updated(model.scales + wide, prior.slopes, left)
    alone = _updated(wide[None], prior.slopes, left[:1])
    gained = xp.maximum(own.told - alone.told, 0.0)
    growth = (freedom + xp.minimum(gained, 1.0) * own.squares) / (freedom + gained)
    found = _updated(model.scales * growth[:, None, None] + wide, prior.slopes, left)
    log_odds = -(freedom + gained) * xp.log1p(own.squares / freedom) - own.log_determinants
    weights = model.weights * xp.exp((log_odds - xp.max(log_odds)) / 2)
    weights = weights / xp.sum(weights)
    more = weights @ gained
    return model._replace(
        weights=weights,
        values=model.values + found.moves,
        scales=found.covariances,
        effects=model.effects + _effects(data, model, found.moves),
        squares=model.squares * growth * (freedom + more) / freedom,
        freedom=freedom + more,
        determined=known,
    )


def _updated(
    covariances: Float[AnyArray, "ratios parameters parameters"],
    slopes: Slopes,
    left: Float[AnyArray, "ratios priors"],
) -> _Updated:
    """The Kalman update, in the form of Joseph."""
    xp = namespace(covariances)
    across = covariances @ slopes.T
    own = slopes @ across
    whole = own + xp.eye(len(slopes), dtype=own.dtype)
    inverse = xp.linalg.inv(whole)
    gain = across @ inverse
    kept = xp.eye(slopes.shape[1], dtype=own.dtype) - gain @ slopes
    turned = (xp.swapaxes(x, 1, 2) for x in (kept, gain))
    kept_turned, gain_turned = turned
    return _Updated(
        -xp.einsum("gik,gk->gi", gain, left),
        kept @ covariances @ kept_turned + gain @ gain_turned,
        xp.linalg.slogdet(whole)[1],
        xp.einsum("gk,gkl,gl->g", left, inverse, left),
        xp.einsum("gkl,glk->g", own, inverse),
    )


def _untold(
    jacobian: Float[AnyArray, "observations parameters"], slopes: Slopes
) -> tuple[Square, Bool[AnyArray, " parameters"]]:
    """A wide covariance in the directions that change no observation, and a mask of the parameters
    that observations and priors determine together.
    """
    xp = namespace(jacobian, slopes)
    norms = xp.linalg.norm(jacobian, axis=0)
    norms = xp.where(norms > 0, norms, 1.0)
    scaled, own = jacobian / norms, slopes / norms
    own = own / xp.linalg.norm(own, axis=1, keepdims=True)
    enough = max(jacobian.shape[1] - jacobian.shape[0], 0)
    _, lengths, axes = xp.linalg.svd(xp.pad(scaled, ((0, enough), (0, 0))), full_matrices=False)
    lost = xp.where((lengths > UNTOLD * xp.max(lengths))[:, None], 0.0, axes)
    touched = xp.sum((own @ lost.T) ** 2, axis=1) > UNTOLD
    without = lost.T @ lost / norms / norms[:, None]
    least = xp.diagonal(slopes @ without @ slopes.T)
    least = xp.min(xp.where(touched, least, xp.inf))
    size = xp.where(xp.isfinite(least), _WIDE / xp.where(xp.isfinite(least), least, 1.0), 0.0)
    both = xp.pad(xp.concatenate([scaled, own]), ((0, enough), (0, 0)))
    _, lengths, axes = xp.linalg.svd(both, full_matrices=False)
    return size * without, determined(axes, lengths > UNTOLD * xp.max(lengths))


def _effects(data: Observed, model: MixedModel, moves: Moves) -> Float[AnyArray, "ratios effects"]:
    """Change of the expected random effects by that of the parameters:
    −λ (I + λ Aᵀ A)⁻¹ Aᵀ J.
    """
    xp, ratios = namespace(data), model.ratios[:, None]
    strengths, axes = xp.linalg.eigh(data.effects.T @ data.effects)
    along = moves @ (axes.T @ (data.effects.T @ data.jacobian)).T
    return -(ratios / (1 + ratios * xp.maximum(strengths, 0.0)) * along) @ axes.T
