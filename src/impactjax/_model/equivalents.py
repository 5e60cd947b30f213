"""Outcome of one impact: restitution, duration, depth, force and energy loss."""

from typing import Protocol, runtime_checkable

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._known import is_known
from impactjax._parameter import as_parameter
from impactjax._shown import with_numbers
from impactjax._types import Energy, Force, Length, Mass, Numbers, Ratio, Speed, Time


class Equivalents(eqx.Module):
    """Outcome of one impact at a given speed, if no force but that of the contact acts. All values
    have the shape of the speed.

    - `restitution`: separation speed divided by approach speed [1].
    - `duration`: duration of the contact [s]; infinite if the mass does not come back.
    - `deepest_penetration`: greatest penetration [m].
    - `peak_force`: greatest force [N].
    - `energy_lost`: kinetic energy before minus after [J].
    """

    restitution: Ratio
    duration: Time
    deepest_penetration: Length
    peak_force: Force
    energy_lost: Energy

    __repr__ = with_numbers


@runtime_checkable
class ClosedForm(Protocol):
    """A force law whose impacts have a closed form."""

    def equivalents(self, speed: Numbers, mass: Numbers) -> Equivalents: ...


def approach(speed: Numbers, mass: Numbers) -> tuple[Speed, Mass]:
    """Speed [m/s] and mass [kg] of an impact, as parameters.

    **Raises** `ValueError` for known ones that are not positive.
    """
    for name, value in (("speed", speed), ("mass", mass)):
        if is_known(value) and not np.all(np.asarray(value) > 0):
            raise ValueError(f"Argument `{name}` must be positive.")
    return as_parameter(speed), as_parameter(mass)


def equivalents(
    speed: Speed, mass: Mass, restitution: Ratio, duration: Time, deepest: Length, peak: Force
) -> Equivalents:
    """Equivalents, with the energy loss m v² (1 − r²)/2, broadcast to one shape."""
    lost = mass * speed**2 * (1 - restitution**2) / 2
    return Equivalents(*jnp.broadcast_arrays(restitution, duration, deepest, peak, lost))
