"""Checks of arguments that every run has, with a readable error for each mistake."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import ArrayLike

from impactjax._known import AnyArray
from impactjax._types import Numbers


def as_number(name: str, value: ArrayLike) -> AnyArray:
    """A real number; a known one stays known under `jit`."""
    number = real(name, value)
    if number.ndim != 0:
        raise ValueError(f"Argument `{name}` must be one number, but its shape is {number.shape}.")
    return number


def as_times(ts: Numbers) -> AnyArray:
    """A list of at least one time."""
    times = real("ts", ts)
    if times.ndim != 1 or times.size == 0:
        raise ValueError(
            f"Argument `ts` must be a list of at least one time, but it has shape {times.shape}."
        )
    return times


def real(name: str, value: Numbers) -> AnyArray:
    """An array of real numbers; known ones stay known under `jit`."""
    array = value if isinstance(value, jax.Array) else np.asarray(value)
    if not (jnp.issubdtype(array.dtype, jnp.floating) or jnp.issubdtype(array.dtype, jnp.integer)):
        raise TypeError(f"Argument `{name}` must be made of real numbers, but it is {value!r}.")
    return array


def check_order(t0: AnyArray, ts: AnyArray) -> None:
    """Checks that times are finite and increase, unless they are traced."""
    if isinstance(ts, Tracer) or isinstance(t0, Tracer):
        return
    times = np.concatenate([np.atleast_1d(np.asarray(t0)), np.asarray(ts)])
    if not np.all(np.isfinite(times)):
        raise ValueError("Arguments `ts` and `t0` must be finite.")
    if np.any(np.diff(times[1:]) <= 0):
        where = int(np.argmax(np.diff(times[1:]) <= 0)) + 1
        raise ValueError(
            f"Argument `ts` must increase strictly, but ts[{where}] = {times[where + 1]} follows "
            f"{times[where]}."
        )
    if times[0] > times[1]:
        raise ValueError(
            f"Argument `ts` must not begin before the start, but {times[1]} < t0 = {times[0]}."
        )


def as_tolerance(tolerance: ArrayLike | None, dtype: np.dtype) -> AnyArray:
    """A tolerance that numbers of a type can meet; 1e-8, or 1e-5 in single precision, if left out.

    **Raises** `ValueError` for one below the resolution of the numbers.
    """
    usual = 1e-8 if jnp.finfo(dtype).bits > 32 else 1e-5
    allowed = as_number("tolerance", usual if tolerance is None else tolerance)
    check_tolerance(allowed, dtype)
    return allowed


def check_tolerance(tolerance: AnyArray, dtype: np.dtype) -> None:
    """Checks that a tolerance is not below the resolution of the numbers, unless it is traced."""
    if isinstance(tolerance, Tracer):
        return
    floor = 10 * float(jnp.finfo(dtype).eps)
    if not np.all(np.asarray(tolerance) >= floor):
        raise ValueError(
            f"Argument `tolerance` must be at least {floor:.2e} in {jnp.dtype(dtype).name}, but it "
            f"is {tolerance}. Double precision (`jax_enable_x64`) gives more."
        )
