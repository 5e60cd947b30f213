"""The interface of a step: integration of the flow of a mode up to the first event."""

import abc
from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, Bool, PyTree

from impactjax._hybrid.equations import Equations
from impactjax._hybrid.lane import Point
from impactjax._hybrid.system import Mode, State
from impactjax._types import Code, Flag, Scalar


class Attempt(NamedTuple):
    """Outcome of one attempt at a step.

    - `accepted`: true if the step can be taken; otherwise it is tried again with `memory`.
    - `h`: duration taken, or tried.
    - `unit`: unit of time of its expansion.
    - `y`: state at its end, before any jump.
    - `event`: the transition on which it ends, or `NO_EVENT`.
    - `caused`: true if the jump before has caused the event, at the same time.
    - `armed`: true for each guard whose fall is an event, at its end.
    - `memory`: for the next attempt.
    """

    accepted: Flag
    h: Scalar
    unit: Scalar
    y: State
    event: Code
    caused: Flag
    armed: Bool[Array, " guards"]
    memory: PyTree


class AbstractFlowStep(eqx.Module):
    """Method that integrates the flow of a mode and finds the first event.

    No step is cut at the end of a run, so that a later run can go on as if there had been none.
    """

    @abc.abstractmethod
    def begin(self, equations: Equations, t: Scalar, y: State, mode: Mode) -> PyTree:
        """Memory before the first attempt."""

    @abc.abstractmethod
    def attempt(
        self, equations: Equations, start: Point, tolerance: Scalar, scale: State
    ) -> Attempt:
        """One attempt at a step."""

    @abc.abstractmethod
    def expand(self, equations: Equations, t: Scalar, y: State, mode: Mode, unit: Scalar) -> PyTree:
        """Data for `evaluate` of a step, computed once for all its samples."""

    @abc.abstractmethod
    def evaluate(
        self,
        equations: Equations,
        like: State,
        mode: Mode,
        expansion: PyTree,
        s: Scalar,
        delay: Scalar,
    ) -> State:
        """The state, a tree like `like`, a time `s − delay` after the start of the step.

        Smooth in all arguments. The delay is zero; only its derivatives count, which are those of
        the start of the step.
        """
