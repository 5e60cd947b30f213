"""Sentences on the results of all fits to a recording."""

import math
from collections.abc import Sequence

from impactjax._compare.across import across
from impactjax._compare.comparison import Fitted
from impactjax._compare.prepare import WITH_DRY_FRICTION, WITHOUT_PULL
from impactjax._compare.ranking import (
    CLEAR,
    differences,
    parameters_found,
)
from impactjax._fit.estimate import Estimate
from impactjax._fit.reason import Reason
from impactjax._fit.scatter_test import follows_speed
from impactjax._fit.verdict import Verdict
from impactjax._identify.identifiability import identifiability
from impactjax._identify.residual_diagnostics import residual_diagnostics
from impactjax._identify.words import coupling, findings
from impactjax._number_format import apart, interval, with_unit
from impactjax._problem.misfit import STATED
from impactjax._problem.problem import Problem
from impactjax._report.given import given_sentences, listed
from impactjax._report.outcome import outcome_of
from impactjax._report.residual_words import independence

_FLOOR = 1.2  # ratio of the rms to the quantisation error below which no other error is visible
_SMALL = 3.0  # ratio of the known noise to the rms above which the noise is wrong


def sentences(fits: Sequence[Fitted]) -> list[str]:
    """The findings for one recording, whose fits come best first."""
    best = fits[0]
    unit, factor = best.estimate.problem.recording.shown
    found = [*_friction(fits, unit, factor), *_ranking(fits)]
    for fitted in fits:
        if not bool(fitted.estimate.converged):
            found.append(
                f"The fit of {_name(fitted)} failed: {outcome_of(fitted)}. Do not use its row."
            )
    found += _predictions(fits, unit, factor)
    if not bool(best.estimate.converged):
        return found
    if (share := float(best.estimate.misfit)) > 0:
        return [*found, _does_not_fit(best.estimate, share)]
    found += given_sentences(best)
    found += [str(prior) for prior in best.estimate.priors.values()]
    found += _open_sides(best)
    found += _across(fits)
    found += _lasting(best.estimate)
    found += _scatter(best.estimate)
    told = identifiability(best.estimate)
    if not all(each.determined for each in findings(told)):
        found.append(coupling(told))
    found += _at_the_floor(best.estimate, unit, factor)
    found += _beyond_the_noise(best.estimate)
    residuals = residual_diagnostics(best.estimate)
    if not bool(residuals.independent):
        found.append(independence(best.estimate, residuals))
    return found


def _does_not_fit(estimate: Estimate[Problem], share: float) -> str:
    said = (
        f"None of the laws describes the record: the best leaves {100 * share:.0f} % of its motion "
        "unexplained, so no parameter is identified."
    )
    if estimate.system.model.lower is None:
        return f"{said} It may contain impacts: name a law (`--law`)."
    return (
        f"{said} Possible causes: the stop is elsewhere (`gap`), the zero or sign of the record is "
        "wrong (`offset`, `gain`), there is dry friction (`dry_friction = true` under [system]), "
        "the base moves, or it is another system (`--system`)."
    )


def _predictions(fits: Sequence[Fitted], unit: str, factor: float) -> list[str]:
    """Sentence on how well each law predicts what was held out."""
    told = [
        f"{each.name} {each.prediction.rms * factor:.3g}"
        for each in fits
        if each.prediction is not None and bool(each.estimate.converged)
    ]
    held = fits[0].prediction
    if held is None or not told:
        return []
    what, fitted = f"The last {held.observations} observations were held out.", "the rest"
    if held.recording:
        what = f"{held.recording} was held out: nothing of the model was fitted to it."
        fitted = "its own recording"
    return [
        f"{what} Predicted minus recorded, {unit} rms: {', '.join(told)}; the fit of "
        f"{fits[0].name} to {fitted} leaves {float(fits[0].estimate.rms) * factor:.3g}."
    ]


def _name(fitted: Fitted) -> str:
    return fitted.name if fitted.is_free_flight else f"the law {fitted.name}"


def _friction(fits: Sequence[Fitted], unit: str, factor: float) -> list[str]:
    """Sentence on the need for dry friction, if free flight is best and was fitted with and without
    it.
    """
    free = {fitted.is_dry: i for i, fitted in enumerate(fits) if fitted.is_free_flight}
    if len(free) < 2 or not fits[0].is_free_flight or _describes_nothing(fits):
        return []
    viscous, dry = (fits[free[with_dry]].estimate for with_dry in (False, True))
    if not (bool(viscous.converged) and bool(dry.converged)):
        return []
    behind = differences([fitted.estimate for fitted in fits])
    gain = behind[free[False]] - behind[free[True]]
    if math.isnan(gain):
        return [_too_few([viscous, dry], "decide whether there is dry friction")]
    if gain >= CLEAR:
        before, after = apart(float(viscous.rms) * factor, float(dry.rms) * factor)
        return [
            "Viscous friction alone does not describe the record: dry friction lowers the residual "
            f"from {before} to {after} {unit} rms (AIC better by {math.floor(gain)})."
        ]
    return ["Viscous friction describes the record; dry friction is not needed."]


def _ranking(fits: Sequence[Fitted]) -> list[str]:
    """Sentences on the ranking of the laws, if the best one describes the record."""
    behind_of = differences([fitted.estimate for fitted in fits])
    firsts = {_kind(fits[i]): i for i in reversed(range(len(fits)))}
    tried = [fits[i] for i in sorted(firsts.values())]
    behind = [behind_of[i] for i in sorted(firsts.values())]
    if len(tried) == 1 or _describes_nothing(fits):
        return []
    best, *others = zip([_kind(fitted) for fitted in tried], behind, strict=True)
    if math.isnan(best[1]):
        return [_too_few([fitted.estimate for fitted in tried], "rank the laws")]
    ranked = [(name, by) for name, by in others if not math.isnan(by)]
    near = [name for name, by in ranked if by < CLEAR]
    found = []
    if near:
        names = ", ".join(near)
        found.append(
            f"{best[0]} describes the record best, but it cannot be distinguished from {names}."
        )
    elif ranked:
        found.append(f"Among the laws tried, {best[0]} describes the record clearly best.")
    beyond = [
        fitted
        for fitted, by in zip(tried, behind, strict=True)
        if math.isnan(by) and bool(fitted.estimate.converged)
    ]
    if beyond:
        estimates = [fitted.estimate for fitted in (tried[0], *beyond)]
        found.append(_too_few(estimates, f"rank {', '.join(fitted.name for fitted in beyond)}"))
    return found


def _kind(fitted: Fitted) -> str:
    """The name of a model, without the suffixes of its variants."""
    return fitted.name.removesuffix(WITHOUT_PULL).removesuffix(WITH_DRY_FRICTION)


def _describes_nothing(fits: Sequence[Fitted]) -> bool:
    """True if the best fit has no result, or plainly misses the record."""
    return not bool(fits[0].estimate.usable)


def _too_few(estimates: Sequence[Estimate[Problem]], purpose: str) -> str:
    """Sentence for a record that is too short for Akaike's criterion."""
    converged = [each for each in estimates if bool(each.converged)]
    n = min(converged, key=lambda each: float(each.aic)).independent_observations
    most = max(parameters_found(each) for each in converged)
    return (
        f"The record is too short to {purpose}: its effective sample size is {math.floor(n)}, and "
        f"{most} numbers are estimated from it, unknown noise levels included."
    )


def _open_sides(best: Fitted) -> list[str]:
    estimate, found = best.estimate, []
    known = estimate.problem.handles()
    for i, name in enumerate(estimate.names):
        allowed = known[name].allowed
        unit = "" if allowed.unit == "1" else f" {allowed.unit}"
        low, high = float(estimate.low[i]), float(estimate.high[i])
        verdict = estimate.verdict(name)
        if verdict is Verdict.NOT_IDENTIFIED:
            found.append(f"{name} is not determined by the record.")
        elif estimate.reason(name) is Reason.PROFILE_STOPPED:
            found.append(
                f"The search for an end of the interval of {name} failed; only its standard error "
                "is known."
            )
        elif verdict is Verdict.ONE_SIDED and high < allowed.high:
            found.append(f"{name} has an upper bound only: {high:.3g}{unit} (95 %).")
        elif verdict is Verdict.ONE_SIDED:
            found.append(f"{name} has a lower bound only: {low:.3g}{unit} (95 %).")
    return found


def _across(fits: Sequence[Fitted]) -> list[str]:
    """Sentences on parameters whose interval is that across several laws."""
    best = fits[0].estimate
    differing: dict[tuple[int, ...], list[str]] = {}
    for name, wider in across([fitted.estimate for fitted in fits]).items():
        own = best[name]
        alone, whole = (
            with_unit(interval(*ends, own.standard_error), own.unit)
            for ends in ((own.low, own.high), (wider.low, wider.high))
        )
        differing.setdefault(wider.models, []).append(f"{name} {whole} ({alone})")
    return [
        f"{listed([fits[i].name for i in models])} cannot be distinguished. Intervals over all of "
        f"them, with those of {fits[0].name} alone in brackets: {', '.join(parts)}."
        for models, parts in differing.items()
    ]


def _lasting(estimate: Estimate[Problem]) -> list[str]:
    """Sentence on residuals that are autocorrelated over longer times than in their noise model."""
    if not bool(estimate.lasting):
        return []
    return [
        "The residuals are autocorrelated over longer times than the noise model covers: the law "
        "or the sensor is slightly wrong, and the intervals are too narrow by an unknown factor. "
        "No parameter is identified."
    ]


def _scatter(estimate: Estimate[Problem]) -> list[str]:
    """Sentence on the scatter of restitution, if the fit has it."""
    scatter = estimate.scatter
    if scatter is None:
        return []
    low, high = (float(factor) for factor in scatter.single)
    size = str(scatter).removeprefix("scatter from impact to impact: ")
    if not math.isfinite(float(scatter.high)):
        return ["The record does not tell whether restitution scatters from impact to impact."]
    if float(scatter.low) == 0:
        return [
            "The record does not tell whether restitution scatters from impact to impact: if it "
            f"does, then by {size}."
        ]
    found = [
        f"Restitution scatters from impact to impact by {size}: 95 % of single impacts have "
        f"{low:.3f} to {high:.3f} times the restitution of the law."
    ]
    if follows_speed(estimate):
        found.append(
            "The deviations of the impacts follow their speed: the law is wrong, and what looks "
            "like scatter is a restitution that depends on the speed in another way."
        )
    return found


def _at_the_floor(estimate: Estimate[Problem], unit: str, factor: float) -> list[str]:
    """Sentence for residuals that are no larger than the quantisation error."""
    floor = float(estimate.problem.system.sensor.floor()) ** 0.5
    rms = float(estimate.rms)
    if not floor / _FLOOR < rms < _FLOOR * floor:
        return []
    return [
        f"The residual, {rms * factor:.3g} {unit} rms, is about as large as the quantisation error "
        f"({floor * factor:.3g} {unit}): only a finer instrument could show a better law."
    ]


def _beyond_the_noise(estimate: Estimate[Problem]) -> list[str]:
    """Sentence for residuals that are too large or too small for the known noise, or larger at
    impacts than elsewhere.
    """
    known = estimate.problem.variance()
    times = 1.0 if known is None else float(estimate.rms / known**0.5)
    if times < 1 / _SMALL:
        return [
            f"The stated noise of the sensor is {1 / max(times, 1e-99):.3g} times the residual: "
            "`sigma` is too large, and so are errors and intervals."
        ]
    if times >= STATED:
        return [
            f"The residual is {times:.3g} times the stated noise of the sensor: `sigma` or the law "
            "is wrong, and so are errors and intervals."
        ]
    if not bool(estimate.exceeds_noise):
        return []
    plain = estimate.system.sensor.low_pass is None
    hint = " (`--free cutoff` fits a low-pass)" if plain else ""
    return [
        f"The residuals at impacts are more than twice as large as elsewhere: law or sensor{hint} "
        "does not describe the contacts, and values may be off by more than their intervals. No "
        "parameter is identified."
    ]
