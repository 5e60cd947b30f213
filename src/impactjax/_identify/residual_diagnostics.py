"""Tests of residuals for independence and normality."""

import equinox as eqx
import numpy as np
from jax.scipy import special as traced
from jaxtyping import Bool, Float, Int
from scipy import special

from impactjax._fit.estimate import Estimate
from impactjax._known import AnyArray, known, namespace
from impactjax._problem.noise import autocovariances
from impactjax._problem.problem import Problem
from impactjax._refusal import check_kind

UNLIKELY = 1e-3  # significance level of each test
_LAGS = 40  # most lags of the autocorrelation; at most a quarter of the number of samples
_WINDOW = 0.25  # share of the time until the next impact that counts as just after an impact
_LEAST = 1e-3  # least effective number of residuals, to avoid a division by zero
_FARTHEST = float(special.ndtri(1 - UNLIKELY / 2))  # standard deviations of a normal number
_LIMITS = special.chdtri(np.arange(1, _LAGS + 1), UNLIKELY)  # of χ² by degrees of freedom

Residuals = Float[AnyArray, " observations"]
Valid = Bool[AnyArray, " observations"]
Number = Float[AnyArray, ""]


class ResidualDiagnostics(eqx.Module):
    """Comparison of a fit's residuals with independent normal noise of constant variance.

    All limits are at the significance level 0.001.

    - `autocorrelation`: autocorrelations at lags 1, 2, ... [1].
    - `band`: half-width of the band with 95 % of the autocorrelations of independent residuals [1].
    - `portmanteau`: the statistic of Ljung and Box, n (n + 2) Σ ρₖ²/(n − k) [1].
    - `portmanteau_limit`: its limit for independent residuals.
    - `correlated`: p-value of the test of Ljung and Box.
    - `runs`, `runs_expected`: number of runs of one sign; fewer than expected if residuals are
      positively correlated.
    - `runs_deviation`: their difference in standard deviations (Wald and Wolfowitz).
    - `runs_limits`: limits of the number of runs of independent residuals.
    - `skewness`, `excess_kurtosis`: zero for normal residuals [1].
    - `abnormal`: p-value of the test of Jarque and Bera for normality.
    - `skewed_chance`, `tailed_chance`: p-values with skewness or kurtosis alone.
    - `after_impacts`: rms in the first quarter of the time after each impact, divided by that of
      all residuals; zero if there is no sample [1].
    - `after_impacts_chance`: p-value of that ratio, for residuals with the autocorrelation and
      kurtosis of the record.
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
        """True if the test of Ljung and Box does not reject independence, at the level 0.001."""
        return self.portmanteau <= self.portmanteau_limit

    @property
    def as_many_runs(self) -> Bool[AnyArray, ""]:
        """True if the runs test does not reject independence, at the level 0.001."""
        low, high = self.runs_limits
        runs = self.runs.astype(low.dtype)
        return (low <= runs) & (runs <= high)

    @property
    def independent(self) -> Bool[AnyArray, ""]:
        """True if neither test rejects independence, at the level 0.001 each."""
        return self.uncorrelated & self.as_many_runs

    @property
    def normal(self) -> Bool[AnyArray, ""]:
        """True if the test of Jarque and Bera does not reject normality, at the level 0.001."""
        return self.abnormal >= UNLIKELY

    @property
    def skewed(self) -> Bool[AnyArray, ""]:
        """True if the skewness alone rejects normality."""
        return self.skewed_chance < UNLIKELY

    @property
    def tailed(self) -> Bool[AnyArray, ""]:
        """True if the kurtosis alone rejects normality."""
        return self.tailed_chance < UNLIKELY

    @property
    def larger_after_impacts(self) -> Bool[AnyArray, " impacts"]:
        """True for each impact after which the residuals are significantly larger than elsewhere,
        at the level 0.001 divided by the number of impacts.
        """
        chance = self.after_impacts_chance
        count = namespace(chance).maximum((self.after_impacts > 0).sum(), 1)
        return chance < UNLIKELY / count.astype(chance.dtype)


@np.errstate(all="ignore")  # no warnings, as in JAX
def residual_diagnostics(estimate: Estimate[Problem]) -> ResidualDiagnostics:
    """Tests of the residuals of a single fit. Works under `jit` and `vmap`.

    Source: Ljung & Box, Biometrika 65, 297 (1978); Wald & Wolfowitz, Ann. Math. Stat. 11, 147
    (1940); Jarque & Bera, Econ. Lett. 6, 255 (1980).
    """
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
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
    """Number of runs of one sign, its expectation, their difference in standard deviations, and
    the largest difference that is not significant.
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
    """Effective share of independent residuals in a mean of squares:
    1/((1 + 2 Σ ρₖ²)(1 + κ/2)) with the excess kurtosis κ.

    Source: the variance of a sum of correlated squares, Bartlett, J. R. Stat. Soc. Suppl. 8, 27
    (1946).
    """
    return 1 / ((1 + 2 * (rho**2).sum()) * (1 + kurtosis.clip(0.0) / 2))


def _after_impacts(
    estimate: Estimate[Problem], left: Residuals, valid: Valid
) -> tuple[Float[AnyArray, " impacts"], Float[AnyArray, " impacts"]]:
    """Rms of the residuals just after each impact, divided by that of all, and the number of
    samples there.
    """
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
