"""Chandrupatla's method for the point at which a rate falls through zero."""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from impactjax._hybrid.varying import alike
from impactjax._model.root import implicit
from impactjax._types import Code, Flag, Scalar

_MOST = 100  # limit of evaluations; a smooth rate needs about eight

Rate: TypeAlias = Callable[[Scalar, PyTree], Scalar]


class Bracket(NamedTuple):
    """An interval with a positive rate at one end, and a rate of zero or less at the other."""

    low: Scalar
    at_low: Scalar
    high: Scalar
    at_high: Scalar


class _End(NamedTuple):
    s: Scalar
    rate: Scalar


class _Search(NamedTuple):
    """The bracket between its newest end and the other one, and the end that was replaced last."""

    newest: _End
    other: _End
    last: _End
    evaluations: Code


def falling_zero(rate: Rate, bracket: Bracket, parameters: PyTree) -> Scalar:
    """The s in a bracket at which rate(s, parameters) falls through zero, to rounding, with
    derivatives of any order. It uses inverse quadratic interpolation where that is safe, and
    bisection otherwise.

    Source: Chandrupatla, Advances in Engineering Software 28, 145 (1997).
    """
    still, (low, at_low, high, at_high) = jax.lax.stop_gradient((parameters, bracket))

    def unfinished(search: _Search) -> Flag:
        best = _best(search)
        wide = jnp.abs(search.other.s - search.newest.s) > 2 * _resolution(best.s)
        return wide & (best.rate != 0) & (search.evaluations < _MOST)

    def narrowed(search: _Search) -> _Search:
        newest, other, _, evaluations = search
        s = newest.s + _share(search) * (other.s - newest.s)
        tried = _End(s, rate(s, still))
        same = (tried.rate > 0) == (newest.rate > 0)
        last, other = _either(same, newest, other), _either(same, other, newest)
        return alike(_Search(tried, other, last, evaluations + 1), everything)

    everything = still, bracket
    start = _End(low, at_low), _End(high, at_high), _End(high, at_high)
    begin = alike(_Search(*start, jnp.int32(0)), everything)
    end = jax.lax.while_loop(unfinished, narrowed, begin)
    return implicit(rate, _best(end).s, parameters)


def _share(search: _Search) -> Scalar:
    """Next point, as a fraction of the way from the newest end to the other one."""
    (a, at_a), (b, at_b), (c, at_c), _ = search
    width = jnp.abs(b - a)
    place, height = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
    safe = (height**2 < place) & ((1 - height) ** 2 < 1 - place)
    quadratic = at_a / (at_b - at_a) * at_c / (at_b - at_c)
    quadratic += (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)
    share = jnp.where(safe, quadratic, 0.5)
    least = _resolution(_best(search).s) / width
    return jnp.clip(share, least, 1 - least)


def _best(search: _Search) -> _End:
    closer = jnp.abs(search.newest.rate) <= jnp.abs(search.other.rate)
    return _either(closer, search.newest, search.other)


def _either(condition: Flag, yes: _End, no: _End) -> _End:
    return _End(jnp.where(condition, yes.s, no.s), jnp.where(condition, yes.rate, no.rate))


def _resolution(s: Scalar) -> Scalar:
    info = jnp.finfo(s.dtype)
    return info.eps * jnp.abs(s) + info.tiny
