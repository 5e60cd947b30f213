"""Rows of the report's tables."""

import inspect
import math
from collections.abc import Mapping, Sequence

import jax
import numpy as np

from impactjax._compare.across import Across, across
from impactjax._compare.comparison import Fitted
from impactjax._compare.ranking import differences, rejected
from impactjax._fit.estimate import Estimate
from impactjax._fit.used_prior import prior_words
from impactjax._number_format import interval
from impactjax._problem.problem import Problem
from impactjax._report.contacts import contacts_of
from impactjax._report.given import given
from impactjax._report.outcome import outcome_of, was_simulated

_MOST_IMPACTS = 40
ABSENT = "–"

Row = dict[str, str]


def law_rows(fits: Sequence[Fitted]) -> list[Row]:
    """One row for each fit, with the difference of its criterion to the best, if it exists."""
    unit, factor = fits[0].estimate.problem.recording.shown
    rows = []
    behind = differences([fitted.estimate for fitted in fits])
    for fitted, by in zip(fits, behind, strict=True):
        own, row = fitted.estimate, {"law": fitted.name, "outcome": outcome_of(fitted)}
        if was_simulated(own):
            row["rms"] = f"{float(own.rms) * factor:.4g} {unit}"
        if not math.isnan(by):
            row["behind"] = f"{math.floor(10 * by) / 10:.1f}"  # never rounded up to the limit
        if fitted.prediction is not None:
            row["predicted"] = f"{fitted.prediction.rms * factor:.4g} {unit}"
        rows.append(
            {"rms": ABSENT, "behind": ABSENT, "predicted": "", **row, "count": str(len(own.names))}
        )
    return rows


def corrected_aic(estimate: Estimate[Problem]) -> float:
    """Akaike's criterion for few observations, AICc = AIC + 2 k (k + 1)/(n − k − 1)."""
    n = int(estimate.problem.recording.observations)
    k = len(estimate.names) + (estimate.system.sensor.variance() is None)
    return float(estimate.aic) + (2 * k * (k + 1) / (n - k - 1) if n > k + 1 else np.inf)


def parameter_rows(fits: Sequence[Fitted]) -> list[list[Row]]:
    """For each fit, one row for each fitted parameter, and one for its value without assumptions.

    The verdict of a law that the best one rules out is "law rejected". Intervals of laws that
    cannot be distinguished are those across them, with that of each law itself.
    """
    estimates = [fitted.estimate for fitted in fits]
    wider, ruled_out = across(estimates), rejected(estimates)
    return [
        _rows(fitted, {x: each for x, each in wider.items() if i in each.models}, ruled_out[i])
        for i, fitted in enumerate(fits)
    ]


def _rows(fitted: Fitted, wider: Mapping[str, Across], ruled_out: bool) -> list[Row]:
    known, priors, rows = given(fitted), fitted.estimate.priors, []
    for each in fitted.estimate.parameters:
        whole = wider.get(each.name, each)
        low, high = np.fmin(whole.low, each.low), np.fmax(whole.high, each.high)
        row = {
            "name": each.name,
            "value": each.quoted,
            "unit": _unit(each.unit),
            "interval": interval(float(low), float(high), each.standard_error),
            "verdict": "law rejected" if ruled_out else str(whole.verdict),
            "given": known.words(each.name) + prior_words(priors.get(each.name)),
        }
        rows.append(row)
        if (own := known.own.get(each.name)) is not None:
            free = {"name": own.name, "value": own.shown, "unit": _unit(own.unit)}
            rows.append({**free, "interval": "", "verdict": "", "given": ""})
    return rows


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def impact_rows(estimate: Estimate[Problem]) -> list[Row]:
    """One row for each of the first forty impacts of the fitted motion. Penetration and force are
    those of a contact at this speed without weight or drive, if the law has them in closed form.
    """
    log = jax.device_get(estimate.impacts)  # indexing NumPy arrays compiles nothing
    count = min(int(log.count), _MOST_IMPACTS)
    mass = float(estimate.system.model.oscillator.mass)
    contacts = contacts_of(estimate.system.model, log)
    rows = []
    for i in range(count):
        complete, soft = bool(log.complete[i]), bool(contacts.soft[i])
        depth, force = float(contacts.penetration[i]), float(contacts.force[i])
        r = float(log.restitution[i])
        rows.append(
            {
                "number": str(i + 1),
                "time": f"{float(log.time[i]):.4f}",
                "approach": f"{float(log.approach_speed[i]):.4g}",
                "separation": f"{float(log.separation_speed[i]):.4g}" if complete else ABSENT,
                "restitution": f"{r:.4f}" if complete else ABSENT,
                "lost": f"{100 * (1 - r**2):.1f}" if complete else ABSENT,
                "duration": f"{1e3 * float(log.duration[i]):.3g}" if complete and soft else ABSENT,
                "penetration": f"{1e3 * depth:.3g}" if math.isfinite(depth) else ABSENT,
                "force": f"{force / mass:.3g}" if math.isfinite(force) else ABSENT,
            }
        )
    return rows


def sources(fits: Sequence[Fitted]) -> list[str]:
    """Sources of the fitted laws' equations, from their docstrings."""
    found = []
    for fitted in fits:
        stop = fitted.estimate.problem.system.model.lower
        if stop is not None:
            text = inspect.getdoc(type(stop.law)) or ""
            _, _, source = text.partition("Source: ")
            if source:
                first = " ".join(source.split("\n\n")[0].split())
                found.append(f"{fitted.name}: {first}")
    return list(dict.fromkeys(found))
