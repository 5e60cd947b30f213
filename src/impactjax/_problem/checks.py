"""Checks of the names and values that a fit is asked for."""

import difflib
from collections.abc import Collection, Mapping
from functools import reduce

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import ArrayLike

from impactjax._known import is_known
from impactjax._parameter import Range, as_parameter
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import Handle, handles
from impactjax._sensor.system import System


def check_requests(experiment: Experiment, system: System) -> None:
    """Checks that names exist, that none is in two arguments, and that ties can be evaluated."""
    known = handles(system)
    ties = dict(experiment.ties)
    asked = {"fixed": tuple(experiment.fixed), "free": experiment.free, "ties": tuple(ties)}
    seen: dict[str, str] = {}
    for argument, names in asked.items():
        for name in names:
            check_known(name, known)
            if seen.setdefault(name, argument) != argument:
                raise ValueError(f"`{name}` is in both `{seen[name]}` and `{argument}`.")
    for name in experiment.priors:
        check_known(name, known)
    for name, value in experiment.fixed.items():
        if value is not None:
            check_value(name, value, known[name].allowed)
    at = {name: handle.get(system) for name, handle in known.items() if name not in ties}
    for name, tie in ties.items():
        try:
            value = jnp.asarray(tie(at))
        except KeyError as error:
            raise ValueError(
                f"The tie of `{name}` asks for {error}, which is no parameter or tied itself."
            ) from error
        if value.shape != known[name].get(system).shape:
            raise ValueError(f"The tie of `{name}` gives shape {value.shape}, not one number.")


def check_priors(priors: Collection[str], names: Collection[str]) -> None:
    """Raises `ValueError` for prior knowledge of a parameter that is not fitted."""
    for name in priors:
        if name not in names:
            raise ValueError(
                f"`priors` speak of `{name}`, which is not fitted; {', '.join(names)} are."
            )


def check_value(name: str, value: ArrayLike, allowed: Range) -> None:
    """Checks that a value is one number, and in range unless it is traced."""
    number = as_parameter(value)
    if number.ndim != 0:
        raise ValueError(f"`{name}` must be one number, but its shape is {number.shape}.")
    if not isinstance(number, Tracer) and not bool(allowed.holds(number)):
        raise ValueError(f"`{name}` must be {allowed.describe()}, but it is {float(number):g}.")


def check_bounds(
    name: str, low: float, high: float, fitted: Mapping[str, Handle], part: eqx.Module
) -> None:
    """Checks that bounds belong to a fitted parameter of a part, lie in its range and enclose its
    starting value.
    """
    check_known(name, fitted)
    handle = fitted[name]
    if low < handle.allowed.low or high > handle.allowed.high:
        raise ValueError(
            f"The bounds of `{name}`, {low:g} and {high:g}, must lie within its range: it must be "
            f"{handle.allowed.describe()}."
        )
    value = handle.get(part)
    if not isinstance(value, Tracer) and not low <= float(value) <= high:
        raise ValueError(
            f"`{name}` starts at {float(value):g}, outside its bounds {low:g} and {high:g}."
        )


def check_sigma(sigma: object) -> None:
    """Raises `TypeError` for what is no number, and `ValueError` for one that is not positive."""
    if not is_known(sigma):
        return
    if np.asarray(sigma).dtype.kind not in "iuf":
        raise TypeError(f"Argument `sigma` must be a number, or several, but it is {sigma!r}.")
    if not np.all(np.asarray(sigma) > 0):
        raise ValueError(f"Argument `sigma` must be positive, but it is {sigma}.")


def check_known(name: str, known: Collection[str]) -> None:
    """Checks that a parameter of that name exists; the error suggests a similar name."""
    if name in known:
        return
    close = difflib.get_close_matches(name, known, 1)
    remedy = f"did you mean `{close[0]}`?" if close else f"there are {', '.join(known)}."
    raise ValueError(f"There is no parameter `{name}`; {remedy}")


def check_declared(system: System, found: Collection[int] = ()) -> None:
    """Checks that each number of the model is a declared parameter, or a weight.

    Arrays of several numbers are not checked: they are weights, for `learn` to find.

    **Arguments:**

    - `system`: contains the model.
    - `found`: indices of the leaves of the system that `learn` finds.
    """
    leaves, structure = jax.tree.flatten(system)
    numbered = jax.tree.unflatten(structure, range(len(leaves)))
    declared = {reduce(getattr, each.path, numbered) for each in handles(system).values()}
    for path, place in jax.tree_util.tree_leaves_with_path(numbered.model):
        if _is_number(leaves[place]) and place not in declared and place not in found:
            where = "model" + jax.tree_util.keystr(path)
            raise ValueError(
                f"{where} is a number without a unit and a range, so that no fit would find it: "
                "declare its field by `metadata=parameter(unit)`, with `known=True` if it is not "
                "to be found, or by `static=True`."
            )


def _is_number(leaf: object) -> bool:
    if not isinstance(leaf, float | np.ndarray | np.generic | jax.Array):
        return False
    return jnp.ndim(leaf) == 0 and jnp.issubdtype(jnp.result_type(leaf), jnp.inexact)
