"""What one impact comes to."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._types import Energy, Force, Length, Mass, Ratio, Speed, Time


class Equivalents(eqx.Module):
    """What one impact at a speed comes to if nothing but the contact acts; each of the speed's
    shape.

    - `restitution`: separation speed over approach speed [1].
    - `duration`: of the contact [s]; infinite if the mass does not come back.
    - `deepest_penetration`: [m].
    - `peak_force`: [N].
    - `energy_lost`: kinetic energy before minus after [J].
    """

    restitution: Ratio
    duration: Time
    deepest_penetration: Length
    peak_force: Force
    energy_lost: Energy


def equivalents(
    speed: Speed, mass: Mass, restitution: Ratio, duration: Time, deepest: Length, peak: Force
) -> Equivalents:
    """Equivalents from what is needed to know them."""
    lost = mass * speed**2 * (1 - restitution**2) / 2
    return Equivalents(*jnp.broadcast_arrays(restitution, duration, deepest, peak, lost))
