"""The verb `information_in`: Fisher information in any data about parameters."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._identify.information import Information, PerParameter, informed
from impactjax._identify.parameters import chosen
from impactjax._known import AnyArray, is_known
from impactjax._problem.parameters import with_values
from impactjax._types import Numbers

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
    if both := sorted({*free} & {*fixed}):
        raise ValueError(f"`{both[0]}` is in both `free` and `fixed`.")
    if is_known(sigma) and not np.all(np.asarray(sigma) > 0):
        raise ValueError(f"Argument `sigma` must be positive, but it is {sigma}.")
    parameters = chosen(part, free, fixed)
    values = jnp.stack([each.get(part) for each in parameters.values()])
    noise = jnp.asarray(sigma, values.dtype)

    def in_units(values: PerParameter) -> Float[AnyArray, " data"]:
        return jnp.ravel(data(with_values(part, [*parameters.values()], list(values))) / noise)

    return informed(parameters, values, jax.jacfwd(in_units)(values))
