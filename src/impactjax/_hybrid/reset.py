"""Events of `solve_events`, in the words of Diffrax."""

import abc
from collections.abc import Callable, Sequence

import equinox as eqx
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float, PyTree

from impactjax._hybrid.system import State
from impactjax._types import Code, Flag, Scalar


class AbstractReset(eqx.Module):
    """An event that changes the state, and perhaps the term."""

    @abc.abstractmethod
    def directions(self) -> tuple[float, ...]:
        """Factors on the condition, such that the event happens where a product falls."""

    @abc.abstractmethod
    def condition(self, t: Scalar, y: State, args: PyTree, count: Code) -> ArrayLike:
        """The condition after `count` such events."""

    @abc.abstractmethod
    def passed(self, t: Scalar) -> ArrayLike:
        """The number of such events that belong to the time before the start `t` of a run."""

    @abc.abstractmethod
    def applies(self, term: Code) -> ArrayLike:
        """True if the event can happen while the term of this number holds."""

    @abc.abstractmethod
    def jump(self) -> Callable[[Scalar, State, PyTree], State] | None:
        """The state after the event, or `None` if the run ends."""

    @abc.abstractmethod
    def check(self, terms: int) -> None:
        """Raises `ValueError` for times out of order, and a term that is not there."""

    @abc.abstractmethod
    def following(self, term: Code) -> ArrayLike:
        """The number of the term that holds after the event."""


class Reset(AbstractReset):
    """An event at the zero of a condition, with a new state.

    - `cond_fn`: a real-valued function of (t, y, args), as for `diffrax.Event`.
    - `reset`: the state after the event, as a function of t, the state before it, and args; `None`
      if the run ends, as with `diffrax.Event`.
    - `direction`: `True` if the condition must rise through zero, `False` if it must fall, `None`
      if either counts.
    - `during`: numbers of the terms in which it can happen; `None` for all.
    - `term`: number of the term that holds after it; `None` for the same.
    """

    cond_fn: Callable[[Scalar, State, PyTree], ArrayLike]
    reset: Callable[[Scalar, State, PyTree], State] | None = None
    direction: bool | None = eqx.field(default=None, static=True)
    during: Sequence[int] | None = eqx.field(default=None, static=True)
    term: int | None = eqx.field(default=None, static=True)

    def directions(self) -> tuple[float, ...]:
        if self.direction is None:
            return (1.0, -1.0)
        return (-1.0,) if self.direction else (1.0,)

    def condition(self, t: Scalar, y: State, args: PyTree, count: Code) -> ArrayLike:
        del count
        return self.cond_fn(t, y, args)

    def passed(self, t: Scalar) -> ArrayLike:
        del t
        return 0

    def applies(self, term: Code) -> ArrayLike:
        return _among(term, self.during)

    def jump(self) -> Callable[[Scalar, State, PyTree], State] | None:
        return self.reset

    def following(self, term: Code) -> ArrayLike:
        return term if self.term is None else self.term

    def check(self, terms: int) -> None:
        _check_terms([self.term, *(self.during or ())], terms)


class ResetAt(AbstractReset):
    """An event at given times, with a new state.

    - `times`: increasing; those before the start of the run are left out, infinite ones never come.
    - `reset`, `term`: as for `Reset`.
    """

    times: Float[Array, " times"] = eqx.field(converter=jnp.asarray)
    reset: Callable[[Scalar, State, PyTree], State] | None = None
    term: int | None = eqx.field(default=None, static=True)

    def directions(self) -> tuple[float, ...]:
        return (1.0,)

    def condition(self, t: Scalar, y: State, args: PyTree, count: Code) -> ArrayLike:
        del y, args
        times = self.times.astype(t.dtype)
        later = jnp.append(times, jnp.inf)[jnp.minimum(count, times.size)]
        never = jnp.isinf(later)
        due = jnp.where(never, 1.0, jnp.where(never, 0.0, later) - t)
        return jnp.where(_increase(times), due, jnp.nan)

    def passed(self, t: Scalar) -> ArrayLike:
        return jnp.sum(self.times < t.astype(self.times.dtype), dtype=jnp.int32)

    def applies(self, term: Code) -> ArrayLike:
        del term
        return True

    def jump(self) -> Callable[[Scalar, State, PyTree], State] | None:
        return self.reset

    def following(self, term: Code) -> ArrayLike:
        return term if self.term is None else self.term

    def check(self, terms: int) -> None:
        _check_terms([self.term], terms)
        if self.times.ndim != 1:
            raise ValueError(f"`times` must be a list, but its shape is {self.times.shape}.")
        if not isinstance(self.times, Tracer) and not _increase(self.times):
            raise ValueError(f"`times` must increase strictly, but they are {self.times}.")


def _increase(times: Float[Array, " times"]) -> Flag:
    """True if times increase strictly; any number of infinite ones may follow."""
    return jnp.all((times[1:] > times[:-1]) | jnp.isinf(times[1:]))


def _among(term: Code, numbers: Sequence[int] | None) -> ArrayLike:
    if numbers is None:
        return True
    return jnp.any(jnp.asarray([term == number for number in numbers]))


def _check_terms(numbers: Sequence[int | None], terms: int) -> None:
    for number in numbers:
        if number is not None and not 0 <= number < terms:
            raise ValueError(f"An event names term {number}, but there are {terms}, from 0.")
