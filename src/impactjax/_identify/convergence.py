"""Convergence of chains in words."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray

_APART = 1.01  # R-hat above which chains have not mixed
_FEW = 400  # effective sample size below which R-hat and quantiles are uncertain


def diagnosis(tree: "xarray.DataTree", doubtful: bool) -> str:
    """Convergence of the chains of a posterior in words.

    - `doubtful`: as of the estimate.

    Source: A. Vehtari et al. (2021), "Rank-normalization, folding, and localization: an improved
    R-hat", Bayesian Analysis 16, 667, for R-hat and for the limits.
    """
    from arviz_stats.base.array import array_stats

    draws = {str(name): x.values for name, x in tree["posterior"].dataset.items()}
    with np.errstate(all="ignore"):  # chains that stand still
        apart = {name: float(np.asarray(array_stats.rhat(x))) for name, x in draws.items()}
        sizes = {name: float(np.asarray(array_stats.ess(x))) for name, x in draws.items()}
    lost = np.asarray(tree["sample_stats"].dataset["diverging"])
    diverging, count = int(np.sum(lost)), lost.size
    worst = max(apart, key=lambda name: np.nan_to_num(apart[name], nan=np.inf))
    least = min(sizes, key=lambda name: np.nan_to_num(sizes[name], nan=0.0))
    said = [
        f"R-hat at most {apart[worst]:.3f}, effective sample size at least {sizes[least]:.0f} of "
        f"{count} draws, {diverging or 'no'} divergence{'' if diverging in (0, 1) else 's'}."
    ]
    if not apart[worst] <= _APART:
        said.append(
            f"Warning: the chains of {worst} have not mixed (R-hat above {_APART}): draw more, or "
            "narrow `bounds`."
        )
    if not sizes[least] >= _FEW:
        said.append(f"Warning: the draws of {least} are too few for its quantiles: draw more.")
    if diverging:
        said.append(
            "Warning: after divergences the draws may miss a part of the posterior: compare with "
            "the profile."
        )
    if doubtful:
        said.append(
            "Warning: the residuals are autocorrelated over longer times than in the noise model, "
            "or larger than the noise, so that the posterior is too narrow."
        )
    return " ".join(said)
