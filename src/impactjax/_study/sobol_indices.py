"""Sobol indices of a study over Saltelli's design."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._refusal import check_kind
from impactjax._study.extra import needed
from impactjax._study.saltelli import BLOCK, MEMBER, unit_cube
from impactjax._study.study_result import Study
from impactjax._study.whole import as_seed

PerParameter = Float[np.ndarray, "... parameters"]
PerPair = Float[np.ndarray, "... parameters others"]


class SobolIndices(NamedTuple):
    """Sobol indices: shares of the variance of a result over the ranges of the parameters.

    - `names`: names of the parameters.
    - `first`: first-order indices, the share that each parameter causes alone [1].
    - `total`: total indices, the share that would remain if all others were known [1].
    - `second`: second-order indices of pairs, the share that a pair causes beyond both alone, with
      NaN on the diagonal; `None` if the design is not for them [1].
    - `first_error`, `total_error`, `second_error`: half-widths of 95 % intervals, by bootstrap
      over the blocks [1]. They are rather too wide, since the points are more even than random.
    - `used`: number of blocks that were used.
    - `left_out`: number of blocks that were left out because a lane of them failed.
    - `failed`: number of lanes that failed.

    Results that are arrays have their own axes first.
    """

    names: tuple[str, ...]
    first: PerParameter
    first_error: PerParameter
    total: PerParameter
    total_error: PerParameter
    second: PerPair | None
    second_error: PerPair | None
    used: int
    left_out: int
    failed: int


def sobol_indices(study: Study, result: str, *, seed: int = 0) -> SobolIndices:
    """Sobol indices of a result by the parameters of a study over a `Saltelli` design.

    The whole block of a lane that has failed, or whose result is not finite, is left out: so the
    other blocks remain a sample of independent pairs of points. If lanes fail at random, the
    indices are estimated without bias; if they fail in some region of the parameters, the indices
    are about the rest.

    **Arguments:**

    - `study`: the study.
    - `result`: name of the result.
    - `seed`: random seed of the bootstrap.

    **Raises** `ValueError` for a study over another design, an unknown result, one that is not
    real, and fewer than two blocks without a failure, and `ImportError` without SALib.

    Source: first-order and total indices by A. Saltelli et al. (2010), Computer Physics
    Communications 181, 259; pairs by A. Saltelli (2002), Computer Physics Communications 145, 280;
    computed by SALib.
    """
    check_kind("study", study, Study, 'study(function, Saltelli(...), "folder")')
    if [*study.dimensions] != [BLOCK, MEMBER]:
        raise ValueError("Sobol indices need a study over the design `Saltelli`.")
    if result not in study.results:
        have = ", ".join(study.results)
        raise ValueError(f"There is no result `{result}`; there are {have}.")
    values = study.results[result]
    if values.dtype.kind not in "iuf":
        raise ValueError(f"Result `{result}` must be real numbers, but it is {values.dtype}.")
    own = tuple(range(2, values.ndim))
    failed = study.failed | ~np.isfinite(values).all(axis=own)
    whole = ~failed.any(axis=1)
    if whole.sum() < 2:
        raise ValueError(
            f"Only {whole.sum()} of {whole.size} blocks have no lane that failed; at least 2 are "
            "needed."
        )
    found = _analysed(tuple(study.points), values[whole].astype(float), as_seed(seed))
    return SobolIndices(
        tuple(study.points),
        *found,
        used=int(whole.sum()),
        left_out=int((~whole).sum()),
        failed=int(failed.sum()),
    )


def _analysed(
    names: tuple[str, ...], values: Float[np.ndarray, "blocks members *own"], seed: int
) -> list[Any]:
    """Indices and their errors by SALib, for each number of a result; NaN for one that is constant.

    They are first, first_error, total, total_error, second, second_error.
    """
    analyze = needed("SALib.analyze.sobol").analyze
    members, own = values.shape[1], values.shape[2:]
    pairs = members != len(names) + 2
    keys = ["S1", "S1_conf", "ST", "ST_conf", *(["S2", "S2_conf"] if pairs else [])]
    found = {key: [] for key in keys}
    for column in values.reshape(-1, int(np.prod(own))).T:
        indices = {}
        if np.ptp(column) > 0:
            column = column / np.ptp(column)  # squares of very small or large numbers vanish
            indices = analyze(  # takes a seed of 0 for none
                unit_cube(names), column, calc_second_order=pairs, seed=seed + 1
            )
        for key in keys:
            shape = (len(names),) * (2 if key.startswith("S2") else 1)
            found[key].append(indices.get(key, np.full(shape, np.nan)))
    each = [np.reshape(found[key], (*own, *np.shape(found[key])[1:])) for key in keys]
    each[4:] = [_symmetric(x) for x in each[4:]]
    return each if pairs else [*each, None, None]


def _symmetric(pairs: PerPair) -> PerPair:
    """Values of pairs, given above the diagonal."""
    return np.where(np.isnan(pairs), np.swapaxes(pairs, -1, -2), pairs)
