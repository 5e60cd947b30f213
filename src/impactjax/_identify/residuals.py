"""Whether what a fit leaves unexplained looks like independent normal noise."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy import special
from jaxtyping import Array, Bool, Float, Int

from impactjax._fit.estimate import Estimate
from impactjax._fit.noise import autocovariances
from impactjax._measure.recording import ImpactTimes
from impactjax._types import Flag, Scalar

_LAGS = 40  # of the autocorrelation, at most; a quarter of the number of samples at most
_WINDOW = 0.25  # of the time until the next impact

Residuals = Float[Array, " observations"]
Valid = Bool[Array, " observations"]


class Residuality(eqx.Module):
    """What the residuals of a fit look like beside independent normal noise of one size.

    - `autocorrelation`: at lags 1, 2, ... [1].
    - `band`: within which 95 % of the autocorrelations of independent residuals lie [1].
    - `correlated`: probability that independent residuals are as correlated (Ljung and Box).
    - `runs`, `runs_expected`: of one sign; fewer than expected where residuals hang together.
    - `runs_deviation`: their difference in standard deviations (Wald and Wolfowitz).
    - `skewness`, `excess_kurtosis`: zero for normal residuals [1].
    - `abnormal`: probability that normal residuals have such a skewness and kurtosis (Jarque and
      Bera).
    - `after_impacts`: rms in the first quarter of the time after each impact, over that of all
      residuals; zero where there is no sample [1].
    """

    autocorrelation: Float[Array, " lags"]
    band: Scalar
    correlated: Scalar
    runs: Int[Array, ""]
    runs_expected: Scalar
    runs_deviation: Scalar
    skewness: Scalar
    excess_kurtosis: Scalar
    abnormal: Scalar
    after_impacts: Float[Array, " impacts"]

    @property
    def independent(self) -> Flag:
        """Whether neither test speaks against independence, at one in a thousand each."""
        return (self.correlated > 1e-3) & (jnp.abs(self.runs_deviation) < 3.3)


@eqx.filter_jit
def residuality(estimate: Estimate) -> Residuality:
    """What the residuals of a single fit look like. Works under `jit` and `vmap`.

    Source: Ljung & Box, Biometrika 65, 297 (1978); Wald & Wolfowitz, Ann. Math. Stat. 11, 147
    (1940); Jarque & Bera, Econ. Lett. 6, 255 (1980).
    """
    valid = estimate.problem.recording.valid
    n = jnp.sum(valid).astype(estimate.residuals.dtype)
    left = jnp.where(valid, -estimate.residuals, 0.0)
    centred = jnp.where(valid, left - jnp.sum(left) / n, 0.0)
    covariances = autocovariances(centred, n, min(_LAGS, centred.shape[0] // 4))
    rho = covariances[1:] / jnp.where(covariances[0] > 0, covariances[0], 1.0)
    lags = jnp.arange(1, rho.shape[0] + 1, dtype=left.dtype)
    portmanteau = n * (n + 2) * jnp.sum(rho**2 / (n - lags))
    freedom = jnp.asarray(max(rho.shape[0], 1), left.dtype)
    runs, expected, deviation = _runs(left, valid)
    size = jnp.sqrt(jnp.sum(centred**2) / n)
    unit = centred / jnp.where(size > 0, size, 1.0)
    skewness, kurtosis = jnp.sum(unit**3) / n, jnp.sum(unit**4) / n - 3
    return Residuality(
        autocorrelation=rho,
        band=1.96 / jnp.sqrt(n),
        correlated=special.gammaincc(freedom / 2, portmanteau / 2),
        runs=runs,
        runs_expected=expected,
        runs_deviation=deviation,
        skewness=skewness,
        excess_kurtosis=kurtosis,
        abnormal=jnp.exp(-n / 12 * (skewness**2 + kurtosis**2 / 4)),
        after_impacts=_after_impacts(estimate, left, valid),
    )


def _runs(left: Residuals, valid: Valid) -> tuple[Int[Array, ""], Scalar, Scalar]:
    """Runs of one sign, how many are expected, and the difference in standard deviations."""
    first = jnp.argsort(~valid, stable=True)
    above, counts = (left > 0)[first], valid[first]
    n, ups = (jnp.sum(each).astype(left.dtype) for each in (valid, above))
    runs = 1 + jnp.sum((above[1:] != above[:-1]) & counts[1:], dtype=jnp.int32)
    expected = 1 + 2 * ups * (n - ups) / n
    variance = (expected - 1) * (expected - 2) / (n - 1)
    deviation = (runs.astype(left.dtype) - expected) / jnp.sqrt(jnp.maximum(variance, 1e-9))
    return runs, expected, deviation


def _after_impacts(estimate: Estimate, left: Residuals, valid: Valid) -> Float[Array, " impacts"]:
    recording, log = estimate.problem.recording, estimate.impacts
    rms = jnp.where(estimate.rms > 0, estimate.rms, 1.0)
    if isinstance(recording, ImpactTimes):
        return jnp.abs(left) / rms
    ts = recording.ts
    begins = jnp.where(log.happened, log.time, jnp.inf)
    ends = jnp.minimum(jnp.append(begins[1:], jnp.inf), ts[-1])
    number = jnp.searchsorted(begins, ts, side="right") - 1
    hit = jnp.maximum(number, 0)
    window = begins[hit] + _WINDOW * (ends[hit] - begins[hit])
    near = valid & (number >= 0) & (ts < window)
    rows = jnp.where(near, hit, begins.shape[0])
    squares = jax.ops.segment_sum(left**2, rows, begins.shape[0] + 1)[:-1]
    counts = jax.ops.segment_sum(jnp.ones_like(left), rows, begins.shape[0] + 1)[:-1]
    return jnp.sqrt(squares / jnp.maximum(counts, 1)) / rms
