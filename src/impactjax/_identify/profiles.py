"""The verb `profiles`: the profile likelihood of parameters as curves."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.profile import limit_of
from impactjax._fit.refits import Refits, refits_of
from impactjax._fit.search import usual_search
from impactjax._identify.begun import Begun, begun_curves, held_parameters, values_along
from impactjax._identify.curves import Knots, traced
from impactjax._identify.profile_curve import Profile, profile_along
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._refusal import check_kind, whole

_SAME = 1e-3  # relative difference of two costs that counts as none
_FEWEST = 5  # points of a curve


def profiles(
    estimate: Estimate[P],
    *names: str,
    points: int = 41,
    known: Mapping[str, Profile] | None = None,
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> dict[str, Profile]:
    """Profile likelihood of parameters as curves, by name.

    The parameter is held at values around its estimate, and all others are fitted again:
    rise(p) = (min S − S_min)/(σ² i²), with the sum of squares S, the variance σ² of a residual and
    the `inflation` i. The curve goes from one end of the 95 % interval to the other and a quarter
    beyond, or over four standard errors where it is open, and is densest where it is steep. The
    interval is that of `profiled`.

    Each fit starts from the cubic through its neighbours, and ends after one evaluation if a
    Gauss-Newton step promises no more than 0.01 in rise. A point that lies above what its
    neighbours promise is fitted again from there, so that the curve follows the lowest minimum.

    **Arguments:**

    - `estimate`: estimate of a single fit, without scatter from impact to impact.
    - `names`: names of fitted parameters; without any, all of them.
    - `points`: number of points of each curve.
    - `known`: profiles of the same estimate with fewer points, which are kept.
    - `optimiser`: settings of the refits.

    **Raises** `ValueError` for fewer than 5 points, a parameter that was not fitted, an estimate
    that is not `usable`, has scatter from impact to impact, or holds several fits.

    Source: A. Raue et al. (2009), Bioinformatics 25, 1923, for the method; R. Boiger et al. (2016),
    Inverse Problems 32, 125009, for starts along tangents.
    """
    check_profiled(estimate, points, optimiser)
    check_names(estimate, names)
    names = names or estimate.names
    refits = refits_of(estimate, optimiser, usual_search(estimate.problem))
    limit = limit_of(estimate)
    begin, old = begun_curves(estimate, refits, names, limit), known or {}
    _check_known(estimate, old)
    knots, spans = [each.knots for each in begin], [each.span for each in begin]
    kept = [
        old[x].knots if x in old else own.taken([]) for x, own in zip(names, knots, strict=True)
    ]
    found = traced(held_parameters(estimate, refits, names), knots, spans, points, kept)
    return {
        name: _profile(estimate, refits, name, each, own, limit)
        for name, each, own in zip(names, begin, found, strict=True)
    }


def _check_known(estimate: Estimate[P], known: Mapping[str, Profile]) -> None:
    """Raises `ValueError` for profiles that are not those of the estimate under their names."""
    check_kind("known", known, Mapping, 'profiles(estimate, "k")')
    for name, each in known.items():
        check_kind("known", each, Profile, 'profiles(estimate, "k")["k"]')
        if name != each.name or each.name not in estimate.names:
            raise ValueError(f"Argument `known` has the profile of `{each.name}` as `{name}`.")
        if not np.isclose(each.value, float(estimate[name].value), rtol=1e-12):
            raise ValueError(f"The known profile of `{name}` is one of another estimate.")


def _profile(
    estimate: Estimate[P], refits: Refits, name: str, begin: Begun, knots: Knots, limit: float
) -> Profile:
    values = values_along(refits, knots)
    values[:, estimate.names.index(name)] = begin.axis.value(knots.x)
    parameters = (estimate.names, values)
    doubtful = bool(estimate.doubtful)
    rest = (begin.span, limit**2, begin.known, parameters)
    return profile_along(name, begin.axis, knots, *rest, doubtful=doubtful)


def check_profiled(estimate: Estimate[P], points: int, optimiser: LevenbergMarquardt) -> None:
    """Raises `ValueError` for an estimate that has no profile, and for too few points."""
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
    check_kind("optimiser", optimiser, LevenbergMarquardt, "LevenbergMarquardt()")
    whole("points", points, _FEWEST)
    estimate.check_single()
    if found := obstacle(estimate):
        raise ValueError(found)


def obstacle(estimate: Estimate[P]) -> str:
    """Reason why a single estimate has no profile; empty if it has one."""
    if estimate.scatter is not None:
        return (
            "This estimate has scatter from impact to impact, and refits would have none: fit the "
            "experiment with `scatter=NoScatter()`, or use the intervals of the estimate."
        )
    if not bool(estimate.usable):
        return f"The estimate has no profile, since its fit is not usable ({estimate.cause})."
    cost = float(np.sum(estimate.problem.assumed().loss.cost(jnp.asarray(estimate.residuals))))
    if not np.isclose(cost, np.nanmin(estimate.start_costs), rtol=_SAME):
        return (
            "This estimate is a part of a joint one, whose values are not the minimum of this "
            "recording alone: take the joint estimate, or fit the recording alone."
        )
    return ""


def check_names(estimate: Estimate[P], names: tuple[str, ...]) -> None:
    """Raises `ValueError` for a parameter that was not fitted, or is named twice."""
    for name in names:
        estimate.value(name)
    if len(set(names)) < len(names):
        raise ValueError(f"Each parameter can be named once, but the names are {names}.")
