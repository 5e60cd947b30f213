"""Numbers as people read them: degrees, milliseconds, and as many digits as the error allows."""

import math

from impactjax._fit.estimate import Estimate
from impactjax._fit.verdict import Verdict
from impactjax._measure.recording import AnyRecording, ImpactTimes


def shown_unit(recording: AnyRecording) -> tuple[str, float]:
    """The unit in which a recording is shown, and the factor from SI."""
    if isinstance(recording, ImpactTimes):
        return "ms", 1e3
    quantity = recording.quantity
    return quantity.shown, 1 / quantity.units[quantity.shown]


def quoted(estimate: Estimate, name: str) -> str:
    """A parameter's value with its standard error; only its bound, where the recording gives it no
    more than that and the error is no measure of it.
    """
    i = estimate.names.index(name)
    value, error = float(estimate.values[i]), float(estimate.standard_errors[i])
    if estimate.verdict(name) is Verdict.IDENTIFIED or error < abs(value) / 2:
        return with_error(value, error)
    return interval(*bounds(estimate, name), error)


def bounds(estimate: Estimate, name: str) -> tuple[float, float]:
    """The 95 % interval, without end where only the parameter's range ends it."""
    i = estimate.names.index(name)
    allowed = estimate.problem.handles()[name].allowed
    low, high = float(estimate.low[i]), float(estimate.high[i])
    return low if low > allowed.low else -math.inf, high if high < allowed.high else math.inf


def with_error(value: float, error: float) -> str:
    """A value with its standard error, both to two digits of the error."""
    if not (math.isfinite(error) and error > 0):
        return f"{value:.6g}"
    shown = _rounded(value, error)
    return f"{shown} ± {error:.2g}" if "e" in shown else f"{shown} ± {_rounded(error, error)}"


def interval(low: float, high: float, error: float) -> str:
    """The 95 % interval to two digits of the standard error; an open side is said."""
    if math.isinf(low) and math.isinf(high):
        return "any value"
    if math.isinf(high):
        return f"more than {_rounded(low, error)}"
    if math.isinf(low):
        return f"less than {_rounded(high, error)}"
    return f"{_rounded(low, error)} to {_rounded(high, error)}"


def _rounded(value: float, error: float) -> str:
    """A value to two digits of an error, if that is a sensible number of digits."""
    if not (math.isfinite(error) and error > 0):
        return f"{value:.4g}"
    digits = 1 - math.floor(math.log10(error))
    if 0 <= digits <= 8 and abs(value) < 1e7:
        return f"{value:.{digits}f}"
    if error > abs(value):
        return f"{value:.3g}"
    if abs(value) < 1e6 and digits < 0:
        return f"{round(value, digits):.0f}"
    return f"{value:.{math.floor(math.log10(abs(value))) + digits + 1}g}"
