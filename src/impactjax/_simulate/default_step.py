"""The default step of a model."""

from collections.abc import Hashable
from functools import cache

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._series.order import natural_order
from impactjax._series.recurrences.series import NotAnalytic
from impactjax._simulate.automaton import NO_EVENT, Automaton, initial_mode, with_internal
from impactjax._simulate.runge_kutta import RungeKutta
from impactjax._simulate.step import AbstractStep
from impactjax._simulate.taylor_step import TaylorStep


def natural_step(model: ImpactOscillator, tolerance: ArrayLike) -> AbstractStep:
    """A Taylor step if the equations of motion are analytic, a Runge-Kutta step otherwise."""
    leaves, structure = jax.tree.flatten(model)
    shapes = tuple(jnp.shape(leaf) for leaf in leaves)
    return TaylorStep(natural_order(tolerance)) if _is_analytic(structure, shapes) else RungeKutta()


@cache
def _is_analytic(structure: Hashable, shapes: tuple[tuple[int, ...], ...]) -> bool:
    """True if models of this structure, with parameters of these shapes, have Taylor series."""

    def expand(*leaves: Array) -> object:
        model = jax.tree.unflatten(structure, leaves)
        number = jnp.zeros(())
        y = with_internal(model, number, number)
        mode, _ = initial_mode(model, number, y)
        return TaylorStep().expand(Automaton(model), number, y, mode, number, jnp.int32(NO_EVENT))

    try:
        dtype = jnp.result_type(float)
        jax.eval_shape(expand, *[jax.ShapeDtypeStruct(shape, dtype) for shape in shapes])
    except NotAnalytic:
        return False
    return True
