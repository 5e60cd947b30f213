"""Surfaces on which a section is taken."""

import abc
from collections.abc import Callable, Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

from impactjax._hybrid.lane import Start
from impactjax._hybrid.system import HybridSystem, Mode, State, Tail, Transition
from impactjax._known import is_known
from impactjax._parameter import as_parameter
from impactjax._types import Code, Scalar


class AbstractSurface(eqx.Module):
    """Surface on which a section is taken."""

    @abc.abstractmethod
    def among(self) -> int | None:
        """The number of the transition of the system that is the surface, or `None`."""

    @abc.abstractmethod
    def guard(self, t: Scalar, y: State, mode: Mode, number: Code) -> ArrayLike:
        """A function that falls through zero at the surface, after `number` crossings."""

    @abc.abstractmethod
    def first(self, t: ArrayLike) -> ArrayLike:
        """The number with which a run that starts at `t` counts its crossings from."""


class Every(AbstractSurface):
    """The times `phase` + n `period`, for a stroboscopic section.

    - `period`: positive.
    - `phase`: one of the times; 0 if left out.
    """

    period: Array = eqx.field(converter=as_parameter)
    phase: Array = eqx.field(converter=as_parameter, default=0.0)

    def __check_init__(self) -> None:
        if is_known(self.period) and not self.period > 0:
            raise ValueError(f"Argument `period` must be positive, but it is {self.period}.")

    def among(self) -> None:
        return None

    def guard(self, t: Scalar, y: State, mode: Mode, number: Code) -> ArrayLike:
        del y, mode
        return self.phase + number.astype(t.dtype) * self.period - t

    def first(self, t: ArrayLike) -> ArrayLike:
        return jnp.floor((t - self.phase) / self.period) + 1


class AtTransition(AbstractSurface):
    """The events of one transition of the system.

    - `number`: of the transition, from 0.
    """

    number: int = eqx.field(static=True)

    def among(self) -> int:
        return self.number

    def guard(self, t: Scalar, y: State, mode: Mode, number: Code) -> ArrayLike:
        del y, mode, number
        return jnp.ones_like(t)

    def first(self, t: ArrayLike) -> ArrayLike:
        del t
        return 0


class Through(AbstractSurface):
    """The surface on which a function of time, state and mode falls from positive to negative.

    - `function`: g(t, y, mode), smooth; give −g for the other direction.
    """

    function: Callable[[Scalar, State, Mode], ArrayLike]

    def among(self) -> None:
        return None

    def guard(self, t: Scalar, y: State, mode: Mode, number: Code) -> ArrayLike:
        del number
        return self.function(t, y, mode)

    def first(self, t: ArrayLike) -> ArrayLike:
        del t
        return 0


class Marked(HybridSystem):
    """A system with a surface as a further transition, which changes nothing. Its mode is the
    system's own, with the number of crossings.
    """

    system: HybridSystem
    surface: AbstractSurface

    def flow(self, t: Scalar, y: State, mode: Mode) -> State:
        return self.system.flow(t, y, mode[0])

    def transitions(self) -> Sequence[Transition]:
        def guard(t: Scalar, y: State, mode: Mode) -> ArrayLike:
            return self.surface.guard(t, y, *mode)

        def crossed(t: Scalar, y: State, mode: Mode) -> tuple[State, Mode]:
            del t
            return y, (mode[0], mode[1] + 1)

        own = [_counted(each) for each in self.system.transitions()]
        return [*own, Transition(guard, crossed)]

    def number(self) -> int:
        """The number of the transition that is the surface."""
        own = self.surface.among()
        count = len(self.system.transitions())
        if own is None:
            return count
        if not 0 <= own < count:
            raise ValueError(f"The system has no transition {own}: it has {count}, from 0.")
        return own

    def check(self, start: Start) -> None:
        """Raises `ValueError` for the end of a run that was no section of this system."""
        if start.memory is None:
            return
        counted = isinstance(start.mode, tuple) and len(start.mode) == 2
        if not counted or start.memory.armed.size != len(self.transitions()):
            raise ValueError(
                "Argument `start` is the end of another kind of run: begin a section with "
                "`Start(t, y, mode)`, or go on from the `final` of a section."
            )

    def started(self, start: Start) -> Start:
        """The start of a system, as one of this system."""
        number = jnp.asarray(self.surface.first(start.t), jnp.int32)
        return Start(start.t, start.y, (start.mode, number))


def _counted(transition: Transition) -> Transition:
    """A transition of the system itself."""

    def guard(t: Scalar, y: State, mode: Mode) -> ArrayLike:
        return transition.guard(t, y, mode[0])

    def jump(t: Scalar, y: State, mode: Mode) -> tuple[State, Mode]:
        assert transition.jump is not None
        after, own = transition.jump(t, y, mode[0])
        return after, (own, mode[1])

    def tail(t: Scalar, y: State, mode: Mode) -> Tail:
        assert transition.tail is not None
        found = transition.tail(t, y, mode[0])
        return found._replace(mode=(found.mode, mode[1]))

    return Transition(
        guard,
        None if transition.jump is None else jump,
        None if transition.tail is None else tail,
    )
