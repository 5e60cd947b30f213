"""The verb `lyapunov`: all Lyapunov exponents of a motion, with their errors."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, PyTree

from impactjax._hybrid.arguments import as_number
from impactjax._hybrid.ends import with_arrays
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.numbers import packed, unpacked
from impactjax._hybrid.section import Section, section
from impactjax._hybrid.surface import Every
from impactjax._hybrid.system import HybridSystem, State
from impactjax._known import is_known
from impactjax._refusal import check_kind, whole
from impactjax._results import RESULTS


class Exponents(eqx.Module):
    """Lyapunov exponents of a motion.

    - `values`: the exponents per unit of time, the largest first.
    - `errors`: their standard errors, by batch means; they hold if the batches are longer than the
      memory of the motion.
    - `growth`: logarithms of the growth in each interval, from which all follows.
    - `final`: the end of the motion, from which a `section` goes on.
    - `result`: result code.
    """

    values: Float[Array, "... numbers"]
    errors: Float[Array, "... numbers"]
    growth: Float[Array, "... intervals numbers"]
    final: Start
    result: RESULTS

    @property
    def sum(self) -> Float[Array, "..."]:
        """Sum of all exponents: the mean rate at which volumes of states grow."""
        return self.values.sum(-1)


class _OneInterval(eqx.Module):
    """The section with one crossing, as accurate as asked for."""

    tolerance: ArrayLike | None
    scale: State | None
    step: AbstractMethod | None

    def __call__(self, system: HybridSystem, start: Start, surface: Every) -> Section:
        return section(
            system,
            start,
            surface,
            keep=1,
            tolerance=self.tolerance,
            scale=self.scale,
            step=self.step,
        )


def lyapunov(
    system: HybridSystem,
    start: Start,
    interval: ArrayLike,
    *,
    count: int = 1000,
    settle: int = 100,
    tolerance: ArrayLike | None = None,
    scale: State | None = None,
    step: AbstractMethod | None = None,
) -> Exponents:
    """Lyapunov exponents of a motion, through all its events.

    The derivative of the state after each interval of time by the state before it is exact, with
    the saltation at events. Its products are kept well conditioned by QR factorisations. Batches
    are made by `jax.vmap`.

    **Arguments:**

    - `system`, `start`: the system, and where the motion starts.
    - `interval`: time between two factorisations, such as the period of the force; disturbances
      must not grow beyond rounding in it.
    - `count`: number of intervals.
    - `settle`: number of intervals before them, in which directions and motion settle.
    - `tolerance`, `scale`, `step`: as for `solve`.

    **Raises** `ValueError` for an interval that is not positive, and as `section` does;
    `TypeError` for arguments of the wrong type.

    Source: G. Benettin et al., Meccanica 15 (1980) 9; jumps by P. C. Müller, Chaos, Solitons and
    Fractals 5 (1995) 1671. Errors by batch means with √count batches.
    """
    check_kind("system", system, HybridSystem, "Ball(gravity, restitution)")
    check_kind("start", start, Start, "Start(t=0.0, y=y0)")
    count, settle = whole("count", count, least=4), whole("settle", settle, least=1)
    dtype = jnp.result_type(float, *jax.tree.leaves(start.y))
    each = jnp.asarray(as_number("interval", interval), dtype)
    if is_known(each) and not (jnp.isfinite(each) & (each > 0)):
        raise ValueError(f"Argument `interval` must be positive and finite, but it is {each}.")
    surface = Every(each, jnp.asarray(start.t, dtype))
    run, own = _OneInterval(tolerance, scale, step), with_arrays(system, dtype)
    first = run(own, Start(start.t, start.y, start.mode), surface)
    growth, final, result = _grown(run, own, surface, first, settle + count)
    known = jnp.where(result == RESULTS.successful, growth[settle:], jnp.nan)
    known = known[:, jnp.argsort(-known.mean(0))]
    batches = math.isqrt(count)
    means = known[count % batches :].reshape(batches, -1, known.shape[1]).mean(1)
    errors = jnp.std(means, axis=0, ddof=1) / math.sqrt(batches)
    return Exponents(known.mean(0) / each, errors / each, known, final, result)


@eqx.filter_jit
def _grown(
    run: _OneInterval,
    system: HybridSystem,
    surface: Every,
    first: Section,
    intervals: int,
) -> tuple[Float[Array, "intervals numbers"], Start, RESULTS]:
    """Logarithms of the growth in each interval, the end of the motion, and its result code."""
    like = first.final.y

    def one_interval(carry: tuple[Start, Array, RESULTS], _: None) -> tuple[PyTree, Array]:
        start, directions, result = carry

        def ended(numbers: Array) -> tuple[Array, Section]:
            begun = Start(start.t, unpacked(numbers, like), start.mode, start.memory)
            found = run(system, begun, surface)
            return packed(found.final.y), found

        change, found = jax.jacfwd(ended, has_aux=True)(packed(start.y))
        directions, factors = jnp.linalg.qr(change @ directions)
        result = RESULTS.where(result == RESULTS.successful, found.result, result)
        return (found.final, directions, result), jnp.log(jnp.abs(jnp.diag(factors)))

    directions = jnp.eye(packed(like).size, dtype=packed(like).dtype)
    begun = first.final, directions, first.result
    (final, _, result), growth = jax.lax.scan(one_interval, begun, length=intervals)
    return growth, final, result
