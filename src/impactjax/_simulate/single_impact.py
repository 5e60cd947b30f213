"""One impact of a free mass on any force law, by integration."""

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._model.equivalents import Equivalents, approach
from impactjax._model.free_mass import FreeMass
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._model.law import AbstractForceLaw
from impactjax._model.stop import Stop
from impactjax._refusal import check_kind
from impactjax._results import RESULTS
from impactjax._simulate.simulate import simulate
from impactjax._simulate.step import AbstractStep
from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Length, Mass, Numbers, Scalar, Speed, Time

LONGEST = 100.0  # contact, in time scales: the restitution of Kelvin-Voigt is 1e-43 then


def single_impact(
    law: AbstractForceLaw,
    speed: Numbers,
    mass: Numbers,
    *,
    step: AbstractStep | None = None,
    tolerance: ArrayLike | None = None,
    max_steps: int = 1024,
) -> Equivalents:
    """Outcome of one impact on any force law, if no force but that of the contact acts.

    Differentiable in the law, the speed and the mass. If the law has a method `equivalents`, that
    one is faster and exact. A mass that does not separate within a hundred times the time in which
    the force would stop it counts as one that does not come back: its restitution is zero, its
    contact has infinite duration, and its depth is the limit of its creep. If the integration
    fails, all values are NaN.

    **Arguments:**

    - `law`: the force law, which may be your own.
    - `speed`: approach speed, of any shape [m/s].
    - `mass`: mass, of the speed's shape or one for all [kg].
    - `step`, `tolerance`, `max_steps`: as for `simulate`.

    **Raises** `TypeError` for a law without a force, and `ValueError` for a speed or mass that is
    known and not positive.
    """
    check_kind("law", law, AbstractForceLaw, "KelvinVoigt(700.0, 0.2)")
    v, m = jnp.broadcast_arrays(*approach(speed, mass))

    def one(v: Speed, m: Mass) -> Equivalents:
        run = simulate(
            ImpactOscillator(FreeMass(m), Stop(law)),
            InitialState(0.0, -v),
            LONGEST * time_scale(law, v, m) * jnp.array([0.75, 1.0], v.dtype),
            t0=0.0,
            step=step,
            tolerance=tolerance,
            max_steps=max_steps,
            max_impacts=1,
        )
        log = run.impacts
        separates = log.complete[0]
        found = Equivalents(
            restitution=log.restitution[0],
            duration=jnp.where(separates, log.duration[0], jnp.inf),
            deepest_penetration=run.deepest_penetration[0] + _creep(run),
            peak_force=run.peak_force[0],
            energy_lost=jnp.where(separates, log.energy_lost[0], m * v**2 / 2),
        )
        fine = run.result == RESULTS.successful
        return jax.tree.map(lambda x: jnp.where(fine, x, jnp.nan), found)

    for _ in range(v.ndim):
        one = jax.vmap(one)
    return one(v, m)


def _creep(run: Trajectory) -> Length:
    """Remaining way of a mass that creeps ever more slowly at the end of a run.

    If the speed falls from u to v in a time h by exp(−μ t), it is v/μ = v h/ln(u/v).
    """
    before, at_end = -run.velocity
    creeps = (at_end > 0) & (before > at_end)
    u, v = (jnp.where(creeps, speed, x) for speed, x in ((before, 2.0), (at_end, 1.0)))
    return jnp.where(creeps, v * (run.ts[1] - run.ts[0]) / jnp.log(u / v), 0.0)


def time_scale(law: AbstractForceLaw, speed: Scalar, mass: Scalar) -> Time:
    """The time, to a power of two, in which the force at a free approach stops the mass [s]."""
    internal = law.touch(speed, mass)
    times = jnp.exp2(jnp.arange(-80, 81).astype(speed.dtype))
    forces = jax.vmap(lambda t: law.force(speed * t, speed, internal, mass))(times)
    stops = forces * times >= mass * speed
    return jax.lax.stop_gradient(jnp.where(jnp.any(stops), times[jnp.argmax(stops)], 1.0))
