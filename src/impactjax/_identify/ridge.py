"""The verb `ridge`: the profile likelihood of two parameters."""

import dataclasses
import math

import numpy as np
from jaxtyping import Bool, Float

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.refits import Refits, refits_of
from impactjax._fit.search import usual_search
from impactjax._fit.walks import local
from impactjax._identify.begun import begun_curves, held_parameters
from impactjax._identify.curves import traced
from impactjax._identify.pair_inflation import PairInflation, pair_inflation
from impactjax._identify.profiles import check_names, check_profiled
from impactjax._identify.rows import Rows, rows_of
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._refusal import check_kind

_ALPHA = 0.05


@dataclasses.dataclass(frozen=True)
class Ridge:
    """Profile likelihood of two parameters, along the valley of the sum of squares S and across it.

    - `names`, `units`: of the two parameters.
    - `best`: their estimates.
    - `first`: values of the first parameter, one a row, in rising order, shape (rows,).
    - `valley`: the second parameter where S is lowest in each row, shape (rows,).
    - `second`: values of the second parameter, shape (rows, points). They follow the valley.
    - `rise`: (S − S_min)/(σ² i²), with all other parameters fitted again, the variance σ² of a
      residual and the inflation i by correlated residuals along the direction from the estimate;
      NaN where the fit failed.
    - `freedom`: degrees of freedom of σ².
    - `parameters`, `values`: all fitted parameters, shape (rows, points, parameters).
    - `rows`: the points as they are continued.

    Source: R. E. Chandler and S. Bate (2007), Biometrika 94, 167, for i.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    best: tuple[float, float]
    first: Float[np.ndarray, " rows"]
    valley: Float[np.ndarray, " rows"]
    second: Float[np.ndarray, "rows points"]
    rise: Float[np.ndarray, "rows points"]
    freedom: float
    parameters: tuple[str, ...]
    values: Float[np.ndarray, "rows points parameters"]
    rows: Rows = dataclasses.field(repr=False)

    def threshold(self, confidence: float = 0.95) -> float:
        """The rise that bounds a region of both parameters: 2 F, with the quantile F of Fisher's
        distribution for two parameters. Raises `ValueError` unless 0 < confidence < 1.
        """
        if not 0 < confidence < 1:
            raise ValueError(f"A confidence is between 0 and 1, but it is {confidence}.")
        return _threshold(self.freedom, 1 - confidence)

    def inside(self, confidence: float = 0.95) -> Bool[np.ndarray, "rows points"]:
        """True for the points in a region of both parameters."""
        return self.rise <= self.threshold(confidence)


def _check_known(estimate: Estimate[P], names: tuple[str, str], known: Ridge) -> None:
    """Raises `ValueError` for a ridge of other parameters, or of another estimate."""
    if known.names != names:
        raise ValueError(f"The known ridge is one of {' and '.join(known.names)}.")
    values = [float(estimate[name].value) for name in names]
    if not np.allclose(known.best, values, rtol=1e-12):
        raise ValueError("The known ridge is one of another estimate.")


def ridge(
    estimate: Estimate[P],
    first: str,
    second: str,
    *,
    points: tuple[int, int] = (100, 100),
    known: Ridge | None = None,
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> Ridge:
    """Profile likelihood of two parameters, with the region that holds both with 95 %.

    The profile of the first parameter is the valley of the sum of squares. In each row the first
    parameter is held, and the second one is held at values on both sides of the valley, while all
    others are fitted again. So the points follow a narrow curved valley, and cover the 95 % region
    where it is bounded; across an open side they go four standard errors. Starts and fits are those
    of `profiles`. Rows whose fit fails are left out.

    **Arguments:**

    - `estimate`: estimate of a single fit, without scatter from impact to impact.
    - `first`, `second`: names of two fitted parameters.
    - `points`: number of rows, and of points in each.
    - `known`: ridge of the same estimate and parameters with fewer points, which are kept.
    - `optimiser`: settings of the refits.

    **Raises** `ValueError` as `profiles` does.
    """
    if not isinstance(points, tuple) or len(points) != 2:
        raise TypeError(f"Argument `points` must be a pair, such as (100, 100), not {points!r}.")
    for each in points:
        check_profiled(estimate, each, optimiser)
    check_names(estimate, (first, second))
    if known is not None:
        check_kind("known", known, Ridge, "ridge(estimate, 'k', 'c')")
        _check_known(estimate, (first, second), known)
    freedom = float(estimate.freedom)
    refits = refits_of(estimate, optimiser, usual_search(estimate.problem))
    limit = math.sqrt(_threshold(freedom, _ALPHA))
    begin = begun_curves(estimate, refits, [first], limit)[0]
    kept = begin.knots.taken([]) if known is None else known.rows.floor
    valley = held_parameters(estimate, refits, [first])
    floor = traced(valley, [begin.knots], [begin.span], points[0], [kept])[0].finite
    pair = [estimate.names.index(name) for name in (first, second)]
    inflation = pair_inflation(estimate, refits, pair)
    unit = limit**2 * inflation.largest * refits.variance / 2
    old = None if known is None else known.rows
    rows = rows_of(refits, local(estimate), pair, floor, unit, points[1], old)
    return _ridge(estimate, refits, inflation, rows, pair)


def _ridge(
    estimate: Estimate[P], refits: Refits, inflation: PairInflation, rows: Rows, pair: list[int]
) -> Ridge:
    costs = np.stack([each.cost for each in rows.knots])
    places = np.stack([each.u for each in rows.knots])
    rise = refits.rises(costs) / inflation.at(places[..., pair])
    values = refits.values(places)
    order = np.argsort(values[:, 0, pair[0]])
    units = tuple(estimate.units[i] for i in pair)
    best = tuple(float(estimate.values[i]) for i in pair)
    names = tuple(estimate.names[i] for i in pair)
    floor = refits.values(rows.floor.u)[order]
    return Ridge(
        names=(names[0], names[1]),
        units=(units[0], units[1]),
        best=(best[0], best[1]),
        first=floor[:, pair[0]],
        valley=floor[:, pair[1]],
        second=values[order][..., pair[1]],
        rise=rise[order],
        freedom=float(estimate.freedom),
        parameters=estimate.names,
        values=values[order],
        rows=rows,
    )


def _threshold(freedom: float, alpha: float) -> float:
    """Twice the quantile of Fisher's distribution with 2 and so many degrees of freedom."""
    if math.isinf(freedom):
        return -2 * math.log(alpha)
    return freedom * (alpha ** (-2 / freedom) - 1)
