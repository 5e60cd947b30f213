"""Origin of the period of an orbit: a force, or the motion itself."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._hybrid.system import HybridSystem
from impactjax._known import AnyArray
from impactjax._response.period import Force
from impactjax._types import Scalar

Numbers = Float[AnyArray, " numbers"]


class AbstractRhythm(eqx.Module):
    """Origin of the period of an orbit."""

    @abc.abstractmethod
    def is_free(self) -> bool:
        """True if the period is an unknown. Orbits may then start at any time: one is chosen."""

    @abc.abstractmethod
    def period(self, system: HybridSystem, elapsed: Scalar) -> Scalar:
        """The period of an orbit whose segments take the time `elapsed`."""

    @abc.abstractmethod
    def end(self, system: HybridSystem, y: Float[Array, " numbers"], duration: Scalar) -> Scalar:
        """A function of the state after a period that is zero at the end of an orbit without
        events.
        """

    @abc.abstractmethod
    def near(self, y: Numbers, rate: Numbers) -> "AbstractRhythm":
        """The same for orbits near one that starts at a state with this rate."""


class OfForce(AbstractRhythm):
    """The period of a force, as a function of the system."""

    force: Force

    def is_free(self) -> bool:
        return False

    def period(self, system: HybridSystem, elapsed: Scalar) -> Scalar:
        return jnp.asarray(self.force(system), elapsed.dtype)

    def end(self, system: HybridSystem, y: Float[Array, " numbers"], duration: Scalar) -> Scalar:
        del y
        return duration - self.period(system, duration)

    def near(self, y: Numbers, rate: Numbers) -> "OfForce":
        del y, rate
        return self


class OfMotion(AbstractRhythm):
    """The period of a system that does not depend on time.

    Events tell where an orbit is. One without events starts on the plane through a state of a
    nearby orbit, across the rate there: (y − `state`) · `rate` = 0.
    """

    state: Numbers
    rate: Numbers

    def is_free(self) -> bool:
        return True

    def period(self, system: HybridSystem, elapsed: Scalar) -> Scalar:
        del system
        return elapsed

    def end(self, system: HybridSystem, y: Float[Array, " numbers"], duration: Scalar) -> Scalar:
        del system, duration
        return (y - self.state) @ jnp.asarray(self.rate)

    def near(self, y: Numbers, rate: Numbers) -> "OfMotion":
        return OfMotion(y, rate)
