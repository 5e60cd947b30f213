"""The verbs `structure` and `structure_in`: parameters that no noise level would determine.

The rank of the sensitivities is computed at random points around the given values. A parameter with
a part in their null space at every point is never determined by such data. One that is determined
at some point, but badly at the given values, is not determined by this recording.

Source: J. A. Jacquez and P. Greif (1985), "Numerical parameter identifiability and estimability",
Mathematical Biosciences 77, 201.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from impactjax._abstract_code import AbstractCode
from impactjax._identify.directions import DETERMINED, principal_axes
from impactjax._identify.experiment_information import information
from impactjax._identify.information import Information
from impactjax._identify.information_in import information_in
from impactjax._known import known
from impactjax._optimise.coordinates import FARTHEST
from impactjax._parameter import Range
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import Handle, with_values
from impactjax._problem.parts import chosen
from impactjax._refusal import whole
from impactjax._types import Numbers

_SPREAD = 0.2  # standard deviation of the random points, relative to the values
_NULL = 1e-8  # relative singular value that counts as zero
_ROUNDING = 100  # roundings that count as zero
_PART = 1e-3  # component of a null direction that is more than rounding

Part = TypeVar("Part", bound=eqx.Module)


class Told(AbstractCode):
    """Knowledge of a parameter that data contain."""

    DETERMINED = 0, "determined"  # from both sides
    NOT_BY_THIS_RECORDING = 1, "not by this recording"  # less noise, or other values, would do
    NEVER = 2, "never"  # other parameters, or none, can make up for any change


@dataclasses.dataclass(frozen=True)
class Structure:
    """Structural identifiability, at the given values and at random points around them.

    - `names`: names of the parameters.
    - `ranks`: rank of the sensitivities at each point.
    - `null`: true for each parameter with a part in the null space, at each point.
    - `bounded`: true for each parameter that the data bound from both sides at the given values: a
      positive one to less than half of its size.
    """

    names: tuple[str, ...]
    ranks: Int[np.ndarray, " points"]
    null: Bool[np.ndarray, "points parameters"]
    bounded: Bool[np.ndarray, " parameters"]

    def __getitem__(self, name: str) -> Told:
        if name not in self.names:
            raise KeyError(f"There is no parameter `{name}`; there are {', '.join(self.names)}.")
        i = self.names.index(name)
        if self.null[:, i].all():
            return Told.NEVER
        return Told.DETERMINED if self.bounded[i] else Told.NOT_BY_THIS_RECORDING

    def __str__(self) -> str:
        rank, count = int(self.ranks.max()), len(self.names)
        lines = [f"{name}: {self[name]}" for name in self.names]
        return "\n".join([*lines, f"rank {rank} of {count}, at {len(self.ranks)} points"])


def structure(experiment: Experiment, *, points: int = 8, seed: int = 0) -> Structure:
    """Structural identifiability of the parameters of an experiment.

    **Arguments:**

    - `experiment`: as in `information`.
    - `points`: number of random points besides the given values; those at which the motion cannot
      be simulated do not count.
    - `seed`: random seed.

    **Raises** `ValueError` as `information` does.
    """
    whole("points", points, 0)
    whole("seed", seed, 0)
    first = information(experiment)
    problem = build_problem(experiment)
    ranges = [handle.allowed for handle in problem.handles().values()]
    found = [first]
    for values in _around(first, ranges, points, seed):
        system = problem.system_with(values)
        moved = dataclasses.replace(
            experiment, model=system.model, initial=system.initial, sensor=system.sensor
        )
        try:
            found.append(information(moved))
        except ValueError:  # the motion cannot be simulated there
            continue
    return _structure(found)


def structure_in(
    data: Callable[[Part], Array],
    part: Part,
    sigma: Numbers,
    *,
    free: Sequence[str] = (),
    fixed: Sequence[str] = (),
    points: int = 8,
    seed: int = 0,
) -> Structure:
    """Structural identifiability of the parameters of a law, a model or any part of it, from any
    data.

    **Arguments:**

    - `data`, `part`, `sigma`, `free`, `fixed`: as in `information_in`.
    - `points`, `seed`: as in `structure`.

    **Raises** `ValueError` as `information_in` does.
    """
    whole("points", points, 0)
    whole("seed", seed, 0)
    handles: dict[str, Handle] = chosen(part, free, fixed)

    def at(moved: Part) -> Information:
        return known(information_in(data, moved, sigma, free=free, fixed=fixed))

    first = at(part)
    ranges = [handle.allowed for handle in handles.values()]
    moved = (
        with_values(part, [*handles.values()], [jnp.asarray(value) for value in values])
        for values in _around(first, ranges, points, seed)
    )
    return _structure([first, *(at(each) for each in moved)])


def _around(
    told: Information, ranges: Sequence[Range], points: int, seed: int
) -> Float[np.ndarray, "points parameters"]:
    """Random values around the given ones, inside the ranges."""
    values, scale = np.asarray(told.values), np.asarray(told.scale)
    steps = _SPREAD * np.random.default_rng(seed).standard_normal((points, len(values)))
    scaled = np.array(told.positive) & (values > 0)
    moved = np.where(scaled, values * np.exp(steps), values + scale * steps)
    lowest = [x.low + (_NULL if x.excludes_low else 0.0) for x in ranges]
    return np.clip(moved, lowest, [min(x.high, FARTHEST) for x in ranges])


def _structure(found: Sequence[Information]) -> Structure:
    usable = [each for each in found if np.isfinite(np.asarray(each.sensitivities)).all()]
    if not usable:
        raise ValueError("The data exist at no point, so nothing is known of their structure.")
    ranks, null = zip(*(_null(each) for each in usable), strict=True)
    first = found[0]
    relative = np.asarray(first.bounds) / np.asarray(first.scale)
    least = np.where(first.positive, DETERMINED, np.inf)
    return Structure(first.names, np.array(ranks), np.array(null), ~null[0] & (relative < least))


def _null(told: Information) -> tuple[int, Bool[np.ndarray, " parameters"]]:
    """The rank of sensitivities with columns of length one, and a mask of the parameters with a
    part in their null space. Columns that are only rounding count as zero.
    """
    sensitivities, lengths = (np.asarray(x) for x in (told.sensitivities, _lengths(told)))
    whole = np.linalg.norm(sensitivities, axis=0)
    null = max(_NULL, _ROUNDING * float(np.finfo(sensitivities.dtype).eps))
    present = lengths > null * np.max(lengths)
    unit = np.where(present, sensitivities / np.where(present, whole, 1.0), 0.0)
    rows, sizes = principal_axes(unit)
    felt = sizes > null * np.max(sizes, initial=0.0)
    return int(np.sum(felt)), np.any(np.abs(rows[~felt]) > _PART, axis=0)


def _lengths(told: Information) -> Float[np.ndarray, " parameters"]:
    """Changes of the data for a change of each parameter by its own size; for one that can be
    negative or is zero, by its scale.
    """
    lengths = np.linalg.norm(np.asarray(told.sensitivities), axis=0)
    values, scale = np.abs(np.asarray(told.values)), np.asarray(told.scale)
    own = np.array(told.positive) & (values > 0)
    return lengths * np.where(own, values / scale, 1.0)
