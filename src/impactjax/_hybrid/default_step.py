"""The default step of a hybrid system."""

from collections.abc import Hashable
from functools import lru_cache

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.extend.core import Jaxpr
from jaxtyping import Array, ArrayLike, PyTree

from impactjax._hybrid.equations import Equations
from impactjax._hybrid.lane import Start
from impactjax._hybrid.series_step import SeriesStep, with_guards
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import Mode, State
from impactjax._series.order import LOWEST_ORDER, natural_order
from impactjax._series.recurrences.series import NotAnalytic
from impactjax._types import Scalar

_MOST = 150  # operations: beyond them, the program of a series takes too long to compile


def default_step(equations: Equations, start: Start, tolerance: ArrayLike) -> AbstractFlowStep:
    """A Taylor step if flow and guards are analytic and short, a Runge-Kutta step otherwise."""
    leaves, structure = jax.tree.flatten((equations, start.t, start.y, start.mode))
    kinds = tuple(
        jax.ShapeDtypeStruct(leaf.shape, leaf.dtype) if eqx.is_array(leaf) else leaf
        for leaf in leaves
    )
    if _suits_series(structure, kinds):
        return SeriesStep(natural_order(tolerance))
    import diffrax  # half a second that other systems can do without

    from impactjax._hybrid.explicit_step import ExplicitStep

    return ExplicitStep(diffrax.Dopri8())


@lru_cache
def _suits_series(structure: Hashable, kinds: tuple[Hashable, ...]) -> bool:
    """True for systems of this structure, with leaves of these kinds."""
    shapes = [kind for kind in kinds if isinstance(kind, jax.ShapeDtypeStruct)]

    def parts(*arrays: Array) -> tuple[Equations, Scalar, State, Mode]:
        rest = iter(arrays)
        leaves = [next(rest) if isinstance(kind, jax.ShapeDtypeStruct) else kind for kind in kinds]
        return jax.tree.unflatten(structure, leaves)

    def evaluated(*arrays: Array) -> tuple[State, list[Scalar]]:
        equations, t, y, mode = parts(*arrays)
        return equations.flow(t, y, mode), equations.guards(t, y, mode)

    def expanded(*arrays: Array) -> PyTree:
        equations, t, y, mode = parts(*arrays)
        return with_guards(LOWEST_ORDER, equations, t, y, mode, jnp.ones_like(t))

    if _operations(jax.make_jaxpr(evaluated)(*shapes).jaxpr) > _MOST:
        return False
    try:
        jax.eval_shape(expanded, *shapes)
    except NotAnalytic:
        return False
    return True


def _operations(jaxpr: Jaxpr) -> int:
    """Number of operations, those of called functions included."""
    inner = [getattr(value, "jaxpr", None) for e in jaxpr.eqns for value in e.params.values()]
    return len(jaxpr.eqns) + sum(_operations(each) for each in inner if each is not None)
