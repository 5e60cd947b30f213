"""The shaken pendulum as a hybrid system, for Lyapunov exponents."""

from collections.abc import Sequence

import jax.numpy as jnp
from jaxtyping import Array

import impactjax as ij
from impactjax._thesis.constants import LENGTH, OMEGA_N, ZETA, Case

State = dict[str, Array]
Mode = Array
_FREE, _TOUCHING = 0, 1


class SoftPendulum(ij.HybridSystem):
    """A pendulum on a base that moves by A cos Ωt, equation 2.10, against a Kelvin-Voigt contact.

    The damping ratio of a contact is set at its beginning, so that r = r0 − α v. It is a third
    state.
    """

    amplitude: float
    omega: float
    omega0: float
    r0: float
    alpha: float

    def flow(self, t: Array, y: State, mode: Mode) -> State:
        contact = self.omega0 * (self.omega0 * y["angle"] + 2 * y["gamma"] * y["rate"])
        rate = self.free(t, y) - jnp.where(mode == _TOUCHING, contact, 0.0)
        return {"angle": y["rate"], "rate": rate, "gamma": jnp.zeros_like(rate)}

    def free(self, t: Array, y: State) -> Array:
        """Angular acceleration in flight [rad/s²]."""
        push = self.amplitude / LENGTH * self.omega**2 * jnp.cos(self.omega * t)
        swing = -2 * ZETA * OMEGA_N * y["rate"] - OMEGA_N**2 * jnp.sin(y["angle"])
        return swing + push * jnp.cos(y["angle"])

    def transitions(self) -> Sequence[ij.Transition]:
        return [ij.Transition(self.flies, self.touch), ij.Transition(self.touches, self.leave)]

    def flies(self, t: Array, y: State, mode: Mode) -> Array:
        """Height above the stop in flight."""
        del t
        return jnp.where(mode == _FREE, y["angle"], 1.0)

    def touches(self, t: Array, y: State, mode: Mode) -> Array:
        """Penetration in contact."""
        del t
        return jnp.where(mode == _TOUCHING, -y["angle"], 1.0)

    def touch(self, t: Array, y: State, mode: Mode) -> tuple[State, Mode]:
        """Begin of a contact."""
        del t
        loss = jnp.log(self.r0 + self.alpha * LENGTH * y["rate"])
        gamma = -loss / jnp.sqrt(jnp.pi**2 + loss**2)
        return {**y, "gamma": gamma}, jnp.full_like(mode, _TOUCHING)

    def leave(self, t: Array, y: State, mode: Mode) -> tuple[State, Mode]:
        """End of a contact."""
        del t
        return y, jnp.full_like(mode, _FREE)


def soft_system(case: Case) -> tuple[SoftPendulum, ij.Start]:
    """A forced motion of chapter 4 with a Kelvin-Voigt contact, and its start."""
    system = SoftPendulum(case.amplitude, case.omega, *case.soft)
    return system, ij.Start(0.0, {"angle": 0.2, "rate": 0.0, "gamma": 0.0}, _FREE)
