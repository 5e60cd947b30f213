"""Conversion of a study to an xarray dataset."""

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from jaxtyping import Shaped

from impactjax._study.extra import needed
from impactjax._study.manifest import Manifest

if TYPE_CHECKING:
    import xarray

Values: TypeAlias = Shaped[np.ndarray, "..."]


def as_dataset(
    dimensions: Mapping[str, int],
    points: Mapping[str, Values],
    results: Mapping[str, Values],
    manifest: Manifest,
) -> "xarray.Dataset":
    """A dataset with the design's axes as dimensions, and `NAME_0`, `NAME_1`, ... for the axes of a
    result of its own. Raises `ImportError` without xarray.
    """
    xarray = needed("xarray")
    units = {name: {"units": unit} for name, unit in manifest["units"].items()}
    codes = {each["name"]: each["codes"] for each in manifest["results"]}
    coordinates, variables = {}, {}
    for name, values in points.items():
        axes = [name] if name in dimensions else [*dimensions]
        along = tuple(slice(None) if axis in axes else 0 for axis in dimensions)
        coordinates[name] = (axes, values[along], units.get(name, {}))
    for name, values in results.items():
        own = [f"{name}_{axis}" for axis in range(values.ndim - len(dimensions))]
        attributes = {**units.get(name, {}), **_meanings(values, codes[name])}
        variables[name] = ([*dimensions, *own], values, attributes)
    return xarray.Dataset(variables, coordinates, _provenance(manifest))


def _meanings(values: Values, codes: list[str]) -> dict[str, str]:
    """The messages of the codes that occur."""
    if not codes:
        return {}
    return {"meaning": "\n".join(f"{code}: {codes[code]}" for code in np.unique(values))}


def _provenance(manifest: Manifest) -> dict[str, str]:
    """The manifest as texts, which every file format can hold."""
    function = manifest["function"]
    return {
        "function": function["source"] or function["name"],
        "design": json.dumps(manifest["design"]),
        "made_with": json.dumps(manifest["made with"]),
    }
