"""The parameters of a part of a model, or of the whole, by name."""

import dataclasses
from collections import Counter
from collections.abc import Iterator, Sequence

import equinox as eqx

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._parameter import Range, ranges
from impactjax._problem.parameters import Handle, handles
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import Start, System


def parameters_of(part: eqx.Module) -> dict[str, Handle]:
    """Path and range of each parameter of a part, by its name in a fit.

    Parameters of parts within parts are included. Those of several that have one name are called by
    their places, as in `wall_r` for the field `r` of the field `wall`.

    **Raises** `ValueError` if two still have one name.
    """
    if isinstance(part, System):
        return handles(part)
    if isinstance(part, ImpactOscillator):
        whole = handles(System(part, InitialState(0.0), Start(0.0), Sensor()))
        return {
            name: handle._replace(path=handle.path[1:])
            for name, handle in whole.items()
            if handle.path[0] == "model"
        }
    each = list(_within(part))
    times = Counter(path[-1] for path, _ in each)
    names = [path[-1] if times[path[-1]] == 1 else "_".join(path) for path, _ in each]
    found = dict(zip(names, (Handle(*own) for own in each), strict=True))
    if len(found) < len(names):
        (name, _), *_ = Counter(names).most_common(1)
        raise ValueError(f"Two parameters are called `{name}`: rename a field of your own class.")
    return found


def _within(part: eqx.Module) -> Iterator[tuple[tuple[str, ...], Range]]:
    """Path and range of each parameter of a part and of those within it."""
    for name, allowed in ranges(part).items():
        yield (name,), allowed
    for field in dataclasses.fields(part):
        inner = getattr(part, field.name)
        if isinstance(inner, eqx.Module):
            for path, allowed in _within(inner):
                yield (field.name, *path), allowed


def chosen(part: eqx.Module, free: Sequence[str], fixed: Sequence[str]) -> dict[str, Handle]:
    """The parameters that a fit would vary: those not usually measured separately.

    **Raises** `ValueError` for a name that the part does not have, and if nothing is left.
    """
    known = parameters_of(part)
    for name in (*free, *fixed):
        if name not in known:
            raise ValueError(f"There is no parameter `{name}`; there are {', '.join(known)}.")
    found = {
        name: handle
        for name, handle in known.items()
        if (name in free or not handle.allowed.known) and name not in fixed
    }
    if not found:
        raise ValueError(f"{type(part).__name__} has no parameter that is left free.")
    return found
