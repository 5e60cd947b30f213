"""The whole system: an oscillator and its stops."""

import equinox as eqx

from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.parameter import Requirement, raise_if_violated
from impactjax._model.stop import Stop


class ImpactOscillator(eqx.Module):
    """An oscillator that moves freely between at most two stops.

    **Arguments:**

    - `oscillator`: what moves.
    - `lower`: the stop below, if any.
    - `upper`: the stop above, if any.
    """

    oscillator: AbstractOscillator
    lower: Stop | None = None
    upper: Stop | None = None

    def requirements(self) -> tuple[Requirement, ...]:
        """What its parameters must satisfy, those of all parts included."""
        own: tuple[Requirement, ...] = ()
        if self.lower is not None and self.upper is not None:
            apart = self.lower.gap + self.upper.gap > 0
            own = (Requirement(apart, "the lower stop must be below the upper one"),)
        stops = [stop for stop in (self.lower, self.upper) if stop is not None]
        return (
            *self.oscillator.requirements(),
            *(requirement for stop in stops for requirement in stop.requirements()),
            *own,
        )

    def __check_init__(self) -> None:
        raise_if_violated(self, self.requirements())
