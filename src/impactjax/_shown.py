"""The `repr` of objects, with their numbers."""

import dataclasses
from typing import Any

import jax
import numpy as np
from jax.core import Tracer

_FEW = 6  # most numbers of an array to show; a longer one appears as type and shape


def with_numbers(self: Any) -> str:  # noqa: ANN401  any dataclass
    """The `repr` of an object: its class and the fields that differ from their defaults, such as
    `Pendulum(omega_n=13.0, zeta=0.002, length=0.071)`.
    """
    fields = dataclasses.fields(self)
    values = {field.name: getattr(self, field.name) for field in fields if field.repr}
    defaults = {field.name: field.default for field in fields}
    told = [
        f"{name}={_value(value)}"
        for name, value in values.items()
        if not _is_default(value, defaults[name])
    ]
    return f"{type(self).__name__}({', '.join(told)})"


def _value(value: object) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key!r}: {_value(each)}' for key, each in value.items())}}}"
    if isinstance(value, Tracer) or not isinstance(value, jax.Array | np.ndarray):
        return repr(value)
    array = np.asarray(value)
    if array.size > _FEW:
        return f"{array.dtype}{list(array.shape)}"
    return repr(array.tolist()) if array.ndim else str(array[()])


def _is_default(value: object, default: object) -> bool:
    if default is dataclasses.MISSING:
        return False
    if isinstance(value, jax.Array | np.ndarray) and not isinstance(value, Tracer):
        number = isinstance(default, int | float) and np.ndim(value) == 0
        return number and float(np.asarray(value)) == default
    return value is default or (type(value) is type(default) and repr(value) == repr(default))
