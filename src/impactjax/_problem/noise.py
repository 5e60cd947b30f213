"""Noise models: the covariance of the residuals, from which that of the estimate follows."""

import abc
import itertools
from typing import TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Key
from scipy import special

from impactjax._known import AnyArray, namespace
from impactjax._optimise.linearisation import Matrix
from impactjax._shown import with_numbers

_FEWEST = 8  # lines of a spectrum that can tell whether it is flat
_UNLIKELY = 1e-5  # significance level of the test for lasting correlation

Scores = Float[AnyArray, " observations"]
Jacobian = Float[AnyArray, "observations parameters"]
Scalar = Float[AnyArray, ""]
Order: TypeAlias = tuple[AnyArray, AnyArray]  # weights, residual variance


class AbstractNoise(eqx.Module):
    """A model of the residuals, which gives the covariance of the cost's gradient Jᵀ e.

    The *scores* e are ρ′ of the residuals: the residuals themselves for least squares.
    """

    @abc.abstractmethod
    def order(self, scores: Scores, count: Scalar) -> Int[AnyArray, ""]:
        """Order of the autoregression of the residuals; 0 if they are independent."""

    @abc.abstractmethod
    def lasts(self, scores: Scores, count: Scalar) -> Bool[AnyArray, ""]:
        """True if the scores are autocorrelated over longer times than in the model."""

    @abc.abstractmethod
    def spread(self, scores: Scores, count: Scalar, jacobian: Jacobian) -> Matrix:
        """Covariance of Jᵀ e, with errors e distributed like the `count` scores that are valid."""

    @abc.abstractmethod
    def drawn(self, key: Key[Array, ""], scores: Scores, count: Scalar) -> Scores:
        """A random sample of normal errors with the variance and correlation of the scores."""

    __repr__ = with_numbers


class WhiteNoise(AbstractNoise):
    """Independent errors of one size: σ² Jᵀ J."""

    def order(self, scores: Scores, count: Scalar) -> Int[AnyArray, ""]:
        del scores, count
        return np.int32(0)

    def lasts(self, scores: Scores, count: Scalar) -> Bool[AnyArray, ""]:
        del scores, count
        return np.zeros((), bool)

    def spread(self, scores: Scores, count: Scalar, jacobian: Jacobian) -> Matrix:
        return (scores**2).sum() / count * (jacobian.T @ jacobian)

    def drawn(self, key: Key[Array, ""], scores: Scores, count: Scalar) -> Scores:
        size = jnp.sqrt(jnp.sum(scores**2) / count)
        return size * jax.random.normal(key, scores.shape, scores.dtype)


class AutoregressiveNoise(AbstractNoise):
    """Autoregressive errors, eₜ = Σ aₖ eₜ₋ₖ + white noise. The Bayesian information criterion of
    the residuals chooses the order; it is 0 if they are independent.

    The covariance of Jᵀ e is (1/M) Σ S(ω) J̃* J̃ᵀ over the M frequencies of the record, with the
    Fourier transform J̃ and the spectrum S = σ² / |1 − Σ aₖ exp(−iωk)|². Samples are taken as
    evenly spaced.

    Source: the Yule-Walker equations, solved by Levinson's recursion on the autocovariances; the
    covariance of least squares under correlated errors as in Hannan (1963), "Regression for time
    series".

    **Arguments:**

    - `most`: highest order; no more than a tenth of the number of samples is used.
    """

    most: int = eqx.field(default=24, static=True)

    def order(self, scores: Scores, count: Scalar) -> Int[AnyArray, ""]:
        return self._fitted(scores, count)[0]

    def lasts(self, scores: Scores, count: Scalar) -> Bool[AnyArray, ""]:
        """True if the periodogram divided by S is not flat at frequencies below one period in twice
        the longest memory: if the portmanteau statistic Q = N Σ ρₖ² of its N/2 lines exceeds its
        limit. False for records with fewer than eight lines.

        Source: G. E. P. Box and D. A. Pierce (1970), Journal of the American Statistical
        Association 65, 1509, for the statistic.
        """
        length = scores.shape[0]
        lines = length // (2 * (self.most + 1))
        if lines < _FEWEST:
            return np.zeros((), bool)
        xp = namespace(scores, count)
        power = xp.abs(xp.fft.rfft(scores)) ** 2
        flat = power / self._spectrum(scores, count, length)
        low = xp.where(xp.arange(lines + 1) > 0, flat[: lines + 1], 0.0)  # not that of the mean
        rho = xp.fft.irfft(low, 2 * lines)
        lags = lines // 2
        squares = xp.sum((rho[1 : lags + 1] / xp.where(rho[0] > 0, rho[0], 1.0)) ** 2)
        statistic = 2 * lines * (count / length) * squares
        return statistic > float(special.chdtri(lags, _UNLIKELY))

    def spread(self, scores: Scores, count: Scalar, jacobian: Jacobian) -> Matrix:
        xp, length = namespace(scores, count, jacobian), 2 * scores.shape[0]
        spectrum = self._spectrum(scores, count, length)
        place, last = xp.arange(spectrum.shape[0]), spectrum.shape[0] - 1
        both = xp.where((place > 0) & (place < last), 2 * spectrum, spectrum)  # ω and −ω
        transformed = xp.fft.rfft(jacobian, length, axis=0)
        weights = both[:, None] / length
        real, imaginary = xp.real(transformed), xp.imag(transformed)
        return real.T @ (weights * real) + imaginary.T @ (weights * imaginary)

    def drawn(self, key: Key[Array, ""], scores: Scores, count: Scalar) -> Scores:
        length = 2 * scores.shape[0]
        white = jax.random.normal(key, (length,), scores.dtype)
        gain = jnp.sqrt(self._spectrum(scores, count, length))
        transformed = jnp.fft.rfft(white)
        shaped = jax.lax.complex(gain * transformed.real, gain * transformed.imag)
        return jnp.fft.irfft(shaped, length)[: scores.shape[0]]

    def _spectrum(
        self, scores: Scores, count: Scalar, length: int
    ) -> Float[AnyArray, " frequencies"]:
        """Spectrum S at the frequencies of a record of `length` samples."""
        _, weights, variance = self._fitted(scores, count)
        xp = namespace(weights, variance)
        one = xp.ones(1, scores.dtype)
        return variance / xp.abs(xp.fft.rfft(xp.concatenate([one, -weights]), length)) ** 2

    def _fitted(self, scores: Scores, count: Scalar) -> tuple[Int[AnyArray, ""], AnyArray, Scalar]:
        """Order, weights a₁, a₂, ... with zeros beyond the order, and variance σ²."""
        most = min(self.most, scores.shape[0] // 10)
        covariances, xp = autocovariances(scores, count, most), namespace(scores, count)
        weights, variances = levinson(covariances)
        orders = xp.arange(most + 1, dtype=scores.dtype)
        tiny = np.finfo(scores.dtype).tiny
        criterion = count * xp.log(xp.maximum(variances, tiny)) + xp.log(count) * orders
        criterion = xp.where(orders <= xp.maximum(count // 10, 0), criterion, xp.inf)
        best = xp.argmin(criterion).astype(np.int32)
        return best, weights[best], variances[best]


def autocovariances(
    scores: Float[AnyArray, " observations"], count: Float[AnyArray, ""], most: int
) -> Float[AnyArray, " lags"]:
    """Autocovariances at lags from 0 to `most`, all divided by the same `count`, so that their
    spectrum is nowhere negative.
    """
    xp, length = namespace(scores), scores.shape[0]
    power = xp.abs(xp.fft.rfft(scores, 2 * length)) ** 2
    return xp.fft.irfft(power, 2 * length)[: most + 1] / count


def levinson(
    covariances: Float[AnyArray, " lags"],
) -> tuple[Float[AnyArray, "orders weights"], Float[AnyArray, " orders"]]:
    """Weights and residual variances of the autoregressions of orders 0, 1, 2, ..., by Levinson's
    recursion.

    Source: J. Durbin (1960), "The fitting of time-series models", Review of the International
    Statistical Institute 28, 233.
    """
    xp, most = namespace(covariances), covariances.shape[0] - 1
    places = np.arange(most)

    def longer(shorter: Order, k: Int[AnyArray, ""]) -> tuple[Order, Order]:
        weights, variance = shorter
        explained = weights @ covariances[xp.maximum(k - 1 - places, 0)]
        reflection = (covariances[k] - explained) / xp.where(variance > 0, variance, 1.0)
        mirrored = xp.where(places < k - 1, weights[xp.maximum(k - 2 - places, 0)], 0)
        weights = xp.where(places == k - 1, reflection, weights - reflection * mirrored)
        order = weights, variance * (1 - reflection**2)
        return order, order

    nothing = xp.zeros(most, covariances.dtype)
    if most == 0:
        return nothing[None], covariances
    first = nothing, covariances[0]
    if xp is np:
        each = itertools.accumulate(
            np.arange(1, most + 1), lambda shorter, k: longer(shorter, k)[0], initial=first
        )
        weights, variances = zip(*each, strict=True)
        return np.stack(weights), np.stack(variances)
    _, (weights, variances) = jax.lax.scan(longer, first, jnp.arange(1, most + 1))
    return (
        jnp.concatenate([nothing[None], weights]),
        jnp.concatenate([covariances[:1], variances]),
    )
