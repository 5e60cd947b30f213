"""Loss, noise and prior knowledge in the problem of a single record."""

import abc
import dataclasses
from collections.abc import Sequence
from typing import Generic, TypeVar

import equinox as eqx
import jax
from jaxtyping import Array, Float, Key

from impactjax._known import AnyArray
from impactjax._optimise.linearisation import Vector
from impactjax._problem.abstract_problem import AbstractProblem, Answer, Assumed
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.noise import AbstractNoise
from impactjax._problem.prior import Normal, PriorRows, prior_rows

Own = TypeVar("Own", bound="AbstractSingleProblem[eqx.Module]")
Fitted = TypeVar("Fitted", bound=eqx.Module, covariant=True)


class AbstractSingleProblem(AbstractProblem, Generic[Fitted]):
    """The least-squares problem of one record.

    - `loss`, `noise`: assumptions about the residuals.
    - `priors`: prior knowledge of parameters. It is no part of the residuals.
    - `weight`: variance of a residual against which priors are weighed, if a fit has found it.
    """

    loss: eqx.AbstractVar[AbstractLoss]
    noise: eqx.AbstractVar[AbstractNoise]
    priors: eqx.AbstractVar[dict[str, Normal]]
    weight: eqx.AbstractVar[Float[AnyArray, "..."] | None]

    @abc.abstractmethod
    def system_with(self, values: Vector) -> Fitted:
        """The system with fitted parameters set, in their natural units, and tied ones computed."""

    def assumed(self) -> Assumed:
        return Assumed(self.loss, self.noise)

    def is_classical(self) -> bool:
        return self.variance() is not None and isinstance(self.loss, Squares)

    @property
    def sizes_found(self) -> int:
        return int(self.variance() is None)

    def share(self, index: int, rows: Float[AnyArray, "observations ..."]) -> AnyArray:
        del index
        return rows

    def joined(self, values: Vector, answers: Sequence[Answer]) -> Answer:
        del values
        (only,) = answers
        return only

    def known_before(self) -> dict[str, Normal]:
        return dict(self.priors)

    def prior_rows(self, values: Vector) -> PriorRows:
        return prior_rows(self.priors, self.names, values)

    def prior_weight(self) -> Float[AnyArray, "..."] | None:
        return self.variance() if self.is_classical() else self.weight

    @property
    def weighs_anew(self) -> bool:
        return bool(self.priors) and not self.is_classical()

    def weighed(self: Own, variance: Float[AnyArray, "..."] | None) -> Own:
        return dataclasses.replace(self, weight=variance) if self.priors else self

    def remeasured(self: Own, values: Vector, key: Key[Array, ""]) -> Own:
        keys = jax.random.split(key, max(len(self.priors), 1))
        drawn = {
            name: Normal(
                values[self.names.index(name)]
                + prior.sigma * jax.random.normal(own, (), values.dtype),
                prior.sigma,
            )
            for own, (name, prior) in zip(keys, self.priors.items(), strict=False)
        }
        return dataclasses.replace(self, priors=drawn)

    def of_record(self: Own) -> Own:
        return dataclasses.replace(self, priors={}, weight=None)
