"""The interface of a step: integration of the flow of a mode."""

import abc
from typing import NamedTuple

from jaxtyping import PyTree

from impactjax._hybrid.method import AbstractMethod
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.state import Mode, State
from impactjax._types import Code, Flag, Scalar


class Point(NamedTuple):
    """Start of a step."""

    t: Scalar
    y: State
    mode: Mode
    arrival: Code  # the event that led here, or NO_EVENT


class Outcome(NamedTuple):
    """Outcome of one attempt at a step."""

    accepted: Flag
    h: Scalar  # the duration taken, or tried
    y: State  # the state at its end, before any jump
    event: Code  # the transition it ends on, or NO_EVENT
    memory: PyTree  # the step's own, for the next attempt


class AbstractStep(AbstractMethod):
    """Method that integrates the flow of a mode and finds the first event.

    An event ends the step: its location is part of step-size control.
    """

    @abc.abstractmethod
    def begin(self, unit: Scalar) -> PyTree:
        """Memory before the first attempt, of a motion that changes within about `unit` [s]."""

    @property
    @abc.abstractmethod
    def power(self) -> int:
        """The power of λ h in the error of a step along y′ = λ y."""

    @abc.abstractmethod
    def reach(self, tolerance: Scalar) -> Scalar:
        """The longest step along y′ = λ y whose error is within the tolerance, times |λ|."""

    @abc.abstractmethod
    def attempt(
        self,
        automaton: Automaton,
        start: Point,
        longest: Scalar,
        tolerance: Scalar,
        memory: PyTree,
    ) -> Outcome:
        """One attempt, at most `longest` [s] long, which may be infinite.

        A step that is not accepted is tried again.
        """

    @abc.abstractmethod
    def expand(
        self, automaton: Automaton, t: Scalar, y: State, mode: Mode, h: Scalar, event: Code
    ) -> PyTree:
        """Data for `evaluate` of a step of duration `h` that ends on `event`, or on none; computed
        once for all its samples.
        """

    @abc.abstractmethod
    def evaluate(
        self, automaton: Automaton, mode: Mode, expansion: PyTree, s: Scalar, delay: Scalar
    ) -> State:
        """The state a time `s − delay` after the start of the step, as accurate as the step itself.

        The derivatives of samples are those of this map. The delay is zero; only its derivatives
        count, which are those of the start of the step.
        """

    @abc.abstractmethod
    def end(self, automaton: Automaton, mode: Mode, expansion: PyTree, h: Scalar) -> State:
        """The state after a duration `h`, at most that of the step.

        The derivatives of all that follows the step are those of this map. It is smooth in all
        arguments, also at the surface of a stop.
        """
