"""Table of oscillators by the names of the command line."""

import dataclasses
from collections.abc import Callable, Mapping

from jaxtyping import ArrayLike

from impactjax._model.bouncing_ball import BouncingBall
from impactjax._model.free_mass import FreeMass
from impactjax._model.linear_oscillator import LinearOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.pendulum import Pendulum
from impactjax._parameter import parameter_of

DRY_FRICTION, DRAG = "dry_friction", "drag"
_TYPICAL = {DRY_FRICTION: 0.1, DRAG: 0.1, "length": 1.0}  # values of optional parameters

OSCILLATORS: dict[str, Callable[[], AbstractOscillator]] = {
    "pendulum": lambda: Pendulum(10.0, 0.01),
    "linear-oscillator": lambda: LinearOscillator(10.0, 0.01),
    "bouncing-ball": BouncingBall,
    "free-mass": FreeMass,
}


def with_known(
    oscillator: AbstractOscillator, values: Mapping[str, ArrayLike]
) -> AbstractOscillator:
    """An oscillator with some parameters set, including optional ones; names of other parameters
    are ignored.
    """
    return dataclasses.replace(
        oscillator, **{name: values[name] for name in _own(oscillator) if name in values}
    )


def complete(oscillator: AbstractOscillator) -> AbstractOscillator:
    """An oscillator with typical values for its optional parameters that are `None`."""
    absent = [name for name in _own(oscillator) if getattr(oscillator, name) is None]
    return with_known(
        oscillator, {name: value for name, value in _TYPICAL.items() if name in absent}
    )


def with_dry_friction(oscillator: AbstractOscillator) -> AbstractOscillator:
    """An oscillator with dry friction: its own, or a typical value."""
    return _with(oscillator, DRY_FRICTION)


def with_drag(oscillator: AbstractOscillator) -> AbstractOscillator:
    """An oscillator with quadratic drag: its own, or a typical value."""
    return _with(oscillator, DRAG)


def _with(oscillator: AbstractOscillator, name: str) -> AbstractOscillator:
    if name in _own(oscillator) and getattr(oscillator, name) is not None:
        return oscillator
    return with_known(oscillator, {name: _TYPICAL[name]})


def is_dry(oscillator: AbstractOscillator) -> bool:
    """True if an oscillator has dry friction."""
    return may_be_dry(oscillator) and getattr(oscillator, DRY_FRICTION) is not None


def may_be_dry(oscillator: AbstractOscillator) -> bool:
    """True if an oscillator has a parameter for dry friction."""
    return DRY_FRICTION in _own(oscillator)


def may_have_drag(oscillator: AbstractOscillator) -> bool:
    """True if an oscillator has a parameter for quadratic drag."""
    return DRAG in _own(oscillator)


def _own(oscillator: AbstractOscillator) -> list[str]:
    """The names of an oscillator's parameters."""
    fields = dataclasses.fields(oscillator)
    return [field.name for field in fields if parameter_of(field) is not None]
