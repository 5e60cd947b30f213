"""Forced hybrid systems from period to period."""

from collections.abc import Callable
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, PyTree

from impactjax._hybrid.ends import as_start
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.numbers import packed, unpacked
from impactjax._hybrid.section import Section, section
from impactjax._hybrid.surface import Every
from impactjax._hybrid.system import HybridSystem
from impactjax._response.period import Force
from impactjax._response.sampler import (
    AbstractSampler,
    Counts,
    Growth,
    Sampled,
    chosen,
    without_disturbances,
)
from impactjax._results import RESULTS

Told = TypeVar("Told")


class SystemSampler(AbstractSampler[HybridSystem]):
    """Hybrid systems and their sections."""

    force: Force
    tolerance: ArrayLike | None
    step: AbstractMethod | None
    counts: Counts = eqx.field(static=True)

    def begun(self, system: HybridSystem, start: Start) -> Start:
        del system
        start = Start(start.t, start.y, start.mode)  # what it remembers is of another value
        return as_start(start, jnp.result_type(float, *jax.tree.leaves(start.y)))

    def __call__(self, system: HybridSystem, begun: Start) -> Sampled:
        found = self._section(system, begun, self._surface(system, begun), *self.counts)
        good = found.result == RESULTS.successful
        ended = found.final.y, found.final.mode[0]
        y, mode = chosen(good, ended, (begun.y, begun.mode))
        return Sampled(found.after, Start(begun.t, y, mode), found.result)

    def growth(self, system: HybridSystem, begun: Start) -> Growth:
        """The derivative of the state after a period by the state before it is exact. Its products
        are kept well conditioned by QR factorisations.
        """
        surface, like = self._surface(system, begun), begun.y

        def one_period(carry: tuple[Start, Array, RESULTS], _: None) -> tuple[PyTree, Array]:
            start, directions, result = carry

            def ended(numbers: Array) -> tuple[Array, Section]:
                before = Start(start.t, unpacked(numbers, like), start.mode, start.memory)
                found = self._section(system, before, surface, 1)
                return packed(found.final.y), found

            change, found = jax.jacfwd(ended, has_aux=True)(packed(start.y))
            directions, factors = jnp.linalg.qr(change @ directions)
            result = RESULTS.where(result == RESULTS.successful, found.result, result)
            return (found.final, directions, result), jnp.log(jnp.abs(jnp.diag(factors)))

        keep, skip = self.counts
        alone = without_disturbances(skip)
        settled = self._section(system, begun, surface, 1, alone)  # whose end has a memory
        directions = jnp.eye(packed(like).size, dtype=packed(like).dtype)
        begin = settled.final, directions, settled.result
        (final, _, result), logarithms = jax.lax.scan(one_period, begin, length=skip - alone + keep)
        return Growth(logarithms[skip - alone :], final, result)

    def side_by_side(self, motion: Callable[[PyTree], Told], lanes: PyTree) -> Told:
        return jax.vmap(motion)(lanes)

    def _surface(self, system: HybridSystem, begun: Start) -> Every:
        first = jnp.asarray(begun.t)
        return Every(self.period(system).astype(first.dtype), first)

    def _section(
        self, system: HybridSystem, start: Start, surface: Every, keep: int, skip: int = 0
    ) -> Section:
        return section(
            system,
            start,
            surface,
            keep=keep,
            skip=skip,
            tolerance=self.tolerance,
            step=self.step,
        )
