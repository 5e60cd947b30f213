"""All that a fit may vary, and its parameters by name."""

from collections.abc import Sequence
from functools import reduce
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._measure.sensor import Sensor
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.parameter import Range, as_parameter, parameter, ranges
from impactjax._simulate.simulate import InitialState
from impactjax._types import Scalar, Time

Part = TypeVar("Part", bound=eqx.Module)


class Start(eqx.Module):
    """When a run starts.

    - `t0`: time of the initial state [s].
    """

    t0: Time = eqx.field(converter=as_parameter, metadata=parameter("s", known=True))


class System(eqx.Module):
    """What a fit is about; `unit` is that of the recording."""

    model: ImpactOscillator
    initial: InitialState
    start: Start
    sensor: Sensor
    unit: str = eqx.field(static=True, default="")


class Handle(NamedTuple):
    """Where a parameter is in a system or another part, and what it may be."""

    path: tuple[str, ...]
    allowed: Range

    def get(self, part: eqx.Module) -> Scalar:
        """Its value."""
        return reduce(getattr, self.path, part)


def handles(system: System) -> dict[str, Handle]:
    """All parameters of a system by their names."""
    angle = system.model.oscillator.is_angle()
    coordinate, unit = ("theta", "rad") if angle else ("x", "m")
    found: dict[str, Handle] = {}
    both = system.model.lower is not None and system.model.upper is not None
    for place, part in system.model.parts().items():
        for name, allowed in ranges(part).items():
            side = f"{place.split('.')[0]}_" if both and place != "oscillator" else ""
            found[side + name] = Handle(("model", *place.split("."), name), allowed)
    for name, allowed in ranges(system.initial).items():
        rate = name == "velocity"
        symbol = f"{coordinate}_dot0" if rate else f"{coordinate}0"
        own = allowed._replace(unit=f"{unit}/s" if rate else unit)
        found[symbol] = Handle(("initial", name), own)
    found["t0"] = Handle(("start", "t0"), ranges(system.start)["t0"])
    for place in ("sensor", "sensor.low_pass"):
        part = reduce(getattr, place.split("."), system)
        if part is not None:
            for name, allowed in ranges(part).items():
                found[name] = Handle((*place.split("."), name), allowed)
    for name in ("gap", "lower_gap", "upper_gap"):
        if name in found:
            found[name] = found[name]._replace(allowed=found[name].allowed._replace(unit=unit))
    for name, unit in (("offset", system.unit), ("drift", f"{system.unit}/s")):
        found[name] = found[name]._replace(allowed=found[name].allowed._replace(unit=unit))
    return found


def replaced(system: System, names: Sequence[str], values: Sequence[ArrayLike]) -> System:
    """The system with some parameters set."""
    known = handles(system)
    return with_values(system, [known[name] for name in names], values)


def with_values(part: Part, places: Sequence[Handle], values: Sequence[ArrayLike]) -> Part:
    """A part with the parameters at some places set."""
    return eqx.tree_at(
        lambda each: [reduce(getattr, place.path, each) for place in places],
        part,
        [jnp.asarray(value) for value in values],
    )
