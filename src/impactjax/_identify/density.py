"""Posterior density of a problem's parameters in unbounded coordinates.

It is the likelihood times the prior knowledge of some parameters; all others have a flat prior over
their range, in their own units. The unbounded coordinates u are those of NumPyro: the value itself,
a logarithm, or a logit. The density of u has the factor |dv/du| of the transformation.

A sampler moves in scaled coordinates w, u = c + R w, in which the density is nearly that of
independent standard normal numbers.
"""

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp

from impactjax._fit.estimate import Estimate, P
from impactjax._identify.likelihood import Likelihood, likelihoods
from impactjax._optimise.linearisation import Matrix, Vector
from impactjax._parameter import Range
from impactjax._problem.abstract_problem import AbstractProblem, Answer
from impactjax._record.abstract_recording import Residuals
from impactjax._types import Scalar

if TYPE_CHECKING:
    from numpyro.distributions.transforms import Transform


class Density(eqx.Module):
    """Posterior density of a problem's parameters in scaled coordinates.

    - `problem`: the residuals as a function of the parameters.
    - `likelihoods`: the likelihood of each recording's residuals.
    - `centre`, `root`: c and R.
    """

    problem: AbstractProblem
    likelihoods: tuple[Likelihood, ...]
    centre: Vector
    root: Matrix

    def of_rows(self, rows: Residuals) -> Scalar:
        """Logarithm of the density of residuals, the last of which are of prior knowledge."""
        each = [
            own.log_density(self.problem.share(i, rows)) for i, own in enumerate(self.likelihoods)
        ]
        return sum(each, -jnp.sum(rows[self.observed :] ** 2) / 2)

    @property
    def observed(self) -> int:
        """Number of the residuals that are not of prior knowledge."""
        return sum(own.directions.shape[0] for own in self.likelihoods)

    def values(self, at: Vector) -> tuple[Vector, Scalar]:
        """Values at scaled coordinates, and log |dv/du|."""
        u, values, logarithms = self.centre + self.root @ at, [], []
        for i, each in enumerate(_transforms(self.problem)):
            values.append(each(u[i]))
            logarithms.append(each.log_abs_det_jacobian(u[i], values[-1]))
        return jnp.stack(values), jnp.sum(jnp.stack(logarithms))

    def log_density(self, at: Vector, answer: Answer) -> tuple[Scalar, Vector]:
        """Logarithm of the density and its gradient, from the residuals and their Jacobian; −∞ and
        0 if the simulation failed.
        """
        assert answer.jacobian is not None
        density, slopes = jax.value_and_grad(self.of_rows)(answer.residuals)
        (values, logarithm), pulled = jax.vjp(self.values, at)
        known, slopes_known = jax.value_and_grad(self.problem.prior_density)(values)
        density, slopes = density + known, slopes @ answer.jacobian + slopes_known
        (gradient,) = pulled((slopes, jnp.ones_like(logarithm)))
        possible = jnp.isfinite(density + logarithm) & jnp.all(jnp.isfinite(gradient))
        return (
            jnp.where(possible, density + logarithm, -jnp.inf),
            jnp.where(possible, gradient, 0.0),
        )

    def potential(self, at: Vector) -> Scalar:
        """Minus the logarithm of the density. Its derivative in reverse mode is that of the forward
        Jacobian, from the same simulation.
        """
        here = jax.lax.stop_gradient(at)
        answer = self.problem.answer(self.values(here)[0], jnp.zeros((), bool))
        density, gradient = jax.lax.stop_gradient(self.log_density(here, answer))
        return -density - gradient @ (at - here)


def density_of(estimate: Estimate[P]) -> Density:
    """The posterior density of an estimate's parameters, scaled by the information at the estimate
    and that of the ranges.
    """
    problem, each = estimate.problem, likelihoods(estimate)
    inside = zip(_transforms(problem), _inside(estimate), strict=True)
    centre = jnp.stack([each.inv(value) for each, value in inside])
    unscaled = Density(problem, each, centre, jnp.eye(len(centre), dtype=centre.dtype))
    slopes = jax.jacfwd(lambda at: unscaled.values(at)[0])(jnp.zeros_like(centre))
    information = slopes.T @ _information(estimate, unscaled) @ slopes
    root = jnp.linalg.cholesky(jnp.linalg.inv(information))
    if not bool(jnp.all(jnp.isfinite(root))):
        raise ValueError(
            "The record does not determine some combination of the parameters, so that flat priors "
            "have no posterior: give the experiment `bounds` of them."
        )
    return dataclasses.replace(unscaled, root=root)


def _inside(estimate: Estimate[P]) -> Vector:
    """The values, moved away from the ends of their ranges by at most a standard error."""
    found, handles = [], estimate.problem.handles().values()
    rows = zip(handles, estimate.values, estimate.standard_errors, strict=True)
    for handle, value, error in rows:
        low, high = handle.allowed.low, handle.allowed.high
        away = min(float(error), (high - low) / 4)
        away = away if math.isfinite(away) else abs(float(value))
        found.append(min(max(float(value), low + away), high - away))
    return jnp.array(found, jnp.asarray(estimate.values).dtype)


def _information(estimate: Estimate[P], density: Density) -> Matrix:
    """Information about the values at the estimate, and that of flat distributions over their
    ranges.
    """
    problem = estimate.problem
    residuals, jacobian = jnp.asarray(estimate.residuals), jnp.asarray(estimate.jacobian)
    known = jacobian[density.observed :]
    widths = [each.allowed.high - each.allowed.low for each in problem.handles().values()]
    flat = jnp.array([12 / width**2 for width in widths], jacobian.dtype)
    prior = problem.prior_rows(jnp.asarray(estimate.values)).slopes
    whole = known.T @ known + prior.T @ prior + jnp.diag(flat)
    rows = zip(problem.each_recording(), density.likelihoods, strict=True)
    for i, ((_, places), own) in enumerate(rows):
        at = jnp.array(places)
        slopes = problem.share(i, jacobian)[:, at]
        part = own.information(problem.share(i, residuals), slopes)
        whole = whole.at[jnp.ix_(at, at)].add(part)
    return whole


def _transforms(problem: AbstractProblem) -> "list[Transform[Any]]":
    return [_transform(each.allowed) for each in problem.handles().values()]


def _transform(allowed: Range) -> "Transform[Any]":
    """The transformation from an unbounded coordinate to a range."""
    from numpyro.distributions import biject_to, constraints

    low, high = allowed.low, allowed.high
    if low == -math.inf and high == math.inf:
        return biject_to(constraints.real)
    if high == math.inf:
        return biject_to(constraints.greater_than(low))
    if low == -math.inf:
        return biject_to(constraints.less_than(high))
    return biject_to(constraints.interval(low, high))
