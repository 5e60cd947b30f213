"""Saltelli's design for Sobol indices."""

from collections.abc import Mapping

import equinox as eqx
import numpy as np

from impactjax._study.design import AbstractDesign, Points
from impactjax._study.extra import needed
from impactjax._study.ranges import Ranges, as_ranges, scaled
from impactjax._study.whole import as_power_of_two, as_seed

BLOCK, MEMBER = "block", "member"


class Saltelli(AbstractDesign):
    """Saltelli's design, from which `sobol_indices` estimates Sobol indices.

    A block is two points A and B of a Sobol sequence, and for each of the d parameters A with that
    parameter from B: d + 2 lanes; for interactions of pairs also B with that parameter from A,
    2 d + 2 lanes.

    **Arguments:**

    - `ranges`: the range of each parameter: (low, high) or `LogUniform(low, high)`.
    - `size`: number of blocks, a power of 2.
    - `second_order`: true for the interactions of pairs too.
    - `seed`: random seed of the sequence's scrambling.

    Source: A. Saltelli et al. (2010), Computer Physics Communications 181, 259; computed by SALib.
    """

    ranges: Ranges = eqx.field(converter=as_ranges)
    size: int = eqx.field(converter=as_power_of_two)
    second_order: bool = False
    seed: int = eqx.field(converter=as_seed, default=0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.ranges)

    @property
    def dimensions(self) -> Mapping[str, int]:
        """The axes `block`, and `member` for the lanes of a block: A, the d (or 2 d) mixed points,
        B.
        """
        mixed = len(self.ranges) * (2 if self.second_order else 1)
        return {BLOCK: self.size, MEMBER: mixed + 2}

    def points(self) -> Points:
        """Values of the parameters in each lane. Raises `ImportError` without SALib."""
        sample = needed("SALib.sample.sobol").sample
        cube = sample(
            unit_cube(self.names), self.size, calc_second_order=self.second_order, seed=self.seed
        )
        return scaled(self.ranges, np.asarray(cube, float))


def unit_cube(names: tuple[str, ...]) -> dict[str, object]:
    """The description that SALib has of parameters from 0 to 1."""
    return {"num_vars": len(names), "names": [*names], "bounds": [[0.0, 1.0]] * len(names)}
