"""What the fits say, in sentences."""

from collections.abc import Sequence

from impactjax._fit.compare import Fitted
from impactjax._fit.laws import NO_LAW
from impactjax._fit.system import handles
from impactjax._fit.verdict import Verdict
from impactjax._report.units import shown_unit

_CLEAR = 10.0  # a difference of AIC that leaves no doubt


def sentences(fits: Sequence[Fitted]) -> list[str]:
    """The findings for one recording, whose fits come best first."""
    best = fits[0]
    unit, factor = shown_unit(best.estimate.problem.recording)
    found = [*_friction(fits, unit, factor)]
    if len(fits) > 1 and best.law != NO_LAW:
        found.append(_ranking(fits))
    for fitted in fits:
        if not bool(fitted.estimate.converged):
            found.append(f"The fit of {_name(fitted)} did not converge; its row is not to be used.")
    found += _open_sides(best)
    return found


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
    near = [f for f in fits[1:] if float(f.estimate.aic - best.estimate.aic) < _CLEAR]
    if not near:
        return f"Among the laws tried, {best.law} describes the record clearly best."
    names = ", ".join(fitted.law for fitted in near)
    return f"{best.law} describes the record best, but it cannot be told apart from {names}."


def _open_sides(best: Fitted) -> list[str]:
    estimate, found = best.estimate, []
    known = handles(estimate.problem.system)
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
