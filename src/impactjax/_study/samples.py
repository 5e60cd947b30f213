"""Samples that fill a box evenly."""

import abc
from collections.abc import Mapping
from typing import Any

import equinox as eqx

from impactjax._study.design import LANE, AbstractDesign, Points
from impactjax._study.ranges import Ranges, as_ranges, scaled
from impactjax._study.whole import as_count, as_seed


class AbstractSample(AbstractDesign):
    """A sample of a box, which scrambled points of the unit cube fill.

    - `ranges`: the range of each parameter.
    - `size`: number of lanes.
    - `seed`: random seed.
    """

    ranges: eqx.AbstractVar[Ranges]
    size: eqx.AbstractVar[int]
    seed: eqx.AbstractVar[int]

    @abc.abstractmethod
    def cube(self) -> Points:
        """The points in the unit cube."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.ranges)

    @property
    def dimensions(self) -> Mapping[str, int]:
        """The axis `lane`."""
        return {LANE: self.size}

    def points(self) -> Points:
        """Values of the parameters in each lane."""
        return scaled(self.ranges, self.cube())


class LatinHypercube(AbstractSample):
    """A Latin hypercube: of n lanes, each n-th part of each parameter's range has one.

    **Arguments:**

    - `ranges`: the range of each parameter: (low, high) or `LogUniform(low, high)`.
    - `size`: number of lanes.
    - `seed`: random seed.

    Source: M. D. McKay, R. J. Beckman and W. J. Conover (1979), Technometrics 21, 239; computed by
    `scipy.stats.qmc`.
    """

    ranges: Ranges = eqx.field(converter=as_ranges)
    size: int = eqx.field(converter=as_count)
    seed: int = eqx.field(converter=as_seed, default=0)

    def cube(self) -> Points:
        """The points in the unit cube."""
        from scipy.stats import qmc

        seed: Any = {"seed": self.seed}  # called `rng` from SciPy 1.15 on
        sampler = qmc.LatinHypercube(len(self.ranges), **seed)
        return sampler.random(self.size)


class SobolSequence(AbstractSample):
    """The beginning of a scrambled Sobol sequence, which fills the box more evenly than random
    points do, best with a power of 2 of them.

    **Arguments:**

    - `ranges`: the range of each parameter: (low, high) or `LogUniform(low, high)`.
    - `size`: number of lanes.
    - `seed`: random seed of the scrambling.

    Source: I. M. Sobol (1967), USSR Computational Mathematics and Mathematical Physics 7, 86;
    scrambled as by A. B. Owen (1998), Journal of Complexity 14, 466; computed by
    `scipy.stats.qmc`.
    """

    ranges: Ranges = eqx.field(converter=as_ranges)
    size: int = eqx.field(converter=as_count)
    seed: int = eqx.field(converter=as_seed, default=0)

    def cube(self) -> Points:
        """The points in the unit cube."""
        from scipy.stats import qmc

        seed: Any = {"seed": self.seed}  # called `rng` from SciPy 1.15 on
        sampler = qmc.Sobol(len(self.ranges), **seed)
        return sampler.random_base2((self.size - 1).bit_length())[: self.size]
