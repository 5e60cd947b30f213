"""A forced system, the start of a motion, and how it runs from period to period."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from impactjax._hybrid.arguments import as_tolerance
from impactjax._hybrid.ends import with_arrays
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.system import HybridSystem
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._refusal import of_kind
from impactjax._response.oscillator_sampler import OscillatorSampler
from impactjax._response.period import Period, as_function
from impactjax._response.sampler import AbstractSampler, Counts
from impactjax._response.system_sampler import SystemSampler
from impactjax._simulate.arguments import check_start
from impactjax._simulate.default_step import natural_step
from impactjax._simulate.step import AbstractStep


class Forced(NamedTuple):
    """A system of arrays, the start of a motion, and their sampler."""

    system: eqx.Module
    start: Start | InitialState
    run: AbstractSampler[Any]  # of systems of this kind


def forced(
    system: object,
    start: object,
    period: Period,
    counts: Counts,
    tolerance: ArrayLike | None,
    step: object,
) -> Forced:
    """A forced system and its sampler. Checks the kinds of the arguments."""
    if isinstance(system, ImpactOscillator):
        return _forced_oscillator(system, start, period, counts, tolerance, step)
    own: HybridSystem = of_kind("system", HybridSystem, "Ball(gravity, restitution)")(system)
    first: Start = of_kind("start", Start, "Start(t=0.0, y=y0)")(start)
    method = of_kind("step", AbstractMethod, "Taylor()", optional=True)(step)
    own = with_arrays(own, jnp.result_type(float, *jax.tree.leaves(first.y)))
    return Forced(own, first, SystemSampler(as_function(period, own), tolerance, method, counts))


def _forced_oscillator(
    model: ImpactOscillator,
    start: object,
    period: Period,
    counts: Counts,
    tolerance: ArrayLike | None,
    step: object,
) -> Forced:
    first: InitialState = of_kind("start", InitialState, "InitialState(0.3)")(start)
    method = of_kind("step", AbstractStep, "TaylorStep()", optional=True)(step)
    check_start(model, first, np.zeros(1), None)
    leaves = (jnp.zeros(()), *jax.tree.leaves((model, first)))  # swept values are as the first
    dtype = np.result_type(*(jnp.result_type(leaf) for leaf in leaves))
    first = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), first)
    allowed = as_tolerance(tolerance, dtype)
    method = natural_step(model, allowed) if method is None else method
    force = as_function(period, model)
    run = OscillatorSampler(force, jnp.asarray(allowed, dtype), method, counts)
    return Forced(model, first, run)
