"""Systems for all tests of the engine: a table of them, and an oscillator of one's own."""

from collections.abc import Callable
from typing import NamedTuple

import diffrax
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

import impactjax as ij


class Own(ij.AbstractOscillator):
    """Somebody's own oscillator on a straight line: x″ = law(t, x, x′, *constants)."""

    law: Callable[..., Array] = eqx.field(static=True)
    constants: tuple[ArrayLike, ...] = ()
    mass: Array = eqx.field(default=1.0, converter=jnp.asarray)

    def acceleration(self, t, position, velocity):
        return self.law(t, position, velocity, *self.constants)

    def resistance(self, speed):
        del speed

    def lever(self):
        return jnp.ones_like(self.mass)

    def is_angle(self):
        return False


class Case(NamedTuple):
    """A system as a function of its parameters, the last two of which are the initial state."""

    model: Callable[[Array], ij.ImpactOscillator]
    names: tuple[str, ...]
    values: tuple[float, ...]

    @property
    def parameters(self) -> Array:
        return jnp.array(self.values)

    def initial(self, parameters: Array) -> ij.InitialState:
        return ij.InitialState(parameters[-2], parameters[-1])


def _pendulum(p: Array, law: ij.AbstractImpactLaw | ij.AbstractForceLaw) -> ij.ImpactOscillator:
    return ij.ImpactOscillator(ij.Pendulum(p[0], p[1], length=0.071), ij.Stop(law))


PENDULUM = ("omega_n", "zeta")
START = ("position", "velocity")
CASES: dict[str, Case] = {
    "pendulum, restitution": Case(
        lambda p: _pendulum(p, ij.Restitution(p[2])),
        (*PENDULUM, "r", *START),
        (13.47, 0.0017, 0.6, 0.7, 0.1),
    ),
    "pendulum, Kelvin-Voigt": Case(
        lambda p: _pendulum(p, ij.KelvinVoigt(p[2], p[3])),
        (*PENDULUM, "omega0", "gamma", *START),
        (13.47, 0.0017, 727.5, 0.18, 0.7, 0.1),
    ),
    "pendulum with dry friction, two stops": Case(
        lambda p: ij.ImpactOscillator(
            ij.Pendulum(p[0], p[1], length=0.071, dry_friction=p[2]),
            ij.Stop(ij.Restitution(p[3]), p[4]),
            ij.Stop(ij.KelvinVoigt(400.0, 0.1), p[5]),
        ),
        (*PENDULUM, "dry_friction", "r", "lower gap", "upper gap", *START),
        (10.97, 0.01, 0.7, 0.9, 0.3, 0.25, 0.1, 7.0),
    ),
    "linear oscillator": Case(
        lambda p: ij.ImpactOscillator(
            ij.LinearOscillator(p[0], p[1]), ij.Stop(ij.Restitution(p[2]), p[3])
        ),
        (*PENDULUM, "r", "gap", *START),
        (13.47, 0.01, 0.7, 0.3, 0.7, 1.0),
    ),
    "bouncing ball": Case(
        lambda p: ij.ImpactOscillator(ij.BouncingBall(p[0]), ij.Stop(ij.Restitution(p[1]))),
        ("gravity", "r", *START),
        (9.81, 0.9, 0.2, 0.0),
    ),
    "free mass on Kelvin-Voigt": Case(
        lambda p: ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.KelvinVoigt(p[0], p[1]))),
        ("omega0", "gamma", *START),
        (727.5, 0.18, 0.3, -1.0),
    ),
}

STEPS: dict[str, ij.AbstractStep] = {
    "Taylor": ij.TaylorStep(),
    "Dopri8": ij.RungeKutta(diffrax.Dopri8()),
    "Tsit5": ij.RungeKutta(diffrax.Tsit5()),
}

TIMES = np.linspace(0.0, 1.4, 141)
