"""What the fits say, in sentences."""

from collections.abc import Sequence

import numpy as np

from impactjax._fit.compare import Fitted, behind, misfit
from impactjax._fit.estimate import Estimate
from impactjax._fit.laws import NO_LAW
from impactjax._fit.verdict import Verdict
from impactjax._identify.identifiability import identifiability
from impactjax._identify.residuals import Residuality, residuality
from impactjax._identify.words import coupling, findings
from impactjax._measure.recording import ImpactTimes
from impactjax._report.outcome import outcome, was_simulated
from impactjax._report.units import shown_unit

_CLEAR = 10.0  # a difference of AIC that leaves no doubt
_FLOOR = 1.2  # times the error of quantisation: no other error is to be seen
_LARGE = 1.5  # times the usual residual: the law misses something there


def sentences(fits: Sequence[Fitted]) -> list[str]:
    """The findings for one recording, whose fits come best first."""
    best = fits[0]
    unit, factor = shown_unit(best.estimate.problem.recording)
    found = [*_friction(fits, unit, factor)]
    if len(fits) > 1 and best.law != NO_LAW and bool(best.estimate.converged):
        found.append(_ranking(fits))
    for fitted in fits:
        if not bool(fitted.estimate.converged):
            found.append(
                f"The fit of {_name(fitted)} has no result: {outcome(fitted.estimate)}. Its row is "
                "not to be used."
            )
    if not bool(best.estimate.converged):
        return found
    if (share := misfit(best.estimate)) > 0:
        return [*found, _does_not_fit(best.estimate, share)]
    found += _open_sides(best)
    told = identifiability(best.estimate)
    if not all(each.determined for each in findings(told)):
        found.append(coupling(told))
    found += _at_the_floor(best.estimate, unit, factor)
    found += _beyond_the_noise(best.estimate)
    residuals = residuality(best.estimate)
    if not bool(residuals.independent):
        found.append(_independence(best.estimate, residuals))
    return found


def _does_not_fit(estimate: Estimate, share: float) -> str:
    said = (
        f"No law tried describes the record: {100 * share:.0f} % of its motion is left. Nothing is "
        "identified."
    )
    if estimate.system.model.lower is None:
        return f"{said} Perhaps there are impacts in it: name a law."
    return (
        f"{said} Perhaps the stop is not where it is said to be (`gap`), the zero or sign of the "
        "record is another (`offset`, `gain`), there is dry friction (`dry_friction = true` under "
        "[system]), or something else moves it."
    )


def _name(fitted: Fitted) -> str:
    law = "free flight" if fitted.law == NO_LAW else f"the law {fitted.law}"
    return f"{law} with dry friction" if fitted.dry_friction else law


def _friction(fits: Sequence[Fitted], unit: str, factor: float) -> list[str]:
    dry = [fitted for fitted in fits if fitted.law == NO_LAW and fitted.dry_friction]
    viscous = [fitted for fitted in fits if fitted.law == NO_LAW and not fitted.dry_friction]
    if not (dry and viscous):
        return []
    gain = float(viscous[0].estimate.aic - dry[0].estimate.aic)
    before, after = (float(each[0].estimate.rms) * factor for each in (viscous, dry))
    if gain > _CLEAR:
        return [
            "Viscous friction alone does not describe the record: dry friction lowers the residual "
            f"from {before:.3g} to {after:.3g} {unit} rms (AIC better by {gain:.0f})."
        ]
    return ["Viscous friction describes the record; it gives no reason to assume dry friction."]


def _ranking(fits: Sequence[Fitted]) -> str:
    best = fits[0]
    near = [
        fitted
        for fitted in fits[1:]
        if bool(fitted.estimate.converged)
        and float(behind(best.estimate, fitted.estimate)) < _CLEAR
    ]
    if not near:
        return f"Among the laws tried, {best.law} describes the record clearly best."
    names = ", ".join(fitted.law for fitted in near)
    return f"{best.law} describes the record best, but it cannot be told apart from {names}."


def _open_sides(best: Fitted) -> list[str]:
    estimate, found = best.estimate, []
    known = estimate.problem.handles()
    for i, name in enumerate(estimate.names):
        allowed = known[name].allowed
        unit = "" if allowed.unit == "1" else f" {allowed.unit}"
        low, high = float(estimate.low[i]), float(estimate.high[i])
        verdict = estimate.verdict(name)
        if verdict is Verdict.NOT_IDENTIFIED:
            found.append(f"The record does not tell {name}.")
        elif verdict is Verdict.ONE_SIDED and high < allowed.high:
            found.append(f"The record only tells that {name} is at most {high:.3g}{unit}.")
        elif verdict is Verdict.ONE_SIDED:
            found.append(f"The record only tells that {name} is at least {low:.3g}{unit}.")
    return found


def _at_the_floor(estimate: Estimate, unit: str, factor: float) -> list[str]:
    """What there is to say if the steps of the recorded values are all that is left."""
    floor = float(estimate.problem.system.sensor.floor()) ** 0.5
    if not 0 < float(estimate.rms) < _FLOOR * floor:
        return []
    return [
        f"The residual is what quantisation alone leaves ({floor * factor:.3g} {unit}): a better "
        "law could not be told, a finer instrument might."
    ]


def _beyond_the_noise(estimate: Estimate) -> list[str]:
    """What there is to say if the residuals are too large for noise of the size that is known."""
    known = estimate.problem.variance()
    times = 1.0 if known is None else float(estimate.rms / known**0.5)
    if times < _LARGE:
        return []
    return [
        f"The residual is {times:.3g} times the noise that the sensor is said to have: `sigma` or "
        "the law is wrong, and errors and intervals with it."
    ]


def residual_sentences(estimate: Estimate) -> list[str]:
    """Whether the residuals are what a good law leaves: independent, of one size, normal."""
    if not was_simulated(estimate):
        return ["Nothing could be simulated, so there are no residuals."]
    found = residuality(estimate)
    said = [_independence(estimate, found), *_after_impacts(estimate, found)]
    if float(found.abnormal) < 1e-3:
        kurtosis = float(found.excess_kurtosis)
        tails = "longer" if kurtosis > 0 else "shorter"
        said.append(
            f"Their distribution is not normal: skewness {float(found.skewness):.2f}, tails "
            f"{tails} than those of a normal one (excess kurtosis {kurtosis:.2f})."
        )
    else:
        said.append("Their distribution is like a normal one.")
    return said


def _independence(estimate: Estimate, found: Residuality) -> str:
    first = float(found.autocorrelation[0]) if found.autocorrelation.size else 0.0
    numbers = (
        f"autocorrelation {first:.2f} at lag 1 (95 % band ± {float(found.band):.2f}), "
        f"{int(found.runs)} runs of one sign where {float(found.runs_expected):.0f} are expected"
    )
    if bool(found.independent):
        return f"The residuals look independent: {numbers}."
    said = (
        f"The residuals do not look independent: {numbers}. Their noise is filtered or the law is "
        "not right"
    )
    if int(estimate.memory) == 0:
        return f"{said}; errors that take them as independent are too small."
    inflation = np.asarray(estimate.inflation)
    largest = float(np.max(inflation[np.isfinite(inflation)], initial=1.0))
    return f"{said}; the errors allow for it, by factors up to {largest:.1f}."


def _after_impacts(estimate: Estimate, found: Residuality) -> list[str]:
    if isinstance(estimate.problem.recording, ImpactTimes):
        return []
    after = np.asarray(found.after_impacts)
    large = [str(i + 1) for i in np.flatnonzero(after > _LARGE)]
    if not large:
        return []
    which = f"impact {large[0]}" if len(large) == 1 else f"impacts {', '.join(large)}"
    return [
        f"Just after {which} they are up to {after.max():.1f} times as large as on the whole: the "
        "law misses something of the contact."
    ]
