"""Parameters of a system by name: path, unit and range of each."""

from collections.abc import Iterator, Sequence
from functools import reduce
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._model.stop import Stop
from impactjax._parameter import Range, ranges
from impactjax._sensor.system import System
from impactjax._types import Scalar

Part = TypeVar("Part", bound=eqx.Module)


class Handle(NamedTuple):
    """Path of a parameter in a system or another part, and its range."""

    path: tuple[str, ...]
    allowed: Range

    def within(self, low: float, high: float) -> "Handle":
        """The same parameter with a narrower range."""
        allowed = self.allowed
        excludes_low = allowed.excludes_low and low <= allowed.low
        return self._replace(
            allowed=allowed._replace(low=low, high=high, excludes_low=excludes_low)
        )

    def get(self, part: eqx.Module) -> Scalar:
        """The parameter's value in a part."""
        return reduce(getattr, self.path, part)


def handles(system: System) -> dict[str, Handle]:
    """All parameters of a system by their names.

    **Raises** `ValueError` if two have one name.
    """
    found: dict[str, Handle] = {}
    for name, handle in (*_of_model(system), *_of_motion(system), *_of_sensor(system)):
        if name in found:
            first, second = (".".join(each.path) for each in (found[name], handle))
            raise ValueError(
                f"Two parameters are called `{name}`, {first} and {second}, so that a fit could "
                "not tell them apart; rename the field of your own class."
            )
        found[name] = handle
    return found


def _of_model(system: System) -> Iterator[tuple[str, Handle]]:
    both = system.model.lower is not None and system.model.upper is not None
    _, unit = _coordinate(system)
    for place, part in system.model.parts().items():
        for name, allowed in ranges(part).items():
            side = f"{place.split('.')[0]}_" if both and place != "oscillator" else ""
            own = allowed._replace(unit=unit) if isinstance(part, Stop) else allowed
            yield side + name, Handle(("model", *place.split("."), name), own)


def _of_motion(system: System) -> Iterator[tuple[str, Handle]]:
    symbol, unit = _coordinate(system)
    known = ranges(system.initial)
    place = known["position"]._replace(unit=unit)
    rate = known["velocity"]._replace(unit=f"{unit}/s")
    yield f"{symbol}0", Handle(("initial", "position"), place)
    yield f"{symbol}_dot0", Handle(("initial", "velocity"), rate)
    yield "t0", Handle(("start", "t0"), ranges(system.start)["t0"])


def _of_sensor(system: System) -> Iterator[tuple[str, Handle]]:
    units = {"offset": system.unit, "drift": f"{system.unit}/s"}
    for name, allowed in ranges(system.sensor).items():
        yield name, Handle(("sensor", name), allowed._replace(unit=units.get(name, allowed.unit)))
    if system.sensor.low_pass is not None:
        for name, allowed in ranges(system.sensor.low_pass).items():
            yield name, Handle(("sensor", "low_pass", name), allowed)


def _coordinate(system: System) -> tuple[str, str]:
    """Symbol and unit of the coordinate."""
    return ("theta", "rad") if system.model.oscillator.is_angle() else ("x", "m")


def replaced(system: System, names: Sequence[str], values: Sequence[ArrayLike]) -> System:
    """The system with some parameters set, by name."""
    known = handles(system)
    return with_values(system, [known[name] for name in names], values)


def with_values(part: Part, places: Sequence[Handle], values: Sequence[ArrayLike]) -> Part:
    """A part with some parameters set, by their handles."""
    return eqx.tree_at(
        lambda each: [reduce(getattr, place.path, each) for place in places],
        part,
        [jnp.asarray(value) for value in values],
    )
