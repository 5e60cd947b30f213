"""The three coefficients of restitution of one impact on a force law."""

from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, PyTree

from impactjax._model.free_mass import FreeMass
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._model.law import AbstractForceLaw, Internal
from impactjax._model.separation import AbstractSeparation
from impactjax._model.stop import Stop
from impactjax._parameter import as_parameter
from impactjax._results import RESULTS
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.chandrupatla import Bracket, falling_zero
from impactjax._simulate.chatter import Chatter
from impactjax._simulate.default_step import natural_step
from impactjax._simulate.lane import Run
from impactjax._simulate.lane_state import lane_state_at
from impactjax._simulate.loop import record_steps
from impactjax._simulate.replay import differentiable_path
from impactjax._simulate.single_impact import LONGEST, time_scale
from impactjax._simulate.state import Mode, Phase, State
from impactjax._types import Energy, Force, Length, Mass, Numbers, Ratio, Scalar, Speed

_MAX_STEPS = 512


class Coefficients(NamedTuple):
    """The coefficients of restitution [1] of one impact, equal where it is collinear.

    With the impulse p and the work W of the contact force on the mass, at the end of compression
    (c), where the mass turns, and at the end of the contact (f):

    - `kinematic`: Newton's −v⁺/v⁻ (3.8).
    - `kinetic`: Poisson's (p_f − p_c)/p_c (3.9).
    - `energetic`: Stronge's √(−(W_f − W_c)/W_c) (3.7).

    Source: Carter (2005), chapter 3; Stronge, Impact Mechanics (2000).
    """

    kinematic: Ratio
    kinetic: Ratio
    energetic: Ratio


def coefficients_of_restitution(
    law: AbstractForceLaw, speed: Numbers, mass: Numbers, *, tolerance: ArrayLike = 1e-12
) -> Coefficients:
    """The coefficients of an impact of a free mass, each from its definition.

    Impulse and work are integrated along with the motion. NaN where the mass does not come back.

    **Arguments:**

    - `law`: the force law, which may be your own.
    - `speed`: approach speed, of any shape [m/s].
    - `mass`: mass, of the speed's shape or one for all [kg].
    - `tolerance`: as for `simulate`.
    """
    v, m = jnp.broadcast_arrays(as_parameter(speed), as_parameter(mass))
    one = partial(_coefficients, law, jnp.asarray(tolerance, v.dtype))
    for _ in range(v.ndim):
        one = jax.vmap(one)
    return one(v, m)


@eqx.filter_jit
def _coefficients(law: AbstractForceLaw, tolerance: Scalar, v: Scalar, m: Scalar) -> Coefficients:
    metered = _Metered(law=law, separation=law.separation)
    model = ImpactOscillator(FreeMass(m), Stop(metered))
    step, start = natural_step(model, tolerance), jnp.zeros_like(v)
    end = LONGEST * time_scale(law, v, m)
    begin = lane_state_at(step, model, start, InitialState(start, -v))
    run = Run(model, begin, end, tolerance, jnp.ones((), bool))
    record = record_steps(step, Chatter(), _MAX_STEPS, jax.lax.stop_gradient(run))
    path, _ = differentiable_path(step, model, begin.point.y, start, end, None, record)

    log = record.log
    touching = log.taken & (log.mode.phase == Phase.CONTACT)
    turns = touching & (log.y.velocity < 0) & (log.end.velocity >= 0)
    turning = jax.tree.map(lambda column: column[jnp.argmax(turns)], (path, log.mode))
    (_, y, h, end, expansion), mode = turning

    def evaluate(s: Scalar, parameters: tuple[ImpactOscillator, Mode, PyTree]) -> State:
        model, mode, expansion = parameters
        return step.evaluate(Automaton(model), mode, expansion, s, jnp.zeros_like(s))

    bracket = Bracket(jnp.zeros_like(h), -y.velocity, h, -end.velocity)
    contact = model, mode, expansion
    turn = falling_zero(lambda s, contact: -evaluate(s, contact).velocity, bracket, contact)
    turned = evaluate(turn, contact)

    last = jnp.argmax(jnp.where(touching, log.t, -1))
    separated = jax.tree.map(lambda column: column[last], path.end)
    _, p_0, w_0 = metered.touch(v, m)
    _, p_c, w_c = turned.internal[0]
    _, p_f, w_f = separated.internal[0]
    found = Coefficients(
        kinematic=separated.velocity / v,
        kinetic=(p_f - p_c) / (p_c - p_0),
        energetic=jnp.sqrt((w_f - w_c) / (w_0 - w_c)),
    )
    ends = (record.result == RESULTS.successful) & (record.final.point.mode.phase != Phase.CONTACT)
    return jax.tree.map(lambda x: jnp.where(ends & jnp.any(turns), x, jnp.nan), found)


Meter = tuple[Internal, Float[Array, "..."], Energy]  # the law's own state, impulse [N s], work


class _Metered(AbstractForceLaw):
    """A law with the impulse and the work of its force as further internal states.

    They do not start at zero, since their relative error there would not decrease with the step.
    """

    law: AbstractForceLaw
    separation: AbstractSeparation

    def touch(self, speed: Speed, mass: Mass) -> Meter:
        return self.law.touch(speed, mass), mass * speed, -mass * speed**2

    def force(self, penetration: Length, rate: Speed, internal: Meter, mass: Mass) -> Force:
        return self.law.force(penetration, rate, internal[0], mass)

    def internal_rate(self, penetration: Length, rate: Speed, internal: Meter, mass: Mass) -> Meter:
        own = self.law.internal_rate(penetration, rate, internal[0], mass)
        force = self.force(penetration, rate, internal, mass)
        return own, force, -force * rate
