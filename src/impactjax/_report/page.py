"""The report: one self-contained HTML page."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any

from impactjax._compare.comparison import Comparison, Fitted
from impactjax._compare.ranking import CLEAR
from impactjax._compare.repeatability import Repeatability
from impactjax._identify.identifiability import identifiability
from impactjax._identify.words import coupling
from impactjax._report.coupling_figures import (
    plot_correlation,
    plot_directions,
    plot_sensitivities,
)
from impactjax._report.fit_figures import plot_fit, plot_residuals
from impactjax._report.given import given, speeds_rest_on, taken
from impactjax._report.outcome import was_simulated
from impactjax._report.picture import Margins, Picture, picture, wide_picture
from impactjax._report.profile_curves import NO_CURVES, Curves, curve_pictures
from impactjax._report.rendered import rendered
from impactjax._report.repeats import repeats_section
from impactjax._report.residual_figures import (
    plot_autocorrelation,
    plot_impact_residuals,
    plot_quantiles,
)
from impactjax._report.residual_words import residual_sentences
from impactjax._report.restitution_figure import plot_restitution
from impactjax._report.rows import (
    ABSENT,
    impact_rows,
    law_rows,
    parameter_rows,
    sources,
)
from impactjax._report.search_figures import plot_first_look, plot_starts
from impactjax._report.words import sentences


def page(
    comparisons: Sequence[Comparison],
    command: str,
    repeats: Repeatability | None = None,
    curves: Mapping[str, Curves] = MappingProxyType({}),
) -> str:
    """An HTML page with embedded figures, a section for each recording, and the command. What
    repeated recordings tell together comes first. Profiles are those of the best fit, by recording.
    """
    several = len(comparisons) > 1
    title = "What the impact is made of" if several else f"Contact of {comparisons[0].name}"
    return rendered(
        "page.html",
        title=title,
        repeats=None if repeats is None else repeats_section(repeats),
        sections=[_section(each, curves.get(each.name)) for each in comparisons],
        command=command,
        seed=comparisons[0].seed,
        clear=f"{CLEAR:g}",
        sources=sources([fitted for each in comparisons for fitted in each]),
    )


def _section(comparison: Comparison, curves: Curves | None) -> dict[str, Any]:
    name, fits, best = comparison.name, comparison.fits, comparison.best
    estimate, law = best.estimate, best.name
    told = identifiability(estimate)
    impacts = impact_rows(estimate) if not best.is_free_flight else []
    return {
        "name": name,
        "sentences": [*comparison.notes, *sentences(fits)],
        "fit": [
            wide_picture(
                partial(plot_fit, estimate=estimate), f"{name} with the fit of {law}", 3.6
            ),
            wide_picture(
                partial(plot_residuals, estimate=estimate), f"Residuals of {law} for {name}", 2.4
            ),
        ],
        "laws": law_rows(fits),
        "measured": comparison.first_look is not None,
        "held_out": best.prediction is not None,
        "restitution": _restitution(comparison),
        "parameters": [
            (each.name, rows)
            for each, rows in zip(fits, parameter_rows(fits), strict=True)
            if was_simulated(each.estimate)
        ],
        "profiles": curve_pictures(name, best, curves or {}),
        "no_profiles": "" if curves is None or estimate.scatter is None else NO_CURVES,
        "coupling": coupling(told),
        "couplings": _coupling_pictures(name, best),
        "impacts": impacts,
        "speeds_rest_on": speeds_rest_on(given(best)),
        "taken": taken(best),
        "soft": any(row["duration"] != ABSENT for row in impacts),
        "residual_sentences": residual_sentences(estimate),
        "residuals": _residual_pictures(name, best),
        "search": _search_pictures(comparison),
    }


def _search_pictures(comparison: Comparison) -> list[Picture]:
    name, best = comparison.name, comparison.best
    recording = best.estimate.problem.recording
    ends = picture(
        partial(plot_starts, estimate=best.estimate),
        f"Residuals at the end of the search from each start, {best.name} for {name}",
    )
    if comparison.first_look is None:
        return [ends]
    look = picture(
        partial(plot_first_look, recording=recording, look=comparison.first_look),
        f"{name} with what was found in it before the fit",
    )
    return [look, ends]


def _restitution(comparison: Comparison) -> Picture | None:
    """The restitution figure of the laws that converged; `None` in free flight."""
    fits = [each for each in comparison if not each.is_free_flight]
    shown = [each for each in fits if bool(each.estimate.converged)]
    if not shown:
        return None
    text = f"Restitution against approach speed, impacts and laws' curves, for {comparison.name}"
    draw = partial(plot_restitution, fits=shown, look=comparison.first_look)
    return wide_picture(draw, text, 3.4)


def _coupling_pictures(name: str, best: Fitted) -> list[Picture]:
    estimate, law = best.estimate, best.name
    told = identifiability(estimate)
    drawn = [
        (
            partial(plot_correlation, information=told),
            f"Correlation of the errors of the parameters of {law} for {name}",
            Margins(left=1.1, bottom=0.85, top=0.1),  # names of parameters
        ),
        (
            partial(plot_directions, information=told),
            f"What {name} tells of the parameters of {law}: {coupling(told)}",
            Margins(left=0.15, top=0.1),
        ),
        (  # with a legend in three columns
            partial(plot_sensitivities, information=told, recording=estimate.problem.recording),
            f"Sensitivity of {name} to each parameter of {law} in time",
            Margins(top=0.2 + 0.2 * math.ceil(len(told.names) / 3)),
        ),
    ]
    if not any(told.of_model):
        del drawn[1]
    return [picture(draw, text, 3.6, margins) for draw, text, margins in drawn]


def _residual_pictures(name: str, best: Fitted) -> list[Picture]:
    estimate, law = best.estimate, best.name
    drawn = [
        (plot_autocorrelation, f"Autocorrelation of the residuals of {law} for {name}"),
        (plot_quantiles, f"Normal quantiles of the residuals of {law} for {name}"),
    ]
    if not best.is_free_flight and not estimate.problem.recording.observes_impacts:
        drawn.append((plot_impact_residuals, f"Residuals after each impact, {law} for {name}"))
    return [picture(partial(draw, estimate=estimate), text) for draw, text in drawn]
