"""Report on a design: content of `design.json`, and a page."""

import json
import math
from functools import partial
from typing import Any

from impactjax._design.plan import Design, Expected
from impactjax._report.design_figure import plot_design
from impactjax._report.json_number import json_number
from impactjax._report.picture import Margins, picture
from impactjax._report.rendered import rendered
from impactjax._report.rows import ABSENT
from impactjax._report.versions import versions

_ROW, _FRAME = 0.35, 1.0  # height of a parameter in the figure, and around all [inches]


def design_texts(found: Design, name: str, command: str) -> tuple[str, str]:
    """The content of `design.json` and the page of a design.

    **Arguments:**

    - `found`: result of `design`.
    - `name`: name of the plan, for the title.
    - `command`: command to quote in the page.
    """
    content = json.dumps({"plan": name, **design_document(found)}, indent=2)
    return f"{content}\n", _page(found, name, command)


def design_document(found: Design) -> dict[str, Any]:
    """The content of `design.json`."""
    return {
        "verdict": found.verdict,
        "reached": found.reached,
        "criterion": type(found.criterion).__name__,
        "asked": found.criterion.asked_widths(),
        "size": json_number(found.size),
        "least_size": json_number(found.least_size),
        "performances": [
            {
                "experiment": each.name,
                "choices": dict(each.values),
                "number": each.number,
                "costs": dict(each.costs),
            }
            for each in found.performances
        ],
        "costs": dict(found.costs),
        "budget": dict(found.budget),
        "least_share": json_number(found.least_share),
        "parameters": {name: _expected(each) for name, each in found.expected.items()},
        "scatter": found.scatter,
        "refits": found.refits,
        "failed_refits": found.failed,
        "impossible_candidates": found.impossible,
        "limits": found.limits,
        "versions": versions(),
    }


def _expected(each: Expected) -> dict[str, Any]:
    return {
        "value": json_number(each.value),
        "unit": each.unit,
        "interval95": [json_number(end) for end in each.interval],
        "half_width": json_number(each.half_width),
        "attained": json_number(each.attained),
    }


def _page(found: Design, name: str, command: str) -> str:
    figure = picture(
        partial(plot_design, found=found),
        f"Half-widths of the 95 % intervals that the experiments of {name} are expected to give",
        _FRAME + _ROW * len(found.expected),
        Margins(left=1.1, top=0.4),
    )
    return rendered(
        "design.html",
        title=f"Experiments for {name}",
        found=found,
        resources=[_resource(found, resource) for resource in found.costs],
        parameters=[_row(found, each) for each in found.expected.values()],
        figure=figure,
        command=command,
        seed=None,
    )


def _resource(found: Design, name: str) -> tuple[str, str, str]:
    """A resource, what the plan takes of it, and what there is."""
    most = found.budget.get(name)
    return name, f"{found.costs[name]:.4g}", ABSENT if most is None else f"{most:.4g}"


def _row(found: Design, each: Expected) -> dict[str, str]:
    asked = found.criterion.asked_widths().get(each.name, math.nan)
    widths = {"expected": each.half_width, "refits": each.attained, "asked": asked}
    shown = {
        key: f"± {each.amount(x)}" if math.isfinite(x) else ABSENT for key, x in widths.items()
    }
    return {"name": each.name, "interval": each.quoted, **shown}
