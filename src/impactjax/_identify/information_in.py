"""The verb `information_in`: Fisher information in any data about parameters."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._identify.information import Information, PerParameter, informed
from impactjax._known import AnyArray
from impactjax._problem.checks import check_sigma
from impactjax._problem.parameters import with_values
from impactjax._problem.parts import chosen
from impactjax._refusal import as_names, check_function, check_kind, returned
from impactjax._types import Numbers, Scalar

Part = TypeVar("Part", bound=eqx.Module)


def information_in(
    data: Callable[[Part], Array],
    part: Part,
    sigma: Numbers,
    *,
    free: Sequence[str] = (),
    fixed: Sequence[str] = (),
) -> Information:
    """Fisher information that data would contain about the parameters of a law, a model or any
    part of it.

    Works under `jit` and `vmap`. Source of the terms: Transtrum et al., J. Chem. Phys. 143, 010901
    (2015).

    **Arguments:**

    - `data`: differentiable function from the part to the data: speeds, durations, a motion.
    - `part`: law, model or system, with the values around which to linearise.
    - `sigma`: standard deviation of the data's noise, one number or one for each datum.
    - `free`: names of parameters to include although they are usually known.
    - `fixed`: names of parameters to take as known.

    **Raises** `ValueError` for a name that the part does not have or that is in both lists, for a
    known `sigma` that is not positive, and if no parameter is left.
    """
    check_function("data", data)
    check_kind("part", part, eqx.Module, "KelvinVoigt(600.0, 0.2)")
    free, fixed = as_names("free", free), as_names("fixed", fixed)
    if both := sorted({*free} & {*fixed}):
        raise ValueError(f"`{both[0]}` is in both `free` and `fixed`.")
    check_sigma(sigma)
    parameters = chosen(part, free, fixed)
    values = jnp.stack([_number(name, each.get(part)) for name, each in parameters.items()])
    noise = jnp.asarray(sigma, values.dtype)

    def in_units(values: PerParameter) -> Float[AnyArray, " data"]:
        found = returned("data", data(with_values(part, [*parameters.values()], list(values))))
        if noise.shape and noise.shape != found.shape:
            raise ValueError(
                "Argument `sigma` must be one number or one for each datum, but its shape is "
                f"{noise.shape}, and that of the data {found.shape}."
            )
        return jnp.ravel(found / noise)

    return informed(parameters, values, jax.jacfwd(in_units)(values))


def _number(name: str, value: Scalar) -> Scalar:
    if value.shape:
        raise ValueError(f"`{name}` has shape {value.shape}, but must be one number: use `vmap`.")
    return value
