"""The verb `fit_data`: data of any part, and a record of them → estimate."""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from impactjax._fit.estimate import Estimate
from impactjax._fit.fit import best_from, check_search
from impactjax._fit.starts import Starts
from impactjax._known import is_known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._parameter import as_parameter
from impactjax._problem.checks import check_bounds, check_sigma, check_value
from impactjax._problem.data_problem import DataProblem
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.noise import AbstractNoise, AutoregressiveNoise
from impactjax._problem.parameters import Handle
from impactjax._problem.parts import chosen
from impactjax._problem.prior import Normal
from impactjax._record.abstract_recording import Valid, counted
from impactjax._refusal import as_names, check_function, check_kind
from impactjax._types import Numbers

Part = TypeVar("Part", bound=eqx.Module)


def fit_data(
    data: Callable[[Part], Array],
    part: Part,
    record: Numbers,
    *,
    sigma: Numbers | None = None,
    free: Sequence[str] = (),
    fixed: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] = {},
    priors: Mapping[str, Normal] = {},
    loss: AbstractLoss = Squares(),
    noise: AbstractNoise = AutoregressiveNoise(),
    starts: Starts = Starts(1),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> Estimate[DataProblem[Part]]:
    """Least-squares fit of any data that a law, a mechanism or another hybrid system predicts.

    It is `fit` for systems of your own: `data` solves the part and returns what was measured, with
    exact derivatives. Parameters have the names, units and ranges that the fields of the part
    declare (`parameter`), also those of parts within it; if several have one name, it follows that
    of their place, as in `wall_r`. Other numbers of the part are held. `profiled`, `profiles`,
    `identifiability`, `predicted` and `ridge` take the estimate; its `system` is the fitted part.

    Works under `jit` and `vmap`.

    **Arguments:**

    - `data`: differentiable function from the part to the data, in the shape of `record`. Another
      function, even one that does the same, is compiled anew.
    - `part`: law, mechanism, or a module that contains one with its start, with the values from
      which the search starts.
    - `record`: measured data, shape (times,) or (times, columns). Those that are not finite do not
      count.
    - `sigma`: standard deviation of the noise: one number, one for each column or one for each
      datum; estimated if `None`, as one for all.
    - `free`: names of parameters to fit although they are usually known.
    - `fixed`: names of parameters to take as known.
    - `bounds`: limits of fitted parameters, narrower than their own range, by name.
    - `priors`: prior knowledge of parameters, by name; usually known ones are then fitted.
    - `loss`, `noise`: as in `Experiment`. The noise of each column is correlated along the times.
    - `starts`, `optimiser`: as for `fit`.

    **Raises** `TypeError` for an argument of another type, and `ValueError` for a value out of
    range, a name that the part does not have or that is in two arguments, data of another shape
    than the record, a `sigma` that is not positive, and fewer data than parameters.
    """
    check_function("data", data)
    check_kind("part", part, eqx.Module, "TwoMasses(...)")
    check_search(starts, optimiser)
    check_kind("loss", loss, AbstractLoss, "Cauchy(0.01)")
    check_kind("noise", noise, AbstractNoise, "WhiteNoise()")
    fitted = _fitted(part, as_names("free", free), as_names("fixed", fixed), priors)
    for name, (low, high) in bounds.items():
        check_bounds(name, low, high, fitted, part)
    values = as_parameter(record)
    valid = _valid(values, fitted)
    common, sizes = _sizes(sigma, values)
    problem = DataProblem(
        data=data,
        part=part,
        record=jnp.where(valid, jnp.ravel(values.T), 0.0),
        counted=valid,
        names=tuple(fitted),
        columns=1 if values.ndim == 1 else values.shape[1],
        sigma=common,
        sizes=sizes,
        bounds=tuple((name, (float(low), float(high))) for name, (low, high) in bounds.items()),
        loss=loss,
        noise=noise,
        priors=dict(priors),
    )
    return best_from(problem, starts.lanes(problem), optimiser)


def _fitted(
    part: eqx.Module, free: Sequence[str], fixed: Sequence[str], priors: Mapping[str, Normal]
) -> dict[str, Handle]:
    """The parameters to be fitted, by name."""
    for name, prior in priors.items():
        check_kind(f"priors[{name!r}]", prior, Normal, "Normal(0.02, 1e-4)")
    if both := sorted({*free, *priors} & {*fixed}):
        raise ValueError(f"`{both[0]}` is in `fixed` and is to be fitted.")
    found = chosen(part, [*free, *priors], fixed)
    for name, handle in found.items():
        check_value(name, handle.get(part), handle.allowed)
    return found


def _valid(record: Array, fitted: Mapping[str, Handle]) -> Valid:
    """Mask of the data that count, column by column."""
    if record.ndim not in (1, 2) or record.size == 0:
        raise ValueError(
            "Argument `record` must be a list of numbers, or of rows of them, but its shape is "
            f"{record.shape}."
        )
    valid = counted(jnp.ravel(record.T), None)
    count = int(np.asarray(valid).sum()) if is_known(valid) else record.size
    if count <= len(fitted):
        raise ValueError(
            f"The record has {count} data, too few for {len(fitted)} parameters "
            f"({', '.join(fitted)}); fix some of them."
        )
    return valid


def _sizes(sigma: Numbers | None, record: Array) -> tuple[Array | None, Array | None]:
    """The standard deviation of all residuals, and the sizes of noise by which each is divided."""
    if sigma is None:
        return None, None
    check_sigma(sigma)
    given = jnp.asarray(sigma, record.dtype)
    if not given.shape:
        return given, None
    try:
        each = jnp.broadcast_to(given, record.shape)
    except ValueError as error:
        raise ValueError(
            "Argument `sigma` must be one number, one for each column or one for each datum, but "
            f"its shape is {given.shape}, and that of the record {record.shape}."
        ) from error
    return jnp.ones((), record.dtype), jnp.ravel(each.T)
