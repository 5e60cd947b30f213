"""What a run of fits says, as the document `fit.json`."""

import importlib.metadata
import math
import platform
from collections.abc import Sequence
from typing import Any

import numpy as np

from impactjax._fit.compare import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._fit.system import handles
from impactjax._fit.verdict import Verdict
from impactjax._measure.recording import ImpactTimes

_PACKAGES = ("impactjax", "jax", "jaxlib", "diffrax", "numpy", "scipy")


def document(fits: Sequence[tuple[str, Fitted]], seed: int) -> dict[str, Any]:
    """The content of `fit.json`: fits with the name of their recording, and what made them."""
    names = list(dict.fromkeys(name for name, _ in fits))
    return {
        "recording": ", ".join(names),
        "fits": [{"recording": name, **_fit(fitted)} for name, fitted in fits],
        "versions": versions(),
        "seed": seed,
    }


def versions() -> dict[str, str]:
    """The software that a result depends on."""
    found = {name: importlib.metadata.version(name) for name in _PACKAGES}
    return {"python": platform.python_version(), **found}


def _fit(fitted: Fitted) -> dict[str, Any]:
    estimate = fitted.estimate
    recording = estimate.problem.recording
    unit = "s" if isinstance(recording, ImpactTimes) else recording.quantity.unit
    return {
        "law": fitted.law,
        "friction": "viscous and dry" if fitted.dry_friction else "viscous",
        "result": "successful" if bool(estimate.converged) else "not converged",
        "n_samples": int(recording.observations),
        "rms_residual": {"value": _number(estimate.rms), "unit": unit},
        "aic": _number(estimate.aic),
        "bic": _number(estimate.bic),
        "seconds": round(fitted.seconds, 3),
        "parameters": {**_fitted_parameters(estimate), **_fixed_parameters(estimate)},
    }


def _fitted_parameters(estimate: Estimate) -> dict[str, Any]:
    return {
        name: {
            "value": _number(estimate.values[i]),
            "standard_error": _number(estimate.standard_errors[i]),
            "interval95": [_number(estimate.low[i]), _number(estimate.high[i])],
            "unit": estimate.units[i],
            "verdict": str(estimate.verdict(name)),
        }
        for i, name in enumerate(estimate.names)
    }


def _fixed_parameters(estimate: Estimate) -> dict[str, Any]:
    system = estimate.system
    return {
        name: {
            "value": _number(handle.get(system)),
            "standard_error": None,
            "interval95": None,
            "unit": handle.allowed.unit,
            "verdict": str(Verdict.FIXED),
        }
        for name, handle in handles(system).items()
        if name not in estimate.names
    }


def _number(value: Any) -> float | None:  # noqa: ANN401
    """A JSON number; null for what is not finite."""
    number = float(np.asarray(value))
    return number if math.isfinite(number) else None
