"""The impact log: times, speeds and durations of all impacts."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._known import AnyArray, namespace
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.compliant_stop import PullFree, Surface
from impactjax._simulate.extremes import Extremes, extremes, without_extremes
from impactjax._simulate.lane import Log, Record, factors_of
from impactjax._simulate.magnification import magnification
from impactjax._simulate.replay import Path
from impactjax._simulate.rigid_stop import RigidStop, impact_speed
from impactjax._simulate.state import Phase
from impactjax._simulate.step import AbstractStep
from impactjax._types import Factors, Scalar


class ImpactLog(eqx.Module):
    """One row for each impact, in order of time; rows from `count` on are zero.

    - `time`: time at which the mass reaches the stop [s].
    - `stop`: 0 for the lower stop of a model, 1 for the upper one, if it has both.
    - `approach_speed`, `separation_speed`: speeds before and after, positive [m/s]. The first is
      zero if contact resumes inside the indentation while the mass moves away.
    - `restitution`: their ratio [1].
    - `duration`: duration of the contact; zero at a rigid stop [s].
    - `energy_lost`: kinetic energy before minus after [J].

    A contact that has not ended at the end of the run has no separation: `complete` is false there,
    and values that need the separation are zero. The impacts of a summed chatter have no rows.
    """

    count: Int[Array, "..."]
    time: Float[Array, "... impacts"]
    stop: Int[Array, "... impacts"]
    approach_speed: Float[Array, "... impacts"]
    separation_speed: Float[Array, "... impacts"]
    restitution: Float[Array, "... impacts"]
    duration: Float[Array, "... impacts"]
    energy_lost: Float[Array, "... impacts"]
    complete: Bool[Array, "... impacts"]

    @property
    def happened(self) -> Bool[AnyArray, "... impacts"]:
        """Mask of the rows with an impact."""
        xp = namespace(self.count)
        return xp.arange(self.time.shape[-1], dtype=self.count.dtype) < self.count[..., None]


class _Ends(NamedTuple):
    """Contribution of the end of each step to the impact log."""

    begins: Bool[Array, " steps"]
    separates: Bool[Array, " steps"]
    leaves: Bool[Array, " steps"]  # the stop, where a factor acts
    stop: Int[Array, " steps"]
    approach_speed: Float[Array, " steps"]
    separation_speed: Float[Array, " steps"]


class Impacts(NamedTuple):
    """The impacts of a lane, their number, extremes, and the magnification of errors."""

    log: ImpactLog
    total: Int[Array, ""]
    extremes: Extremes
    magnification: Scalar


def impacts_of(
    step: AbstractStep,
    max_impacts: int,
    with_extremes: bool,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    factors: Factors | None,
) -> Impacts:
    """The impact log of a lane, with `max_impacts` rows, and its extremes if `with_extremes`. Else
    there is no nearest miss, which would magnify errors.
    """
    ends = jax.vmap(lambda path, log: _read(model, path, log))(path, record.log)
    number = jnp.cumsum(ends.begins, dtype=jnp.int32) - 1
    total = number[-1] + 1
    opened = jnp.where(ends.begins, number, max_impacts)
    closed = jnp.where(ends.separates & (number >= 0), number, max_impacts)
    lever, mass = model.oscillator.lever(), model.oscillator.mass

    def gather(values: Array, rows: Array) -> Array:
        return jnp.zeros(max_impacts, values.dtype).at[rows].add(values, mode="drop")

    end_time = path.t + path.h
    complete = gather(ends.separates.astype(jnp.int32), closed) > 0
    time = gather(end_time, opened)
    approach = gather(lever * ends.approach_speed, opened)
    separation = gather(lever * ends.separation_speed, closed)
    if factors is not None:
        scales = gather(ends.leaves.astype(jnp.int32), closed) > 0
        own = factors_of(factors, jnp.arange(max_impacts))
        separation = separation * jnp.where(scales, own, 1.0)
    moving = complete & (approach > 0)
    log = ImpactLog(
        count=jnp.minimum(total, max_impacts),
        time=time,
        stop=gather(ends.stop, opened),
        approach_speed=approach,
        separation_speed=separation,
        restitution=jnp.where(moving, separation / jnp.where(moving, approach, 1), 0),
        duration=jnp.where(complete, gather(end_time, closed) - time, 0),
        energy_lost=jnp.where(complete, mass * (approach**2 - separation**2) / 2, 0),
        complete=complete,
    )
    found = (
        extremes(step, model, path, record, number, max_impacts)
        if with_extremes
        else without_extremes(max_impacts, path.t[0])
    )
    magnified = magnification(
        model, path, record, ends.begins, number, log.restitution, log.duration, found.closest_turn
    )
    return Impacts(log, total, found, magnified)


def _read(model: ImpactOscillator, path: Path, log: Log) -> _Ends:
    flies = log.taken & (log.mode.phase == Phase.FLIGHT)
    touches = log.taken & (log.mode.phase == Phase.CONTACT)
    detached = log.taken & (log.mode.phase == Phase.DETACHED)
    begins = separates = leaves = jnp.zeros((), bool)
    stop = jnp.int32(0)
    approach = separation = jnp.zeros_like(path.t)
    for index, each in enumerate(Automaton(model).transitions):
        here = log.event == index
        if isinstance(each, RigidStop):
            own_begin = own_separate = own_leave = here & flies
        elif isinstance(each, Surface):
            own_begin = here & flies
            own_separate = own_leave = here & touches
        elif isinstance(each, PullFree):
            passes = each.leaves(path.t + path.h, path.end)
            own_begin, own_separate = here & detached & ~passes, here & touches
            own_leave = own_separate & passes
        else:
            continue
        inwards = -each.wall.sign * path.end.velocity
        away = -inwards
        if isinstance(each, RigidStop):
            away = each.law.restitution(impact_speed(model, inwards)) * inwards
        stop = jnp.where(own_begin, each.wall.index, stop).astype(jnp.int32)
        approach = jnp.where(own_begin, jnp.maximum(inwards, 0), approach)
        separation = jnp.where(own_separate, away, separation)
        begins, separates = begins | own_begin, separates | own_separate
        leaves = leaves | own_leave
    return _Ends(begins, separates, leaves, stop, approach, separation)
