"""Motions of forced systems from period to period."""

import abc
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from impactjax._hybrid.system import State
from impactjax._response.period import Force
from impactjax._results import RESULTS
from impactjax._types import Flag, Scalar

System = TypeVar("System", bound=eqx.Module)
Told = TypeVar("Told")


class Counts(NamedTuple):
    """Numbers of periods that are kept, and left out before them."""

    keep: int
    skip: int


class Sampled(NamedTuple):
    """Stroboscopic states of a motion.

    - `states`: states after each period of the force.
    - `following`: start of a motion that goes on from there.
    - `result`: result code.
    """

    states: State
    following: PyTree
    result: RESULTS


class Growth(NamedTuple):
    """Growth of disturbances of a motion.

    - `logarithms`: logarithms of the growth in each period, for each direction.
    - `final`: the end of the motion.
    - `result`: result code.
    """

    logarithms: Float[Array, "periods directions"]
    final: PyTree
    result: RESULTS


class AbstractSampler(eqx.Module, Generic[System]):
    """Forced systems of one kind, which run from period to period."""

    force: eqx.AbstractVar[Force]

    def period(self, system: System) -> Scalar:
        """The period of the force on a system."""
        return jnp.asarray(self.force(system), float)

    @abc.abstractmethod
    def begun(self, system: System, start: PyTree) -> PyTree:
        """The start of a motion, as a call takes it."""

    @abc.abstractmethod
    def __call__(self, system: System, begun: PyTree) -> Sampled:
        """The states of one motion."""

    @abc.abstractmethod
    def growth(self, system: System, begun: PyTree) -> Growth:
        """The growth of disturbances of one motion, in each period that is kept."""

    @abc.abstractmethod
    def side_by_side(self, motion: Callable[[PyTree], Told], lanes: PyTree) -> Told:
        """Results of a function of the motion of each lane."""


def without_disturbances(skip: int) -> int:
    """Number of periods that a motion runs alone before the disturbances begin, of those that are
    left out: directions settle in fewer periods than motions.
    """
    return skip - -(-skip // 10)


def chosen(good: Flag, yes: PyTree, no: PyTree) -> PyTree:
    """One of two trees of arrays."""
    return jax.tree.map(lambda new, old: jnp.where(good, new, old), yes, no)
