"""The result of a study, as it is read from its folder."""

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from jaxtyping import Bool, Shaped

from impactjax._study.chunks import record_type
from impactjax._study.dataset import as_dataset
from impactjax._study.design import LANE
from impactjax._study.folder import Folder, folder_of
from impactjax._study.manifest import Manifest, read_manifest
from impactjax._study.study_error import StudyError

if TYPE_CHECKING:
    import xarray

Values: TypeAlias = Shaped[np.ndarray, "..."]
Lanes: TypeAlias = Bool[np.ndarray, "..."]  # with the axes of the design

_NAN = "A result is NaN."


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Study:
    """Results of a function at all points of a design. `study["speed"]` is one of them.

    - `dimensions`: names and lengths of the design's axes: those of a grid, or `lane`.
    - `points`: the value of each parameter in each lane, with the design's axes.
    - `results`: the results, with the design's axes first.
    - `manifest`: the content of `study.json`: function, design, seed, versions.
    - `notes`: sentences about files that were damaged or of another study.
    """

    dimensions: Mapping[str, int]
    points: Mapping[str, Values]
    results: Mapping[str, Values]
    manifest: Manifest
    notes: tuple[str, ...]

    def __getitem__(self, name: str) -> Values:
        """A result, or a parameter, with the design's axes first."""
        everything = {**self.points, **self.results}
        if name not in everything:
            raise KeyError(f"There is no `{name}`; there are {', '.join(everything)}.")
        return everything[name]

    @property
    def reasons(self) -> dict[str, Lanes]:
        """The reasons for which lanes have failed, each with true for those lanes.

        They are the messages of result codes other than `RESULTS.successful`. Of a function that
        returns no code a lane fails by a result that is NaN.
        """
        coded = {each["name"]: each["codes"] for each in self.manifest["results"] if each["codes"]}
        if not coded:
            which = {_NAN: self._any(np.isnan, self.results)}
            return {reason: lanes for reason, lanes in which.items() if lanes.any()}
        found = {}
        for name, messages in coded.items():
            for code in np.unique(self.results[name]):
                if messages[code] != messages[0]:
                    lanes = self._any(lambda values, code=code: values == code, [name])
                    found[messages[code]] = found.get(messages[code], False) | lanes
        return found

    @property
    def failed(self) -> Lanes:
        """True for each lane that has failed, for any of the `reasons`."""
        shape = tuple(self.dimensions.values())
        return np.any([np.zeros(shape, bool), *self.reasons.values()], axis=0)

    def to_xarray(self) -> "xarray.Dataset":
        """The study as an xarray dataset: the design's axes as dimensions, parameters as
        coordinates, units and meanings of codes as attributes. Raises `ImportError` without xarray.
        """
        return as_dataset(self.dimensions, self.points, self.results, self.manifest)

    def __repr__(self) -> str:
        axes = ", ".join(f"{name} {size}" for name, size in self.dimensions.items())
        names = f"{', '.join(self.points)} → {', '.join(self.results)}"
        return f"Study({axes}: {names}; {int(self.failed.sum())} failed)"

    def _any(self, holds: Callable[[Values], Values], names: Iterable[str]) -> Lanes:
        """True for each lane where something holds for any number of some results."""
        axes = len(self.dimensions)
        each = [holds(self.results[name]) for name in names]
        return np.any([x.any(axis=tuple(range(axes, x.ndim))) for x in each], axis=0)


def read_study(folder: str | Path) -> Study:
    """The study in a folder, whose files are checked against their digests.

    **Arguments:**

    - `folder`: the `store` of a finished study.

    **Raises** `StudyError` if a file is missing, damaged or of another study.
    """
    return study_in(Path(folder), ())


def study_in(path: Path, notes: tuple[str, ...]) -> Study:
    """The study in a folder, with notes. Raises `StudyError`."""
    manifest = read_manifest(path)
    fields = record_type(manifest)
    dimensions = manifest["design"]["dimensions"]
    shape = tuple(dimensions.values())
    everything = _filled(folder_of(path), fields, int(np.prod(shape)), manifest["chunk"])
    parts = {name: x.reshape(*shape, *x.shape[1:]) for name, x in everything.items()}
    points = {name: parts[name] for name in manifest["design"]["names"]}
    results = {each["name"]: parts[each["name"]] for each in manifest["results"]}
    return Study(dimensions, points, results, manifest, notes)


def _filled(folder: Folder, fields: np.dtype[Any], lanes: int, chunk: int) -> dict[str, Values]:
    """The values of each field, in the order of the design. Raises `StudyError`."""
    names = [name for name in fields.names or () if name != LANE]
    whole = {name: np.empty((lanes, *fields[name].shape), fields[name].base) for name in names}
    for number in range(-(-lanes // chunk)):
        file = folder.chunk(number)
        if not file.exists():
            raise StudyError(f"{file} is missing; call `study` again, which computes it.")
        records = folder.read(number)
        if records is None:
            raise StudyError(
                f"{file} is damaged or of another study; call `study` again, which computes it."
            )
        for name in names:
            whole[name][records[LANE]] = records[name]
    return whole
