"""Residuals of any data against a record, as a function of the named parameters of a part."""

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from impactjax._known import AnyArray, namespace
from impactjax._optimise.linearisation import Vector
from impactjax._parameter import plain
from impactjax._problem.abstract_problem import Answer, Number
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.misfit import exceeds_noise, misfit
from impactjax._problem.noise import AbstractNoise, AutoregressiveNoise
from impactjax._problem.parameters import Handle, with_values
from impactjax._problem.parts import parameters_of
from impactjax._problem.prior import Normal
from impactjax._problem.single_problem import AbstractSingleProblem
from impactjax._record.abstract_recording import Residuals, Valid
from impactjax._refusal import returned
from impactjax._simulate.impact_log import ImpactLog
from impactjax._types import Flag, Scalar

if TYPE_CHECKING:
    from impactjax._problem.problem import Problem

Part = TypeVar("Part", bound=eqx.Module)


class DataProblem(AbstractSingleProblem[Part]):
    """The least-squares problem of a record that is a function of a part's parameters.

    - `data`: function from the part to the data, one number for each time, or a row of them.
    - `part`: with the values from which a search starts.
    - `record`: measured data, column by column.
    - `counted`: mask of those that count.
    - `names`: names of the fitted parameters.
    - `columns`: number of data at one time.
    - `sigma`: standard deviation of a residual, if it is known.
    - `sizes`: of the noise of each datum, by which residuals are divided; `None` if they are not.
    - `bounds`: limits of parameters, narrower than their own range, by name.
    - `loss`, `noise`, `priors`, `weight`: as in `Problem`.
    """

    data: Callable[[Part], Array] = eqx.field(static=True)
    part: Part
    record: Float[AnyArray, " observations"]
    counted: Valid
    names: tuple[str, ...] = eqx.field(static=True)
    columns: int = eqx.field(static=True, default=1)
    sigma: Float[AnyArray, ""] | None = None
    sizes: Float[AnyArray, " observations"] | None = None
    bounds: tuple[tuple[str, tuple[float, float]], ...] = eqx.field(static=True, default=())
    loss: AbstractLoss = Squares()
    noise: AbstractNoise = AutoregressiveNoise()
    priors: dict[str, Normal] = eqx.field(default_factory=dict)
    weight: Float[AnyArray, "..."] | None = None

    def system_with(self, values: Vector) -> Part:
        return with_values(self.part, [*self.handles().values()], [*jnp.asarray(values)])

    def each_recording(self) -> "list[tuple[Problem, tuple[int, ...]]]":
        return []

    def handles(self) -> dict[str, Handle]:
        known = parameters_of(self.part)
        for name, (low, high) in self.bounds:
            known[name] = known[name].within(low, high)
        return {name: known[name] for name in self.names}

    @property
    def valid(self) -> Valid:
        return self.counted

    def first(self, share: float) -> Valid:
        count = self.record.shape[-1] // self.columns
        rows = np.tile(np.arange(count), self.columns)
        return plain(self.valid) & (rows <= share * (count - 1))

    def residuals(self, values: Vector) -> Residuals:
        data = returned("data", self.data(self.system_with(values)))
        rows = jnp.ravel(data.T)
        if rows.shape != self.record.shape:
            count, columns = self.record.shape[-1] // self.columns, self.columns
            wanted = (count,) if columns == 1 else (count, columns)
            raise ValueError(
                f"Argument `data` must return the shape of the record, {wanted}, but it returns "
                f"{data.shape}."
            )
        difference = rows - self.record
        scaled = difference if self.sizes is None else difference / self.sizes
        return jnp.where(self.valid, scaled, 0.0)

    def answer(self, values: Vector, logged: Flag | None = None) -> Answer:
        del logged

        def twice(values: Vector) -> tuple[Residuals, Residuals]:
            found = self.residuals(values)
            return found, found

        jacobian, residuals = jax.jacfwd(twice, has_aux=True)(values)
        return Answer(residuals, _no_impacts(residuals), jacobian)

    def starting_values(self) -> list[Scalar]:
        return [handle.get(self.part) for handle in self.handles().values()]

    def variance(self) -> Number | None:
        return None if self.sigma is None else self.sigma**2

    def shifted(self, rows: Residuals) -> "DataProblem[Part]":
        moved = rows if self.sizes is None else rows * self.sizes
        return dataclasses.replace(self, record=self.record - moved)

    def misfit(self, residuals: Residuals) -> Number:
        scaled = plain(self.record) if self.sizes is None else plain(self.record / self.sizes)
        valid, xp = plain(self.valid), namespace(scaled, self.valid)
        mean = xp.sum(xp.where(valid, scaled, 0.0)) / xp.sum(valid).astype(scaled.dtype)
        return misfit(xp.sum(xp.where(valid, scaled - mean, 0.0) ** 2), residuals)

    def exceeds_noise(self, residuals: Residuals, impacts: ImpactLog) -> Bool[AnyArray, ""]:
        del impacts
        none = namespace(residuals).zeros(residuals.shape, bool)
        return exceeds_noise(residuals, plain(self.valid), none, self.variance())

    @property
    def log_units(self) -> Number:
        if self.sizes is None:
            return np.zeros(())
        xp = namespace(self.sizes, self.valid)
        return xp.sum(xp.where(self.valid, xp.log(self.sizes), 0.0))


def _no_impacts(like: Residuals) -> ImpactLog:
    """The impact log of data in which no impact is told apart."""
    none = jnp.zeros(1, like.dtype)
    count, stop, complete = jnp.int32(0), jnp.zeros(1, jnp.int32), jnp.zeros(1, bool)
    return ImpactLog(count, none, stop, none, none, none, none, none, complete)
