"""The oscillators by the names of the command line."""

from collections.abc import Callable, Mapping

from impactjax._model.bouncing_ball import BouncingBall
from impactjax._model.free_mass import FreeMass
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._model.linear_oscillator import LinearOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.pendulum import Pendulum

Known = Mapping[str, float]  # parameters that are known beforehand


def _pendulum(known: Known, dry: bool) -> Pendulum:
    return Pendulum(
        known.get("omega_n", 10.0),
        known.get("zeta", 0.01),
        length=known.get("length"),
        mass=known.get("mass", 1.0),
        dry_friction=known.get("dry_friction", 0.1) if dry else None,
    )


def _linear_oscillator(known: Known, dry: bool) -> LinearOscillator:
    return LinearOscillator(
        known.get("omega_n", 10.0),
        known.get("zeta", 0.01),
        mass=known.get("mass", 1.0),
        dry_friction=known.get("dry_friction", 0.1) if dry else None,
    )


def _bouncing_ball(known: Known, dry: bool) -> BouncingBall:
    del dry
    return BouncingBall(known.get("gravity", STANDARD_GRAVITY), mass=known.get("mass", 1.0))


def _free_mass(known: Known, dry: bool) -> FreeMass:
    del dry
    return FreeMass(known.get("mass", 1.0))


OSCILLATORS: dict[str, Callable[[Known, bool], AbstractOscillator]] = {
    "pendulum": _pendulum,
    "linear-oscillator": _linear_oscillator,
    "bouncing-ball": _bouncing_ball,
    "free-mass": _free_mass,
}
