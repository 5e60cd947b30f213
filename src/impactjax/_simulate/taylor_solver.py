"""Taylor series as a solver for `diffrax.diffeqsolve`."""

from collections.abc import Callable
from typing import Any, ClassVar, TypeAlias

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from impactjax._series.polynomial import horner
from impactjax._series.recurrences.tables import AWAY_FROM_SINGULARITIES
from impactjax._series.taylor import solution_series
from impactjax._types import Scalar

_Time: TypeAlias = int | float | Array | np.ndarray
_State: TypeAlias = PyTree


class _Polynomial(diffrax.AbstractLocalInterpolation):
    """The series of one step, in units of the step."""

    t0: _Time  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: _Time  # pyright: ignore[reportIncompatibleVariableOverride]
    coefficients: tuple[_State, ...]

    def evaluate(self, t0: _Time, t1: _Time | None = None, left: bool = True) -> _State:
        """The solution at `t0`, or its change from `t0` to `t1`."""
        del left
        if t1 is not None:
            start, end = self.evaluate(t0), self.evaluate(t1)
            return jax.tree.map(lambda a, b: b - a, start, end)
        span = jnp.asarray(self.t1 - self.t0)
        w = (t0 - self.t0) / jnp.where(span == 0, jnp.ones_like(span), span)
        return jax.tree.map(lambda *series: horner(series, jnp.asarray(w)), *self.coefficients)


class Taylor(diffrax.AbstractSolver[Any]):
    """A Taylor-series method of any order, for `diffrax.diffeqsolve` and analytic vector fields.

    The series is derived from the vector field itself: its jaxpr is read once, and each operation
    has a recurrence. The dense output is as accurate as the steps. Source: Jorba & Zou,
    Experimental Mathematics 14, 99 (2005). At a point where a root, a power or an angle is not
    analytic, such as √x at zero, the series is not finite.

    **Arguments:**

    - `degree`: the highest power of the step length.

    **Raises** `NotAnalytic` for a vector field with an operation that has no recurrence here.
    """

    degree: int = eqx.field(default=15, static=True)
    term_structure: ClassVar = diffrax.AbstractTerm
    interpolation_cls: ClassVar[Callable[..., _Polynomial]] = _Polynomial

    def __check_init__(self) -> None:
        if self.degree < 2:
            raise ValueError(f"Argument `degree` must be at least 2, but it is {self.degree}.")

    def order(self, terms: PyTree) -> int:
        """The order of the method."""
        del terms
        return self.degree

    def init(self, terms: PyTree, t0: _Time, t1: _Time, y0: _State, args: PyTree) -> None:
        """The empty solver state."""
        del terms, t0, t1, y0, args

    def step(
        self,
        terms: diffrax.AbstractTerm[Any, Any],
        t0: _Time,
        t1: _Time,
        y0: _State,
        args: PyTree,
        solver_state: None,
        made_jump: bool | Array | np.ndarray,
    ) -> tuple[_State, _State, dict[str, tuple[_State, ...]], None, diffrax.RESULTS]:
        """One step, its error by the last two terms, and its polynomial."""
        del solver_state, made_jump
        leaves, structure = jax.tree.flatten(y0)

        def field(t: Scalar, *leaves: Array) -> list[Array]:
            return jax.tree.leaves(terms.vf(t, jax.tree.unflatten(structure, leaves), args))

        start = jnp.asarray(t0)
        step = jnp.asarray(terms.contr(t0, t1), start.dtype)
        series, _ = solution_series(
            field, start, leaves, self.degree, step, AWAY_FROM_SINGULARITIES
        )
        coefficients = tuple(
            jax.tree.unflatten(structure, list(row)) for row in zip(*series, strict=True)
        )
        y1 = jax.tree.map(lambda *terms: sum(reversed(terms[:-1]), terms[-1]), *coefficients)
        error = jax.tree.map(
            lambda last, one_before: jnp.abs(last) + jnp.abs(one_before) * 1e-3,
            coefficients[-1],
            coefficients[-2],
        )
        return y1, error, {"coefficients": coefficients}, None, diffrax.RESULTS.successful

    def func(
        self, terms: diffrax.AbstractTerm[Any, Any], t0: _Time, y0: _State, args: PyTree
    ) -> _State:
        """The vector field."""
        return terms.vf(t0, y0, args)
