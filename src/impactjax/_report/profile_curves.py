"""Profiles of the parameters in a report: in `fit.json`, and as figures."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

from impactjax._compare.comparison import Comparison, Fitted
from impactjax._fit.estimate import Estimate
from impactjax._identify.profile_curve import Profile
from impactjax._identify.profiles import obstacle, profiles
from impactjax._problem.problem import Problem
from impactjax._report.json_number import json_number
from impactjax._report.picture import Picture, picture
from impactjax._report.profile_figures import plot_profile

_POINTS = 21
_HEIGHT = 2.6  # of a figure [inches]

NO_CURVES = "No profiles: the fit allows for scatter of restitution from impact to impact."

Curves: TypeAlias = Mapping[str, Profile]


def curves_of(estimate: Estimate[Problem]) -> Curves:
    """Profiles of all parameters of an estimate by name; none if it has no profile."""
    return {} if obstacle(estimate) else profiles(estimate, points=_POINTS)


def best_curves(comparisons: Sequence[Comparison]) -> dict[str, Curves]:
    """Profiles of the best fit of each recording, by its name."""
    return {each.name: curves_of(each.best.estimate) for each in comparisons}


def curves_document(curves: Curves) -> dict[str, Any]:
    """Profiles as they stand in `fit.json`."""
    return {
        name: {
            "shape": str(each.shape),
            "interval95": [json_number(each.low), json_number(each.high)],
            "unit": each.unit,
            "threshold": json_number(each.threshold),
            "at": [json_number(value) for value in each.at],
            "rise": [json_number(value) for value in each.rise],
        }
        for name, each in curves.items()
    }


def curve_pictures(name: str, fitted: Fitted, curves: Curves) -> list[Picture]:
    """A figure of each profile of a fit to a recording."""
    return [
        picture(
            partial(plot_profile, found=each),
            f"Profile of a parameter of {fitted.name} for {name}: {each}",
            _HEIGHT,
        )
        for each in curves.values()
    ]
