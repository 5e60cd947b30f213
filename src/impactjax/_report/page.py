"""The report: one self-contained HTML page."""

import base64
import importlib.resources
import io
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import jinja2

from impactjax._fit.compare import Fitted
from impactjax._fit.laws import NO_LAW
from impactjax._report.document import versions
from impactjax._report.figures import plot_fit, plot_residuals, plot_restitution
from impactjax._report.units import interval, shown_unit, with_error
from impactjax._report.words import sentences

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DPI = 150


class _Figure(NamedTuple):
    png: str  # base64
    text: str  # for those who cannot see it
    width: int
    height: int


def page(fits: Sequence[tuple[str, Fitted]], command: str, seed: int) -> str:
    """A page with figures inside, for fits with the name of their recording, best first."""
    template = (
        importlib.resources.files("impactjax._report").joinpath("page.html").read_text("utf-8")
    )
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    sections = [
        _section(name, [fitted for _, fitted in group])
        for name, group in groupby(fits, key=lambda named: named[0])
    ]
    title = "What the impact is made of" if len(sections) > 1 else f"Contact of {fits[0][0]}"
    return environment.from_string(template).render(
        title=title, sections=sections, command=command, seed=seed, versions=versions()
    )


def _section(name: str, fits: list[Fitted]) -> dict[str, Any]:
    best = fits[0]
    law = "free flight" if best.law == NO_LAW else best.law
    estimate = best.estimate
    figures = [
        _drawn(lambda ax: plot_fit(ax, estimate), 3.2, f"Recording {name} with the fit of {law}"),
        _drawn(lambda ax: plot_residuals(ax, estimate), 2.2, f"Residuals of {law} for {name}"),
    ]
    if best.law != NO_LAW:
        text = f"Restitution of each impact against its approach speed, {law} for {name}"
        figures.append(_drawn(lambda ax: plot_restitution(ax, estimate), 2.4, text))
    return {
        "name": name,
        "sentences": sentences(fits),
        "figures": figures,
        "fits": [_rows(fitted, best) for fitted in fits],
    }


def _rows(fitted: Fitted, best: Fitted) -> dict[str, Any]:
    estimate = fitted.estimate
    unit, factor = shown_unit(estimate.problem.recording)
    return {
        "law": fitted.law,
        "friction": "viscous and dry" if fitted.dry_friction else "viscous",
        "result": "converged" if bool(estimate.converged) else "not converged",
        "rms": f"{float(estimate.rms) * factor:.4g} {unit}",
        "aic": f"{float(estimate.aic - best.estimate.aic):.1f}",
        "bic": f"{float(estimate.bic - best.estimate.bic):.1f}",
        "parameters": [
            {
                "name": name,
                "value": with_error(float(estimate.values[i]), float(estimate.standard_errors[i])),
                "unit": estimate.units[i],
                "interval": interval(
                    float(estimate.low[i]),
                    float(estimate.high[i]),
                    float(estimate.standard_errors[i]),
                ),
                "verdict": str(estimate.verdict(name)),
            }
            for i, name in enumerate(estimate.names)
        ],
    }


def _drawn(draw: Callable[["Axes"], "Axes"], height: float, text: str) -> _Figure:
    """A figure as a picture inside the page."""
    from matplotlib.figure import Figure  # most users of the package never draw

    width = 9.0
    figure = Figure(figsize=(width, height), layout="constrained")
    ax = figure.add_subplot()
    ax.spines[["top", "right"]].set_visible(False)
    draw(ax)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI)
    png = base64.b64encode(buffer.getvalue()).decode("ascii")
    return _Figure(png, text, round(width * _DPI), round(height * _DPI))
