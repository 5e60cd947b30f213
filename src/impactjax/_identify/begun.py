"""Beginnings of curves along parameters: walks from the estimate to the ends of its intervals."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.profile_walk import Walk
from impactjax._fit.refits import Points, Refits, Rows, joined
from impactjax._fit.walks import Local, Tried, begun, local, walked
from impactjax._identify.curves import HeldParameters, Knots, Span, knots_along, merged
from impactjax._identify.profile_axis import Axis, axis_of, reach


class Begun(NamedTuple):
    """The beginning of a curve along a parameter.

    - `knots`: the estimate, and the refits of the walks.
    - `known`: for each end of the span, true if the profile is open there unless it crosses.
    """

    axis: Axis
    knots: Knots
    span: Span
    known: tuple[bool, bool]


def held_parameters(estimate: Estimate[P], refits: Refits, names: Sequence[str]) -> HeldParameters:
    """Curves along some parameters of an estimate."""
    places, around = [estimate.names.index(name) for name in names], local(estimate)
    active = np.arange(len(estimate.names)) != np.array(places)[:, None]
    return HeldParameters(refits, places, [axis_of(around, j) for j in places], active)


def begun_curves(
    estimate: Estimate[P], refits: Refits, names: Sequence[str], limit: float
) -> list[Begun]:
    """Beginnings of curves to a rise of `limit`², in units without correlation, and beyond."""
    around, places = local(estimate), [estimate.names.index(name) for name in names]
    walks = [begun(estimate, around, j, side, limit) for j in places for side in (-1, 1)]
    tried = walked(estimate, refits, around, walks)
    u = np.asarray(refits.problem.coordinates(np.asarray(estimate.values)))[None]
    centre = refits.points(u, np.ones(u.shape, bool))
    pairs = zip(places, walks[::2], walks[1::2], strict=True)
    return [_begun(refits, around, tried, centre, *each) for each in pairs]


def _begun(
    refits: Refits,
    around: Local,
    tried: Sequence[Tried],
    centre: Points,
    parameter: int,
    below: Walk,
    above: Walk,
) -> Begun:
    axis, own = axis_of(around, parameter), [x for x in tried if x.parameter == parameter]
    x = np.array([0.0, *(axis.distance(each.value) for each in own)])
    points = joined([centre, *(each.points for each in own)])
    held = np.arange(points.u.shape[1]) == parameter
    points = points._replace(moving=points.moving & ~held)
    knots = merged(knots_along(x, points, np.where(held, axis.rate(x)[:, None], 0.0)).finite)
    unit = below.limit**2 * refits.variance / 2
    low, high = (reach(walk) for walk in (below, above))
    known = (not below.failed, not above.failed)
    return Begun(axis, knots, Span(low, high, refits.lowest, unit), known)


def values_along(refits: Refits, knots: Knots) -> Rows:
    """Natural values of all parameters at some points; NaN where the fit failed."""
    return np.where(np.isfinite(knots.cost)[:, None], refits.values(knots.u), np.nan)
