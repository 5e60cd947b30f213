"""The verb `joint_information`: information in several experiments together."""

from collections.abc import Sequence

import numpy as np

from impactjax._identify.information import About, Information, scaled
from impactjax._known import is_known, namespace
from impactjax._refusal import as_names, check_kind


def joint_information(parts: Sequence[Information], *, shared: Sequence[str] = ()) -> Information:
    """Fisher information in several experiments together: about a slow and a fast drop, a motion
    and contact durations, repeats.

    Parameters of the model are the same in all parts that have them. Those of initial state,
    release and sensor belong to one part each; their names get its number: `theta0[1]`. Prior
    knowledge that several parts have counts as often: give it to one of them.

    **Arguments:**

    - `parts`: results of `information` or `information_in`, at the same values.
    - `shared`: names of further parameters that are the same in all parts, such as the initial
      state of one motion seen by two sensors.

    **Raises** `ValueError` if there is no part, for a name that no part has, and for a shared
    parameter or one of the model that has different values or units.
    """
    if isinstance(parts, Information):
        parts = [parts]
    check_kind("parts", parts, Sequence, "[information(experiment)]")
    if not parts:
        raise ValueError("There is no information to join.")
    for each in parts:
        check_kind("parts", each, Information, "information(experiment)")
    shared = as_names("shared", shared)
    for name in shared:
        if not any(name in each.names for each in parts):
            raise ValueError(f"No part has a parameter `{name}`.")
    if len(parts) == 1:
        return parts[0]
    xp = namespace(*parts)
    found: dict[str, tuple[str, bool, bool, object]] = {}
    for i, part in enumerate(parts):
        for name, unit, positive, own, value in zip(
            _names(part, i, shared),
            part.units,
            part.positive,
            part.of_model,
            part.values,
            strict=True,
        ):
            if name in found and found[name][0] != unit:
                raise ValueError(f"Parameter `{name}` has different units in the parts.")
            if name in found and not _same(found[name][3], value):
                raise ValueError(f"Parameter `{name}` has different values in the parts.")
            found.setdefault(name, (unit, positive, own, value))
    names = tuple(found)
    units, positive, of_model, values = zip(*found.values(), strict=True)
    rows = []
    for i, part in enumerate(parts):
        places = np.array([names.index(name) for name in _names(part, i, shared)])
        spread = np.zeros((len(places), len(names)))
        spread[np.arange(len(places)), places] = 1
        rows.append(part.sensitivities / part.scale @ xp.asarray(spread, part.scale.dtype))
    about = About(names, units, positive, of_model)
    return scaled(about, xp.stack(values), xp.concatenate(rows))


def _names(part: Information, number: int, shared: Sequence[str]) -> list[str]:
    pairs = zip(part.names, part.of_model, strict=True)
    return [name if own or name in shared else f"{name}[{number}]" for name, own in pairs]


def _same(one: object, other: object) -> bool:
    """True unless two values are known to differ."""
    return not is_known((one, other)) or bool(np.allclose(np.asarray(one), np.asarray(other)))
