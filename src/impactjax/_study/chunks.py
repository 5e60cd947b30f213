"""The chunks of a study: which lanes they hold, and their records."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from impactjax._refusal import check_takes, returned_number
from impactjax._study.design import LANE, Points
from impactjax._study.folder import Records
from impactjax._study.manifest import Manifest
from impactjax._study.program import Results


class Chunks(NamedTuple):
    """The lanes of a study, in the order in which they are computed.

    - `points`: values of the parameters in each lane, in the order of the design.
    - `lanes`: numbers of the lanes in the order of computation.
    - `size`: number of lanes of a chunk; the last one may have fewer.
    - `fields`: type of the records.
    """

    points: Points
    lanes: Int[np.ndarray, " lanes"]
    size: int
    fields: np.dtype[Any]

    @property
    def total(self) -> int:
        """Number of chunks."""
        return -(-len(self.lanes) // self.size)

    def lanes_of(self, number: int) -> Int[np.ndarray, " lanes"]:
        """Numbers of the lanes of a chunk."""
        return self.lanes[number * self.size : (number + 1) * self.size]

    def points_of(self, number: int) -> Points:
        """Points of the lanes of a chunk."""
        return self.points[self.lanes_of(number)]

    def records(self, number: int, results: Results) -> Records:
        """The records of a chunk: number, parameters and results of each lane."""
        lanes = self.lanes_of(number)
        records = np.empty(len(lanes), self.fields)
        columns = [lanes, *self.points_of(number).T, *results]
        for name, column in zip(self.fields.names or (), columns, strict=True):
            records[name] = column
        return records


def record_type(manifest: Manifest) -> np.dtype[Any]:
    """The type of a study's records."""
    parameters = [(name, manifest["precision"]) for name in manifest["design"]["names"]]
    results = [(each["name"], each["type"], tuple(each["shape"])) for each in manifest["results"]]
    return np.dtype([(LANE, "<i8"), *parameters, *results])


def by_cost(
    cost: Callable[..., ArrayLike], names: Sequence[str], points: Points
) -> Int[np.ndarray, " lanes"]:
    """The numbers of the lanes, those of greatest cost first and those without a cost last."""
    check_takes("cost", cost, names)

    def of_lane(point: Float[Array, " parameters"]) -> Array:
        found = cost(**{name: point[i] for i, name in enumerate(names)})
        return returned_number("cost", found).astype(point.dtype)

    found = np.asarray(jax.jit(jax.vmap(of_lane))(points))
    return np.argsort(-found, kind="stable")
