"""Whether what a fit leaves unexplained looks like independent normal noise."""

import equinox as eqx
import numpy as np
from jax.scipy import special as traced
from jaxtyping import Bool, Float, Int
from scipy import special

from impactjax._fit.estimate import Estimate
from impactjax._known import AnyArray, known, namespace
from impactjax._problem.noise import autocovariances

UNLIKELY = 1e-3  # the probability below which residuals are said not to be what they should be
_LAGS = 40  # of the autocorrelation, at most; a quarter of the number of samples at most
_WINDOW = 0.25  # of the time until the next impact
_LEAST = 1e-3  # of a number of residuals, so that none can be reckoned with
_FARTHEST = float(special.ndtri(1 - UNLIKELY / 2))  # standard deviations of a normal number
_LIMITS = special.chdtri(np.arange(1, _LAGS + 1), UNLIKELY)  # of χ² by degrees of freedom

Residuals = Float[AnyArray, " observations"]
Valid = Bool[AnyArray, " observations"]
Number = Float[AnyArray, ""]


class ResidualDiagnostics(eqx.Module):
    """What the residuals of a fit look like beside independent normal noise of one size.

    - `autocorrelation`: at lags 1, 2, ... [1].
    - `band`: within which 95 % of the autocorrelations of independent residuals lie [1].
    - `portmanteau`: Ljung and Box's sum of squares of the autocorrelations [1].
    - `portmanteau_limit`: what that of independent residuals exceeds once in a thousand times.
    - `correlated`: probability that independent residuals are as correlated (Ljung and Box).
    - `runs`, `runs_expected`: of one sign; fewer than expected where residuals hang together.
    - `runs_deviation`: their difference in standard deviations (Wald and Wolfowitz).
    - `runs_limits`: from where to where independent residuals lie but once in a thousand times.
    - `skewness`, `excess_kurtosis`: zero for normal residuals [1].
    - `abnormal`: probability that normal residuals have such a skewness and kurtosis (Jarque and
      Bera).
    - `skewed_chance`, `tailed_chance`: with each of the two alone.
    - `after_impacts`: rms in the first quarter of the time after each impact, over that of all
      residuals; zero where there is no sample [1].
    - `after_impacts_chance`: probability that residuals like all the others, as correlated and with
      as long tails, are as large there.
    """

    autocorrelation: Float[AnyArray, " lags"]
    band: Number
    portmanteau: Number
    portmanteau_limit: Number
    correlated: Number
    runs: Int[AnyArray, ""]
    runs_expected: Number
    runs_deviation: Number
    runs_limits: Float[AnyArray, " 2"]
    skewness: Number
    excess_kurtosis: Number
    abnormal: Number
    skewed_chance: Number
    tailed_chance: Number
    after_impacts: Float[AnyArray, " impacts"]
    after_impacts_chance: Float[AnyArray, " impacts"]

    @property
    def uncorrelated(self) -> Bool[AnyArray, ""]:
        """Whether the autocorrelations are those of independent residuals, but once in a thousand
        times.
        """
        return self.portmanteau <= self.portmanteau_limit

    @property
    def as_many_runs(self) -> Bool[AnyArray, ""]:
        """Whether there are as many runs of one sign as of independent residuals, but once in a
        thousand times.
        """
        low, high = self.runs_limits
        runs = self.runs.astype(low.dtype)
        return (low <= runs) & (runs <= high)

    @property
    def independent(self) -> Bool[AnyArray, ""]:
        """Whether neither test speaks against independence, at one in a thousand each."""
        return self.uncorrelated & self.as_many_runs

    @property
    def normal(self) -> Bool[AnyArray, ""]:
        """Whether skewness and kurtosis are those of normal residuals, but once in a thousand
        times.
        """
        return self.abnormal >= UNLIKELY

    @property
    def skewed(self) -> Bool[AnyArray, ""]:
        """Whether the skewness alone says that the residuals are not normal."""
        return self.skewed_chance < UNLIKELY

    @property
    def tailed(self) -> Bool[AnyArray, ""]:
        """Whether the kurtosis alone says that the residuals are not normal."""
        return self.tailed_chance < UNLIKELY

    @property
    def larger_after_impacts(self) -> Bool[AnyArray, " impacts"]:
        """After which impacts the residuals are larger than elsewhere, but once in a thousand
        records.
        """
        chance = self.after_impacts_chance
        count = namespace(chance).maximum((self.after_impacts > 0).sum(), 1)
        return chance < UNLIKELY / count.astype(chance.dtype)


@np.errstate(all="ignore")  # as JAX computes, without a warning
def residual_diagnostics(estimate: Estimate) -> ResidualDiagnostics:
    """What the residuals of a single fit look like. Works under `jit` and `vmap`.

    Source: Ljung & Box, Biometrika 65, 297 (1978); Wald & Wolfowitz, Ann. Math. Stat. 11, 147
    (1940); Jarque & Bera, Econ. Lett. 6, 255 (1980).
    """
    estimate = known(estimate)
    xp, valid = namespace(estimate), estimate.problem.recording.valid
    n = xp.sum(valid).astype(estimate.residuals.dtype)
    left = xp.where(valid, -estimate.residuals, 0.0)
    centred = xp.where(valid, left - xp.sum(left) / n, 0.0)
    covariances = autocovariances(centred, n, min(_LAGS, centred.shape[0] // 4))
    rho = covariances[1:] / xp.where(covariances[0] > 0, covariances[0], 1.0)
    lags = xp.arange(1, rho.shape[0] + 1, dtype=left.dtype)
    few = lags <= xp.maximum(n // 4, 1)  # of the residuals that count
    rho = xp.where(few, rho, 0.0)
    portmanteau = n * (n + 2) * xp.sum(xp.where(few, rho**2 / xp.maximum(n - lags, 1), 0.0))
    freedom = xp.maximum(xp.sum(few), 1)
    runs, expected, deviation, allowed = _runs(left, valid)
    size = xp.sqrt(xp.sum(centred**2) / n)
    unit = centred / xp.where(size > 0, size, 1.0)
    skewness, kurtosis = xp.sum(unit**3) / n, xp.sum(unit**4) / n - 3
    tail = special.gammaincc if xp is np else traced.gammaincc
    after, counts = _after_impacts(estimate, left, valid)
    freely = xp.maximum(counts * _independent_share(rho, kurtosis), _LEAST)
    return ResidualDiagnostics(
        autocorrelation=rho,
        band=1.96 / xp.sqrt(n),
        portmanteau=portmanteau,
        portmanteau_limit=xp.asarray(_LIMITS, left.dtype)[freedom - 1],
        correlated=tail(freedom.astype(left.dtype) / 2, portmanteau / 2),
        runs=runs,
        runs_expected=expected,
        runs_deviation=deviation,
        runs_limits=xp.stack([expected - allowed, expected + allowed]),
        skewness=skewness,
        excess_kurtosis=kurtosis,
        abnormal=xp.exp(-n / 12 * (skewness**2 + kurtosis**2 / 4)),
        skewed_chance=xp.exp(-n / 12 * skewness**2),
        tailed_chance=xp.exp(-n / 48 * kurtosis**2),
        after_impacts=after,
        after_impacts_chance=tail(freely / 2, freely * after**2 / 2),
    )


def _runs(left: Residuals, valid: Valid) -> tuple[Int[AnyArray, ""], Number, Number, Number]:
    """Runs of one sign, how many are expected, the difference in standard deviations, and how large
    it may be.
    """
    xp = namespace(left)
    first = xp.argsort(~valid, stable=True)
    above, counts = (left > 0)[first], valid[first]
    n, ups = (xp.sum(each).astype(left.dtype) for each in (valid, above))
    runs = 1 + xp.sum((above[1:] != above[:-1]) & counts[1:], dtype=xp.int32)
    expected = 1 + 2 * ups * (n - ups) / n
    variance = (expected - 1) * (expected - 2) / (n - 1)
    spread = xp.sqrt(xp.maximum(variance, 1e-9))
    deviation = (runs.astype(left.dtype) - expected) / spread
    return runs, expected, deviation, _FARTHEST * spread


def _independent_share(rho: Float[AnyArray, " lags"], kurtosis: Number) -> Number:
    """How many independent normal squares one of the residuals stands for in a mean of squares.

    Source: the variance of a sum of correlated squares, Bartlett, J. R. Stat. Soc. Suppl. 8, 27
    (1946).
    """
    return 1 / ((1 + 2 * (rho**2).sum()) * (1 + kurtosis.clip(0.0) / 2))


def _after_impacts(
    estimate: Estimate, left: Residuals, valid: Valid
) -> tuple[Float[AnyArray, " impacts"], Float[AnyArray, " impacts"]]:
    """Residuals just after each impact over those of all, and of how many samples."""
    xp = namespace(left)
    recording, log = estimate.problem.recording, estimate.impacts
    rms = xp.where(estimate.rms > 0, estimate.rms, 1.0)
    if recording.observes_impacts:
        return xp.abs(left) / rms, valid.astype(left.dtype)
    ts = recording.instants
    begins = xp.where(log.happened, log.time, xp.inf)
    ends = xp.minimum(xp.append(begins[1:], xp.inf), ts[-1])
    number = xp.searchsorted(begins, ts, side="right") - 1
    hit = xp.maximum(number, 0)
    window = begins[hit] + _WINDOW * (ends[hit] - begins[hit])
    near = valid & (number >= 0) & (ts < window)
    own = (near & (hit == xp.arange(len(begins), dtype=hit.dtype)[:, None])).astype(left.dtype)
    squares, counts = own @ left**2, own.sum(axis=1)
    return xp.sqrt(squares / xp.maximum(counts, 1)) / rms, counts
