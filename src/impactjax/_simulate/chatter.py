"""Complete chatter: infinitely many impacts in finite time, summed in closed form.

If the remaining series is so short that the acceleration A towards a rigid stop and the restitution
r are constant over it, its flights form a geometric series. After a separation speed u, against dry
friction d, the approach speed is w = u √((A − d)/(A + d)), the next separation speed is r w, and
with ρ = r w / u the mass comes to rest after

    T = u (1/(A + d) + (w/u)/(A − d)) / (1 − ρ),        2 u / (A (1 − r)) without friction.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractImpactLaw
from impactjax._simulate.driving import driving_rate
from impactjax._simulate.flow import Wall, free_acceleration, holding_resistance, walls
from impactjax._simulate.interval import Interval, bounds
from impactjax._simulate.state import State
from impactjax._types import Flag, Scalar


class Chatter(eqx.Module):
    """Condition under which a series of impacts is summed instead of simulated one by one.

    **Arguments:**

    - `below`: only impacts slower than this fraction of the fastest one so far are summed; all
      others appear in the impact log. In any case a series is summed only if the sum is as accurate
      as the tolerance, by bounds of push, resistance and restitution over all of it (interval
      arithmetic). If equations of your own contain an operation without such bounds, impacts are
      simulated until floating-point numbers cannot resolve them.
    """

    below: float = eqx.field(default=1e-3, static=True, converter=float)


def push(model: ImpactOscillator, wall: Wall, t: Scalar, velocity: Scalar) -> Scalar:
    """Free acceleration towards a stop of a mass at that stop with a given velocity."""
    at_stop = State(jnp.broadcast_to(wall.place(), jnp.shape(velocity)), velocity)
    return -wall.sign * free_acceleration(model, t, at_stop)


class Tail(NamedTuple):
    """The geometric series after a separation at speed u, in units of the coordinate."""

    speed: Scalar  # u
    rising: Scalar  # deceleration A + d on the way up
    falling: Scalar  # acceleration A − d on the way down
    ratio: Scalar  # ρ
    flight: Scalar  # duration of the first flight

    def duration(self) -> Scalar:
        """Time until rest."""
        return self.flight / (1 - self.ratio)

    def height(self) -> Scalar:
        """Height of the first flight."""
        return self.speed**2 / (2 * self.rising)


def harmless(like: Scalar) -> Tail:
    """An arbitrary series without zeros and infinities."""
    one = jnp.ones_like(like)
    return Tail(one, one, one, one / 2, 2 * one)


def tail(model: ImpactOscillator, wall: Wall, law: AbstractImpactLaw, t: Scalar, y: State) -> Tail:
    """The series that starts with the state `y`, which leaves the stop at time `t`."""
    speed = wall.sign * y.velocity
    pressing = push(model, wall, t, jnp.zeros_like(speed))
    drag = holding_resistance(model, speed)
    rising, falling = pressing + drag, pressing - drag
    usable = falling > 0
    safe_rising, safe_falling = (jnp.where(usable, x, 1.0) for x in (rising, falling))
    loss = jnp.sqrt(safe_falling / safe_rising)
    ratio = law.restitution(model.oscillator.lever() * speed * loss) * loss
    flight = speed * (1 / safe_rising + loss / safe_falling)
    return Tail(speed, safe_rising, falling, ratio, flight)


class Scale(NamedTuple):
    """Scales of a lane's motion so far, with which errors of a sum are compared."""

    fastest: Scalar  # approach speed, in units of the coordinate
    longest: Scalar  # step of a flight [s]


def is_summable(
    model: ImpactOscillator,
    wall: Wall,
    law: AbstractImpactLaw,
    t: Scalar,
    y: State,
    scale: Scale,
    tolerance: Scalar,
    chatter: Chatter,
) -> Flag:
    """True if a series may be summed: its push, resistance and restitution are constant within the
    tolerance, and it reaches no other stop; or it is too short, or too low, for floating-point
    numbers to resolve it.
    """
    series = tail(model, wall, law, t, y)
    ends = (series.falling > 0) & (series.ratio >= 0) & (series.ratio < 1) & (series.speed >= 0)
    series = jax.tree.map(lambda a, b: jnp.where(ends, a, b), series, harmless(series.speed))
    duration = series.duration()
    error = _relative_change(model, wall, law, t, series) / (1 - series.ratio)
    steady = (
        (error <= 1 / 4)  # so that twice the series holds all of it
        & (series.speed * error <= tolerance * scale.fastest / 2)
        & (duration * error <= tolerance * scale.longest)
    )
    rounding = 4 * jnp.finfo(t.dtype).eps
    unresolved = duration <= rounding * jnp.abs(t)
    unresolved = unresolved | (series.height() <= rounding * jnp.abs(wall.place()))
    slow = series.speed <= chatter.below * scale.fastest
    return ends & slow & (steady | unresolved) & _reaches_nothing(model, wall, series)


def _relative_change(
    model: ImpactOscillator, wall: Wall, law: AbstractImpactLaw, t: Scalar, series: Tail
) -> Scalar:
    """Largest relative change of push, resistance and restitution over twice the series' duration,
    height and speeds, relative to the least net push; infinite if that may vanish.

    What drives the oscillator counts as at least a quarter of the push, so that the derivative by a
    small amplitude is as accurate.
    """

    def pushing(t: Scalar, clearance: Scalar, velocity: Scalar) -> Scalar:
        place = wall.place() + wall.sign * clearance
        return -wall.sign * free_acceleration(model, t, State(place, velocity))

    def resisting(speed: Scalar) -> Scalar:
        resistance = model.oscillator.resistance(speed)
        return jnp.zeros_like(speed) if resistance is None else resistance

    zero, fast = jnp.zeros_like(t), 2 * series.speed
    push = bounds(
        pushing,
        Interval(t, t + 2 * series.duration()),
        Interval(zero, 2 * series.height()),
        Interval(-fast, fast),
    )
    resistance = bounds(resisting, Interval(zero, fast))
    lever = model.oscillator.lever()
    restitution = bounds(law.restitution, Interval(zero, lever * fast))
    remains = push.low - resistance.high
    change = (push.width() + resistance.width()) / jnp.where(remains > 0, remains, 1.0)
    place = State(jnp.broadcast_to(wall.place(), jnp.shape(zero)), zero)
    least = driving_rate(model, t, place) * series.duration() / 2
    change = jnp.maximum(change, least)
    return jnp.where(remains > 0, change, jnp.inf) + restitution.width()


def _reaches_nothing(model: ImpactOscillator, wall: Wall, series: Tail) -> Flag:
    """True if a series reaches no other stop."""
    others = [other for other in walls(model) if other.index != wall.index]
    apart = [other.clearance(wall.place()) > 2 * series.height() for other in others]
    return jnp.all(jnp.stack([jnp.ones((), bool), *apart]))


def tail_state(series: Tail, wall: Wall, y: State, s: Scalar) -> State:
    """The state a time s after the start of the series."""
    ratio = jnp.maximum(series.ratio, jnp.finfo(s.dtype).tiny)
    flight = jnp.where(series.flight > 0, series.flight, 1.0)  # none after an impact with r = 0
    left = jnp.maximum(1 - s * (1 - ratio) / flight, jnp.finfo(s.dtype).tiny)
    bounces = jax.lax.stop_gradient(jnp.floor(jnp.log(left) / jnp.log(ratio)))
    shrunk = jnp.where(bounces == 0, 1.0, ratio) ** bounces
    speed = series.speed * shrunk
    x = s - series.flight * (1 - shrunk) / (1 - ratio)
    fall = x - speed / series.rising
    clearance = jnp.where(
        fall < 0,
        speed * x - series.rising * x**2 / 2,
        speed**2 / (2 * series.rising) - series.falling * fall**2 / 2,
    )
    rate = jnp.where(fall < 0, speed - series.rising * x, -series.falling * fall)
    return State(wall.place() + wall.sign * clearance, wall.sign * rate, y.internal)
