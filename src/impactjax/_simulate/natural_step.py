"""Which step a model takes if nobody says."""

import jax
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.automaton import Automaton, initial_mode, with_internal
from impactjax._simulate.runge_kutta import RungeKutta
from impactjax._simulate.step import AbstractStep
from impactjax._simulate.taylor import NotAnalytic
from impactjax._simulate.taylor_step import TaylorStep


def natural_step(model: ImpactOscillator) -> AbstractStep:
    """A Taylor step where the equations of motion are analytic, a Runge-Kutta step otherwise."""
    taylor = TaylorStep()

    def expand(model: ImpactOscillator) -> object:
        number = jnp.zeros(())
        y = with_internal(model, number, number)
        mode, _ = initial_mode(model, number, y)
        return taylor.expand(Automaton(model), number, y, mode, number)

    one_lane = jax.tree.map(lambda _: jax.ShapeDtypeStruct((), jnp.result_type(float)), model)
    try:
        jax.eval_shape(expand, one_lane)
    except NotAnalytic:
        return RungeKutta()
    return taylor
