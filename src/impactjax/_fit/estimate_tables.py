"""Conversion of estimates to pandas, xarray and HTML tables."""

import html
from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from impactjax._fit.fitted_parameter import FittedParameter
from impactjax._number_format import interval

if TYPE_CHECKING:
    import pandas
    import xarray

    from impactjax._fit.estimate import Estimate, P

_PER_PARAMETER = ("values", "standard_errors", "low", "high", "verdicts", "inflation")
_PER_FIT = ("rms", "aic", "bic", "misfit", "outcome", "iterations")


def as_dataframe(parameters: Sequence[FittedParameter]) -> "pandas.DataFrame":
    """A data frame with one row for each parameter. Raises `ImportError` without pandas."""
    pandas = _imported("pandas")
    columns = ("value", "standard_error", "low", "high", "unit", "verdict")
    rows = {
        each.name: [str(x) if name == "verdict" else x for name, x in _cells(each, columns)]
        for each in parameters
    }
    frame = pandas.DataFrame.from_dict(rows, orient="index", columns=[*columns])
    frame.index.name = "parameter"
    return frame


def _cells(parameter: FittedParameter, columns: Sequence[str]) -> list[tuple[str, object]]:
    return [(name, getattr(parameter, name)) for name in columns]


def as_xarray(estimate: "Estimate[P]") -> "xarray.Dataset":
    """A dataset with the dimension `parameter`, and `fit_0`, `fit_1`, ... for many fits. Raises
    `ImportError` without xarray.
    """
    xarray = _imported("xarray")
    fits = [f"fit_{axis}" for axis in range(len(estimate.shape))]
    variables = {
        name: ([*fits, "parameter"], np.asarray(getattr(estimate, name))) for name in _PER_PARAMETER
    }
    variables |= {name: (fits, np.asarray(getattr(estimate, name))) for name in _PER_FIT}
    both = [*fits, "parameter", "other_parameter"]
    variables["covariance"] = (both, np.asarray(estimate.covariance))
    names = list(estimate.names)
    units = ("parameter", list(estimate.units))
    coordinates = {"parameter": names, "other_parameter": names, "unit": units}
    return xarray.Dataset(variables, coords=coordinates)


def as_html(parameters: Sequence[FittedParameter], summary: str) -> str:
    """An HTML table for a notebook."""
    heading = "".join(f"<th>{each}</th>" for each in ("parameter", "value", "95 % interval", ""))
    rows = "".join(f"<tr>{_html_cells(each)}</tr>" for each in parameters)
    table = f"<table><thead><tr>{heading}</tr></thead><tbody>{rows}</tbody></table>"
    return f"{table}<p>{html.escape(summary)}</p>"


def _html_cells(each: FittedParameter) -> str:
    unit = "" if each.unit == "1" else f" {each.unit}"
    ends = interval(each.low, each.high, each.standard_error)
    cells = each.name, each.quoted + unit, ends, str(each.verdict)
    return "".join(f"<td>{html.escape(cell)}</td>" for cell in cells)


def _imported(name: str) -> ModuleType:
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"This needs {name}: `pip install {name}`.") from error
