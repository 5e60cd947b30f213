"""Events of `solve_events`, in the words of Diffrax."""

import abc
from collections.abc import Callable, Sequence
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float, PyTree

from impactjax._hybrid.system import State
from impactjax._types import Code, Flag, Scalar

_APART = 1e-9  # least distance of a time from the one after the next, relative to the run

Guard = Callable[[Scalar, State, PyTree, Code], ArrayLike]


class AbstractReset(eqx.Module):
    """An event that changes the state, and perhaps the term."""

    @abc.abstractmethod
    def since(self, t: Scalar) -> "AbstractReset":
        """The event in a run that starts at `t`."""

    @abc.abstractmethod
    def guards(self) -> tuple[Guard, ...]:
        """Functions of time, state, args and the number of such events before, each of which falls
        through zero at an event.
        """

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

    def since(self, t: Scalar) -> "Reset":
        del t
        return self

    def guards(self) -> tuple[Guard, ...]:
        def falls(t: Scalar, y: State, args: PyTree, count: Code) -> ArrayLike:
            del count
            return self.cond_fn(t, y, args)

        def rises(t: Scalar, y: State, args: PyTree, count: Code) -> ArrayLike:
            return -jnp.asarray(falls(t, y, args, count))

        if self.direction is None:
            return falls, rises
        return (rises,) if self.direction else (falls,)

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

    Two successive times have guards of their own, so that an event may follow another within the
    tolerance of its time.

    - `times`: increasing; those before the start of the run are left out, infinite ones never come.
      Of three, the last must come more than a billionth of the run after the first.
    - `reset`, `term`: as for `Reset`.
    - `origin`: time from which `times` count.
    """

    times: Float[Array, " times"] = eqx.field(converter=jnp.asarray)
    reset: Callable[[Scalar, State, PyTree], State] | None = None
    term: int | None = eqx.field(default=None, static=True)
    origin: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.0)

    def since(self, t: Scalar) -> "ResetAt":
        start = jax.lax.stop_gradient(t)
        later = self.times + (self.origin - start).astype(self.times.dtype)
        return ResetAt(later, self.reset, self.term, start)

    def guards(self) -> tuple[Guard, ...]:
        def due(parity: int, t: Scalar, y: State, args: PyTree, count: Code) -> ArrayLike:
            del y, args
            passed = (t - jax.lax.stop_gradient(self.origin)).astype(t.dtype)
            number = count + (count + parity) % 2
            times = self.times.astype(t.dtype)
            later = jnp.append(times, jnp.inf)[jnp.minimum(number, times.size)]
            never = jnp.isinf(later)
            ahead = jnp.where(never, 1.0, jnp.where(never, 0.0, later) - passed)
            return jnp.where(_increase(times), ahead, jnp.nan)

        return partial(due, 0), partial(due, 1)

    def passed(self, t: Scalar) -> ArrayLike:
        since = self.since(t)
        return jnp.sum(since.times < 0, dtype=jnp.int32)

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
        if not isinstance(self.times, Tracer) and not _increase(self.times - self.times[:1]):
            raise ValueError(f"`times` must increase strictly, but they are {self.times}.")


def _increase(times: Float[Array, " times"]) -> Flag:
    """True if times increase strictly, and none is very close to the one after the next; any number
    of infinite ones may follow.
    """
    rises = jnp.all((times[1:] > times[:-1]) | jnp.isinf(times[1:]))
    longest = jnp.max(jnp.where(jnp.isinf(times), 0.0, jnp.abs(times)), initial=0.0)
    apart = times[2:] - times[:-2] > _APART * longest
    return rises & jnp.all(apart | jnp.isinf(times[2:]))


def _among(term: Code, numbers: Sequence[int] | None) -> ArrayLike:
    if numbers is None:
        return True
    return jnp.any(jnp.asarray([term == number for number in numbers]))


def _check_terms(numbers: Sequence[int | None], terms: int) -> None:
    for number in numbers:
        if number is not None and not 0 <= number < terms:
            raise ValueError(f"An event names term {number}, but there are {terms}, from 0.")
