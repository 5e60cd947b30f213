"""Repeated recordings in tables, in `fit.json` and on the report."""

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np

from impactjax._compare.repeatability import Repeatability, RepeatedModel, RepeatedParameter
from impactjax._number_format import interval
from impactjax._report.json_number import json_number
from impactjax._report.picture import picture
from impactjax._report.repeats_figure import plot_repeats
from impactjax._report.rows import Row


def repeat_rows(model: RepeatedModel) -> list[Row]:
    """One row for each parameter of a model."""
    return [_row(each) for each in model.parameters]


def _row(own: RepeatedParameter) -> Row:
    over = own.over
    return {
        "name": own.name,
        "value": own.quoted,
        "unit": "" if own.unit == "1" else own.unit,
        "interval": interval(own.low, own.high, over.standard_error),
        "between": own.quoted_between,
        "single": interval(over.single_low, over.single_high, over.standard_error),
        "count": str(int(np.sum(np.isfinite(own.values)))),
    }


def repeats_document(repeats: Repeatability) -> dict[str, Any]:
    """The part of `fit.json` on repeated recordings."""
    return {
        "recordings": list(repeats.names),
        "notes": list(repeats.notes),
        "models": [
            {
                "law": model.name,
                "aic_behind": json_number(model.behind),
                "parameters": {each.name: _document(each) for each in model.parameters},
            }
            for model in repeats.models
        ],
    }


def _document(own: RepeatedParameter) -> dict[str, Any]:
    over = own.over
    return {
        "value": json_number(over.mean),
        "standard_error": json_number(over.standard_error),
        "interval95": _numbers([own.low, own.high]),
        "unit": own.unit,
        "between": json_number(over.between),
        "between_interval95": _numbers([over.between_low, over.between_high]),
        "single_repeat": _numbers([over.single_low, over.single_high]),
        "chance": json_number(over.chance),
        "values": _numbers(own.values),
        "standard_errors": _numbers(own.errors),
    }


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [json_number(each) for each in values]


def repeats_section(repeats: Repeatability) -> dict[str, Any]:
    """Content of the report on repeated recordings, with figures of the best model."""
    return {
        "names": list(repeats.names),
        "notes": list(repeats.notes),
        "models": [
            (model.name, f"{model.behind:.1f}", repeat_rows(model)) for model in repeats.models
        ],
        "figures": [
            picture(partial(plot_repeats, parameter=each), f"{each.name} of {model.name} by repeat")
            for model in repeats.models[:1]
            for each in model.parameters
        ],
    }
