"""The interface of a hybrid system: flows, and transitions between them."""

import abc
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import equinox as eqx
from jaxtyping import ArrayLike, PyTree

from impactjax._types import Scalar

State: TypeAlias = PyTree  # any tree of floating-point arrays
Mode: TypeAlias = PyTree  # any tree of whole numbers


class Tail(NamedTuple):
    """The rest of an endless series of events, in closed form.

    - `holds`: true if the rest is taken at once. The state is then the one at its end already
      during the series, so that this should wait until the motion left is negligible.
    - `duration`: sum of the times between the events.
    - `y`, `mode`: state and mode after the series.
    """

    holds: ArrayLike
    duration: ArrayLike
    y: State
    mode: Mode


class Transition(NamedTuple):
    """An event, and what it does.

    It happens where the guard falls from positive to negative. A guard that is negative, since it
    has fallen without being lifted by the jump, waits until it has risen again. A guard that a
    *different* transition's jump makes negative causes its event at once.

    - `guard`: g(t, y, mode), a smooth function of time and state, positive until the event. Make it
      a positive constant in modes in which the event cannot happen.
    - `jump`: state and mode after the event, as a function of those before it, (t, y, mode) →
      (y⁺, mode⁺); `None` if the run ends here.
    - `tail`: for an event that can repeat endlessly in finite time, a function of t, y⁺ and mode⁺
      that returns a `Tail`.
    """

    guard: Callable[[Scalar, State, Mode], ArrayLike]
    jump: Callable[[Scalar, State, Mode], tuple[State, Mode]] | None = None
    tail: Callable[[Scalar, State, Mode], Tail] | None = None


class HybridSystem(eqx.Module):
    """A system y′ = f(t, y, mode) whose state and mode jump at events.

    Fields are parameters: `solve` is differentiable with respect to all that are floating-point
    arrays. All methods are functions of arrays, without side effects.

    Example, a ball on a floor:

        class Ball(HybridSystem):
            gravity: Array
            restitution: Array

            def flow(self, t, y, mode):
                return {"height": y["speed"], "speed": -self.gravity}

            def transitions(self):
                return [Transition(lambda t, y, mode: y["height"], self.bounce)]

            def bounce(self, t, y, mode):
                return {**y, "speed": -self.restitution * y["speed"]}, mode
    """

    @abc.abstractmethod
    def flow(self, t: Scalar, y: State, mode: Mode) -> State:
        """Time derivative of the state, a tree of the same structure. Smooth within a mode."""

    def smooth_until(self, t: Scalar, mode: Mode) -> ArrayLike | None:
        """The next time at which the flow is not smooth although the mode does not change, as at
        the knots of a measured force: a step ends there. `None` if there is none. In the flow,
        `held(t)` chooses the piece that begins at such a time.
        """
        del t, mode

    @abc.abstractmethod
    def transitions(self) -> Sequence[Transition]:
        """The transitions, numbered from 0. Of several at one time the first one comes first."""
