"""Curves along which a function of the parameters is held.

Each fit minimises S with a tight virtual measurement of the quantity beside the recording; its
minimum lies on the curve, and one step with Lagrange's multiplier puts it at the held value.

Source: C. Kreutz, A. Raue and J. Timmer (2012), "Likelihood based observability analysis and
confidence intervals for predictions of dynamic models", BMC Systems Biology 6, 120.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._fit.evaluation import Evaluated, Parts, evaluate, side_by_side
from impactjax._fit.refits import Column, Costs, Points, Refits, Rows, joined
from impactjax._fit.search import Search
from impactjax._identify.curves import AbstractCurves, Knots, Which
from impactjax._known import known
from impactjax._optimise.linearisation import Linearisation, Vector
from impactjax._problem.abstract_problem import AbstractProblem
from impactjax._problem.single_problem import AbstractSingleProblem
from impactjax._refusal import returned_number
from impactjax._types import Flag, Scalar

_TIGHT = 0.02  # standard deviation of the virtual measurement, in standard errors of the quantity

Quantity = Callable[[Any], Scalar]  # of the fitted system
Told = tuple[Column, Rows]


@dataclasses.dataclass(frozen=True)
class HeldQuantity(AbstractCurves):
    """The curve along which a quantity is held.

    - `refits`: the refits.
    - `quantity`: the function of a system.
    - `centre`, `unit`: its estimate and standard error, from which distances are counted.
    """

    refits: Refits
    quantity: Quantity
    centre: float
    unit: float

    def refitted(self, which: Which, x: Column, starts: Rows) -> Knots:
        del which
        low, high, _ = self.refits.limits.T
        targets = self.centre + self.unit * x
        both = np.concatenate([np.clip(starts, low, high), targets[:, None]], axis=1)
        minima = side_by_side(lambda each: self._minimum(each[None, :-1], each[-1]), both)
        points = joined(minima)
        values, slopes = told(self.refits, self.quantity, points.u)
        away = points.solved(slopes)  # H⁻¹ a
        strength = (slopes * away).sum(axis=1)
        known = np.isfinite(points.cost) & np.isfinite(values) & (strength > 0)
        strength = np.where(known, strength, 1.0)
        tangent = away * self.unit / strength[:, None]
        down = points.solved(points.gradient)
        lacking = targets - np.where(known, values, 0.0)
        factor = (lacking + (slopes * down).sum(axis=1)) / strength
        there = points.stepped(factor[:, None] * away - down)
        cost = np.where(known, there.cost, np.inf)
        slope = factor * self.unit
        return Knots(x, np.clip(there.u, low, high), cost, tangent, slope, self.unit**2 / strength)

    def enough(self, costs: Costs) -> Costs:
        return self.refits.enough(costs)

    def _minimum(self, start: Rows, target: np.floating) -> Points:
        """The minimum with the virtual measurement, without it in the cost."""
        weight = np.sqrt(self.refits.variance) / (_TIGHT * self.unit)
        measured = functools.partial(_measured, self.refits, self.quantity, target, weight)
        everything = np.ones(start.shape, bool)
        found = self.refits.with_search(Search(measured)).searched(start, everything)
        return self.refits.points(found.u, everything)


def told(refits: Refits, quantity: Quantity, places: Rows) -> Told:
    """A quantity at some places, and its derivatives by the coordinates of a search; NaN where it
    is not finite.
    """
    found = known(side_by_side(lambda u: _value(refits.problem, quantity, jnp.asarray(u)), places))
    values, slopes = (np.stack(each) for each in zip(*found, strict=True))
    right = np.isfinite(values) & np.isfinite(slopes).all(axis=1)
    return np.where(right, values, np.nan), np.where(right[:, None], slopes, 0.0)


@eqx.filter_jit
def _value(problem: AbstractProblem, quantity: Quantity, u: Vector) -> tuple[Scalar, Vector]:
    def value(u: Vector) -> tuple[Float[Array, ""], Float[Array, ""]]:
        assert isinstance(problem, AbstractSingleProblem)
        given = quantity(problem.system_with(problem.at(u)))
        found = returned_number("quantity", given).astype(u.dtype)
        return found, found

    slopes, found = jax.jacfwd(value, has_aux=True)(u)
    return found, slopes


def _measured(
    refits: Refits,
    quantity: Quantity,
    target: np.floating,
    weight: float,
    problem: AbstractProblem,
    u: Vector,
    parts: Parts,
    logged: Flag,
) -> Evaluated:
    """The evaluation of a point with one more row of residuals: weight × (quantity − target)."""
    found = known(evaluate(problem, u, parts, logged))
    values, slopes = told(refits, quantity, np.asarray(u)[None])
    row, residual = weight * slopes[0], weight * (values[0] - target)
    each = [
        _with_row(jax.tree.map(lambda x, part=part: x[part], found.models), row, residual)
        for part in range(len(parts))
    ]
    return found._replace(models=jax.tree.map(lambda *x: np.stack(x), *each))


def _with_row(model: Linearisation, row: Vector, residual: float) -> Linearisation:
    """The linear model with one more row, by QR of [R; row]."""
    if not np.isfinite(model.cost) or not np.isfinite(residual):
        return model._replace(cost=np.array(np.inf))
    orthogonal, factor = np.linalg.qr(np.vstack([model.factor, row]))
    rest = orthogonal.T @ np.append(model.rest, residual)
    return Linearisation(model.cost + residual**2 / 2, rest, factor)
