"""The impacting pendulum as a sequence of flights in closed form."""

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from impactjax._analytic.multiple_scales import MultipleScales
from impactjax._model.initial_state import InitialState
from impactjax._model.law import AbstractImpactLaw
from impactjax._model.pendulum import Pendulum
from impactjax._parameter import as_parameter
from impactjax._types import Coordinate, CoordinateRate, Numbers, Scalar, Time


class PiecewiseAnalytical(eqx.Module):
    """Multiple-scales flights, joined at the impacts. Made by `piecewise_analytical`.

    - `flight`: the flights, each in the row of the impact that ends it.
    - `begin`: beginning of each flight [s].
    - `impact_time`: end of each flight [s].
    - `approach_speed`, `separation_speed`: speeds before and after the impact, positive [m/s].

    At the time of an impact samples show the state after it. Samples after the last impact are NaN.
    """

    flight: MultipleScales
    begin: Float[Array, "... impacts"]
    impact_time: Float[Array, "... impacts"]
    approach_speed: Float[Array, "... impacts"]
    separation_speed: Float[Array, "... impacts"]

    def position(self, ts: Numbers) -> Coordinate:
        """Angle from the stop at some times [rad]."""
        ts = as_parameter(ts)
        flight, since = self._flight_at(ts)
        return flight.position(since)

    def velocity(self, ts: Numbers) -> CoordinateRate:
        """Angular velocity at some times, of first order [rad/s]."""
        ts = as_parameter(ts)
        flight, since = self._flight_at(ts)
        return flight.velocity(since)

    def _flight_at(self, ts: Time) -> tuple[MultipleScales, Time]:
        """The flight at each time, and the time since its beginning."""
        number = jnp.searchsorted(self.impact_time, ts, side="right")
        known = number < self.impact_time.size
        row = jnp.where(known, number, 0)
        initial = jax.tree.map(lambda x: x[row], self.flight.initial)
        since = jnp.where(known, ts - self.begin[row], jnp.nan)
        return MultipleScales(self.flight.pendulum, initial), since


class _Next(NamedTuple):
    """Start of the next flight."""

    t: Scalar
    initial: InitialState
    turn: Scalar  # advance of its phase until the impact [rad]


def piecewise_analytical(
    pendulum: Pendulum,
    law: AbstractImpactLaw,
    initial: InitialState,
    *,
    max_impacts: int,
) -> PiecewiseAnalytical:
    """The piecewise analytical trajectory of a pendulum whose rigid stop stands at θ = 0.

    Each flight is the multiple-scales solution: the first from the initial state, the others of
    case II. It ends where its formula returns to zero. The errors of `MultipleScales` accumulate,
    since each flight starts with the speed that the formula of the last one gave.

    Source: Carter (2005), Figures 3.2 and 3.3.

    **Arguments:**

    - `pendulum`: without dry friction, on a base at rest.
    - `law`: impact law. After an impact with a restitution outside 0 to 1 all values are NaN.
    - `initial`: state at time zero, with θ ≥ 0 [rad], [rad/s].
    - `max_impacts`: number of impacts; the trajectory ends with the last.
    """
    if max_impacts < 1:
        raise ValueError(f"Argument `max_impacts` must be at least 1, but it is {max_impacts}.")

    def fly(start: _Next, _: None) -> tuple[_Next, tuple[PyTree, ...]]:
        flight = MultipleScales(pendulum, start.initial)
        duration = flight.time_to_turn(start.turn)
        approach = -flight.velocity(duration)
        r = law.restitution(pendulum.lever() * approach)
        separation = jnp.where((r >= 0) & (r <= 1), r, jnp.nan) * approach
        launched = InitialState(jnp.zeros_like(separation), separation)
        end = start.t + duration
        half_turn = jnp.full_like(start.turn, math.pi)
        return _Next(end, launched, half_turn), (start, end, approach, separation)

    ahead = jnp.arctan2(initial.velocity / pendulum.omega_n, initial.position)
    first = _Next(jnp.zeros_like(ahead), initial, ahead + math.pi / 2)
    _, (starts, ends, approach, separation) = jax.lax.scan(fly, first, length=max_impacts)
    lever = pendulum.lever()
    return PiecewiseAnalytical(
        MultipleScales(pendulum, starts.initial),
        starts.t,
        ends,
        lever * approach,
        lever * separation,
    )
