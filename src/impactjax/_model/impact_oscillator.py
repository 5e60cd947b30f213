"""The whole system: an oscillator and its stops."""

import dataclasses

import equinox as eqx

from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.stop import Stop
from impactjax._parameter import Requirement, raise_if_violated, range_requirements
from impactjax._refusal import of_kind
from impactjax._shown import with_numbers


class ImpactOscillator(eqx.Module):
    """An oscillator that moves freely between at most two stops.

    **Arguments:**

    - `oscillator`: equation of motion in free flight.
    - `lower`: stop below; none if `None`.
    - `upper`: stop above; none if `None`.
    """

    oscillator: AbstractOscillator = eqx.field(
        converter=of_kind("oscillator", AbstractOscillator, "Pendulum(13.0)")
    )
    lower: Stop | None = eqx.field(
        converter=of_kind("lower", Stop, "Stop(Restitution(0.7))", optional=True), default=None
    )
    upper: Stop | None = eqx.field(
        converter=of_kind("upper", Stop, "Stop(Restitution(0.7))", optional=True), default=None
    )

    def parts(self) -> dict[str, eqx.Module]:
        """All parts with parameters, by their path."""
        found: dict[str, eqx.Module] = {"oscillator": self.oscillator}
        for field in dataclasses.fields(self.oscillator):
            part = getattr(self.oscillator, field.name)
            if isinstance(part, eqx.Module):
                found[f"oscillator.{field.name}"] = part
        for name, stop in (("lower", self.lower), ("upper", self.upper)):
            if stop is not None:
                found |= {name: stop, f"{name}.law": stop.law}
        return found

    def requirements(self) -> list[Requirement]:
        """Conditions on the parameters of all parts."""
        own = []
        for name, part in self.parts().items():
            if name not in ("lower.law", "upper.law"):
                own += range_requirements(part)
        for stop in (self.lower, self.upper):
            if stop is not None:
                own += stop.law.requirements()
        if self.lower is not None and self.upper is not None:
            apart = self.lower.gap + self.upper.gap > 0
            own.append(Requirement(apart, "The lower stop must be below the upper one"))
        return own

    def __check_init__(self) -> None:
        raise_if_violated(self, self.requirements())

    __repr__ = with_numbers
