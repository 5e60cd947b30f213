"""Complete chatter: infinitely many impacts in finite time, summed in closed form.

Once the impacts are so fast that the push A onto a rigid stop and the restitution r are constant
over all that follow, the flights form a geometric series: each approach speed is
w = u √((A − d)/(A + d)) after a separation speed u against dry friction d, each separation speed
r w, and with ρ = r w / u the mass comes to rest after

    T = u (1/(A + d) + (w/u)/(A − d)) / (1 − ρ),        2 u / (A (1 − r)) without friction.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractImpactLaw
from impactjax._simulate.flow import Wall, free_acceleration, holding_resistance
from impactjax._simulate.state import State
from impactjax._types import Flag, Scalar


class Chatter(eqx.Module):
    """When a series of impacts is summed rather than followed.

    **Arguments:**

    - `below`: only impacts slower than this fraction of the fastest one so far are summed, so that
      all others appear in the impact log. Whatever it is, the series is summed only where the sum
      is as accurate as the tolerance.
    """

    below: float = eqx.field(default=1e-3, static=True)


def push(model: ImpactOscillator, wall: Wall, t: Scalar, velocity: Scalar) -> Scalar:
    """Free acceleration towards a stop, of a mass at the stop with some velocity."""
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


def harmless(like: Scalar) -> Tail:
    """A series without zeros and infinities."""
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


def is_summable(
    model: ImpactOscillator,
    wall: Wall,
    law: AbstractImpactLaw,
    t: Scalar,
    y: State,
    fastest: Scalar,
    tolerance: Scalar,
    chatter: Chatter,
) -> Flag:
    """Whether the series is short enough to sum: what varies during it does not show."""
    series = tail(model, wall, law, t, y)
    falls_back = (
        (series.falling > 0) & (series.ratio >= 0) & (series.ratio < 1) & (series.speed > 0)
    )
    duration = jnp.where(falls_back, series.duration(), 0.0)
    at_rest = jnp.zeros_like(series.speed)
    now = push(model, wall, t, at_rest)
    changes = [
        push(model, wall, t + duration, at_rest) - now,
        push(model, wall, t, y.velocity) - now,
        push(model, wall, t, -y.velocity) - now,
    ]
    resistance = model.oscillator.resistance(series.speed)
    if resistance is not None:
        changes.append(resistance - holding_resistance(model, now))
    change = sum(jnp.abs(each) for each in changes) / jnp.where(falls_back, now, 1.0)
    lever = model.oscillator.lever()
    spread = law.restitution(at_rest) - law.restitution(lever * series.speed)
    error = series.speed * (change + jnp.abs(spread))
    return (
        falls_back
        & (series.speed <= chatter.below * fastest)
        & (error <= tolerance * fastest * (1 - series.ratio) / 2)
    )


def tail_state(series: Tail, wall: Wall, y: State, s: Scalar) -> State:
    """The state a time s after the start of the series."""
    ratio = jnp.maximum(series.ratio, jnp.finfo(s.dtype).tiny)
    left = jnp.maximum(1 - s * (1 - ratio) / series.flight, jnp.finfo(s.dtype).tiny)
    bounces = jax.lax.stop_gradient(jnp.floor(jnp.log(left) / jnp.log(ratio)))
    shrunk = jnp.where(bounces == 0, 1.0, ratio**bounces)
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
