"""Least-squares problems whose residuals are a function of a few numbers, fitted in no time."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from impactjax._fit.fit import best_from
from impactjax._fit.search import Search
from impactjax._parameter import Range
from impactjax._problem.abstract_problem import AbstractProblem, Answer, Assumed
from impactjax._problem.parameters import Handle

ANY = Range("1", -np.inf, np.inf, excludes_low=False, known=False)
POSITIVE = Range("1", 0.0, np.inf, excludes_low=True, known=False)
FROM_ZERO = Range("1", 0.0, np.inf, excludes_low=False, known=False)
NO_IMPACTS = ij.ImpactLog(
    *(jnp.int32(0), jnp.zeros(1), jnp.zeros(1, int)), *(jnp.zeros(1),) * 5, *[jnp.zeros(1, bool)]
)


class ClosedForm(AbstractProblem):
    """Data with independent noise of known size, and the function that they follow."""

    names: tuple[str, ...] = eqx.field(static=True)
    ranges_of: tuple[Range, ...] = eqx.field(static=True)
    function: Callable[[jax.Array], jax.Array] = eqx.field(static=True)
    data: jax.Array
    sigma: jax.Array
    begin: jax.Array

    def assumed(self):
        return Assumed(ij.Squares(), ij.WhiteNoise())

    def each_recording(self):
        return []

    def handles(self):
        pairs = zip(self.names, self.ranges_of, strict=True)
        return {name: Handle((), allowed) for name, allowed in pairs}

    @property
    def valid(self):
        return jnp.ones(self.data.shape, bool)

    def first(self, share):
        del share
        return self.valid

    def answer(self, values, logged=None):
        del logged
        jacobian = jax.jacfwd(self.function)(values)
        return Answer(self.residuals(values), NO_IMPACTS, jacobian)

    def joined(self, values, answers):
        raise AssertionError("there is only one recording")

    def share(self, index, rows):
        raise AssertionError("there is only one recording")

    def starting_values(self):
        return list(self.begin)

    def residuals(self, values):
        return self.function(values) - self.data

    def variance(self):
        return self.sigma**2

    def is_classical(self):
        return True

    def shifted(self, rows):
        return eqx.tree_at(lambda each: each.data, self, self.data - rows)

    def misfit(self, residuals):
        return jnp.zeros_like(residuals[0])

    def exceeds_noise(self, residuals, impacts):
        return jnp.zeros((), bool)

    @property
    def log_units(self):
        return jnp.zeros(())

    @property
    def sizes_found(self):
        return 0


def fitted(function, ranges, data, sigma, begin):
    """The estimate of parameters p0, p1, ... with some ranges."""
    names = tuple(f"p{i}" for i in range(len(ranges)))
    numbers = (jnp.asarray(x, float) for x in (data, sigma, begin))
    problem = ClosedForm(names, tuple(ranges), function, *numbers)
    lanes = np.asarray(problem.coordinates(np.asarray(problem.begin)))[None]
    found = best_from(problem, lanes, ij.LevenbergMarquardt(reduction=1e-12), Search())
    assert bool(found.usable)
    return found
