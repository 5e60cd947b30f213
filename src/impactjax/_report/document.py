"""Content of `fit.json`: the results of all fits."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from impactjax._compare.across import across
from impactjax._compare.comparison import Comparison, Fitted
from impactjax._compare.ranking import differences, rejected
from impactjax._compare.repeatability import Repeatability
from impactjax._fit.estimate import Estimate
from impactjax._fit.reason import Reason
from impactjax._fit.used_prior import UsedPrior
from impactjax._fit.verdict import Verdict
from impactjax._identify.identifiability import identifiability
from impactjax._identify.residual_diagnostics import residual_diagnostics
from impactjax._identify.words import coupling, findings
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem
from impactjax._report.given import OwnValue, given, is_assumed
from impactjax._report.json_number import json_number
from impactjax._report.outcome import outcome_of
from impactjax._report.profile_curves import Curves, curves_document
from impactjax._report.repeats import repeats_document
from impactjax._report.residual_words import residual_sentences
from impactjax._report.restitution_curves import restitution_curve, speeds_of
from impactjax._report.rows import corrected_aic
from impactjax._report.versions import versions

_EVERY = 20  # points of a curve from one that is written to the next


def document(
    comparisons: Sequence[Comparison],
    repeats: Repeatability | None = None,
    curves: Mapping[str, Curves] = MappingProxyType({}),
) -> dict[str, Any]:
    """The content of `fit.json`: all fits, software versions, seed, notes on each recording, the
    means over recordings that are repeats, and profiles of the best fit by recording.
    """
    return {
        "recording": ", ".join(each.name for each in comparisons),
        "fits": [fit for each in comparisons for fit in _fits(each, curves.get(each.name, {}))],
        "versions": versions(),
        "seed": comparisons[0].seed,
        "measured_restitution": {each.name: _measured(each) for each in comparisons},
        "notes": {each.name: list(each.notes) for each in comparisons},
        "repeatability": None if repeats is None else repeats_document(repeats),
    }


def _measured(comparison: Comparison) -> dict[str, Any] | None:
    """Restitution of each impact, from peaks or flights and without any law; null for a blow."""
    look = comparison.first_look
    return None if look is None or look.is_blow else _table(look.speeds, look.restitutions)


def _table(speeds: np.ndarray, restitutions: np.ndarray) -> dict[str, Any]:
    return {
        "approach_speed": [json_number(v) for v in speeds],
        "restitution": [json_number(r) for r in restitutions],
    }


def _fits(comparison: Comparison, curves: Curves) -> list[dict[str, Any]]:
    """The fits, each with the difference of its criterion to the best, null if that does not exist,
    and a flag for a law that the best one rules out, whose verdicts are meaningless.
    """
    estimates = [fitted.estimate for fitted in comparison]
    wider = _across(comparison)
    against_best = zip(comparison, differences(estimates), rejected(estimates), strict=True)
    return [
        {
            "recording": comparison.name,
            **_fit(fitted),
            "aic_behind": json_number(behind),
            "rejected": out,
            "across": wider if i == 0 else {},
            "profiles": curves_document(curves) if i == 0 else {},
        }
        for i, (fitted, behind, out) in enumerate(against_best)
    ]


def _across(comparison: Comparison) -> dict[str, Any]:
    """Intervals of the best fit's parameters across laws that cannot be distinguished from it."""
    return {
        name: {
            "interval95": [json_number(each.low), json_number(each.high)],
            "verdict": str(each.verdict),
            "laws": [comparison[i].name for i in each.models],
        }
        for name, each in across([fitted.estimate for fitted in comparison]).items()
    }


def _fit(fitted: Fitted) -> dict[str, Any]:
    estimate = fitted.estimate
    recording = estimate.problem.recording
    return {
        "law": fitted.name,
        "friction": "viscous and dry" if fitted.is_dry else "viscous",
        "result": _result(estimate),
        "n_samples": int(recording.observations),
        "rms_residual": {"value": json_number(estimate.rms), "unit": recording.unit},
        "aic": json_number(estimate.aic),
        "bic": json_number(estimate.bic),
        "prediction": _prediction(fitted),
        "seconds": round(fitted.seconds, 3),
        "outcome": outcome_of(fitted),
        "aicc": json_number(corrected_aic(estimate)),
        "coupling": _coupling(estimate),
        "residuals": _residuals(estimate),
        "parameters": _parameters(fitted),
        "scatter": _scatter(estimate),
        "restitution": _restitution(fitted),
        "assumptions": [each._asdict() for each in given(fitted).assumed],
    }


def _prediction(fitted: Fitted) -> dict[str, Any] | None:
    """The prediction of what was held out; `recording` is null for the end of the fitted one."""
    found, unit = fitted.prediction, fitted.estimate.problem.recording.unit
    if found is None:
        return None
    return {
        "recording": found.recording or None,
        "n_samples": found.observations,
        "rms_residual": {"value": json_number(found.rms), "unit": unit},
    }


def _result(estimate: Estimate[Problem]) -> str:
    if bool(estimate.usable):
        return "successful"
    return "misses the record" if bool(estimate.converged) else "not converged"


def _parameters(fitted: Fitted) -> dict[str, Any]:
    """All parameters, each with the assumptions it depends on."""
    estimate, known = fitted.estimate, given(fitted)
    priors = estimate.priors
    found = {**_fitted_parameters(estimate), **_fixed_parameters(estimate)}
    for name, each in found.items():
        fixed = name not in estimate.names
        own = known.own.get(name)
        each["assumed"] = fixed and is_assumed(fitted, name)
        each["rests_on"] = list(known.rests[name].on) if name in known.rests else []
        each["own"] = None if own is None else _own(own)
        each["prior"] = _prior(priors[name]) if name in priors else None
    return found


def _prior(prior: UsedPrior) -> dict[str, Any]:
    """Prior knowledge of a parameter, and the distance of the estimate from it, in its errors."""
    return {
        "value": json_number(prior.mean),
        "standard_error": json_number(prior.sigma),
        "distance": json_number(prior.distance),
        "contradicted": prior.is_contradicted,
    }


def _own(own: OwnValue) -> dict[str, Any]:
    return {
        "name": own.name,
        "value": json_number(own.value),
        "standard_error": json_number(own.error),
        "unit": own.unit,
    }


def _scatter(estimate: Estimate[Problem]) -> dict[str, Any] | None:
    """Scatter from impact to impact, and the factors between which a single impact lies."""
    scatter = estimate.scatter
    if scatter is None:
        return None
    return {
        "size": json_number(scatter.size),
        "interval95": [json_number(scatter.low), json_number(scatter.high)],
        "single_impact": [json_number(factor) for factor in scatter.single],
    }


def _restitution(fitted: Fitted) -> dict[str, Any] | None:
    """The law's restitution at some speeds, with half the width of its 95 % band; `None` for a law
    without a closed form, or without a result.
    """
    if not bool(fitted.estimate.converged):
        return None
    curve = restitution_curve(fitted.estimate, speeds_of([fitted]))
    if curve is None:
        return None
    speeds, middle, half = (np.asarray(each)[::_EVERY] for each in curve)
    return {**_table(speeds, middle), "half_width95": [json_number(v) for v in half]}


def _coupling(estimate: Estimate[Problem]) -> dict[str, Any]:
    told = identifiability(estimate)
    sizes = np.linalg.norm(np.asarray(told.sensitivities), axis=0)
    return {
        "sentence": coupling(told),
        "parameters": list(told.names),
        "scale": [json_number(v) for v in np.asarray(told.scale)],
        "sensitivity": [json_number(value) for value in sizes],
        "correlation": [[json_number(v) for v in row] for row in np.asarray(told.correlation)],
        "directions": [
            {
                "combination": each.combination,
                "exponents": each.exponents,
                "relative_error": json_number(each.relative_error),
                "determined": each.determined,
            }
            for each in findings(told)
        ],
    }


def _residuals(estimate: Estimate[Problem]) -> dict[str, Any]:
    found = residual_diagnostics(estimate)
    return {
        "sentences": residual_sentences(estimate),
        "independent": bool(found.independent),
        "autoregression_order": int(estimate.memory),
        "lasting_correlation": bool(estimate.lasting),
        "exceeds_noise": bool(estimate.exceeds_noise),
        "autocorrelation": [json_number(v) for v in np.asarray(found.autocorrelation)],
        "band": json_number(found.band),
        "portmanteau": json_number(found.portmanteau),
        "portmanteau_limit": json_number(found.portmanteau_limit),
        "runs": int(found.runs),
        "runs_expected": json_number(found.runs_expected),
        "runs_limits": [json_number(v) for v in np.asarray(found.runs_limits)],
        "skewness": json_number(found.skewness),
        "excess_kurtosis": json_number(found.excess_kurtosis),
        "after_impacts": [
            json_number(v) for v in np.asarray(found.after_impacts)[: int(estimate.impacts.count)]
        ],
    }


def _fitted_parameters(estimate: Estimate[Problem]) -> dict[str, Any]:
    return {
        name: {
            "value": json_number(estimate.values[i]),
            "standard_error": json_number(estimate.standard_errors[i]),
            "interval95": [json_number(estimate.low[i]), json_number(estimate.high[i])],
            "unit": estimate.units[i],
            "verdict": str(estimate.verdict(name)),
            "reason": str(estimate.reason(name)),
            "error_inflation": json_number(estimate.inflation[i]),
        }
        for i, name in enumerate(estimate.names)
    }


def _fixed_parameters(estimate: Estimate[Problem]) -> dict[str, Any]:
    system = estimate.system
    return {
        name: {
            "value": json_number(handle.get(system)),
            "standard_error": None,
            "interval95": None,
            "unit": handle.allowed.unit,
            "verdict": str(Verdict.FIXED),
            "reason": str(Reason.FIXED),
            "error_inflation": None,
        }
        for name, handle in handles(system).items()
        if name not in estimate.names
    }
