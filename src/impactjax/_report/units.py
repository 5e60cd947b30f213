"""Numbers as people read them: degrees, milliseconds, and as many digits as the error allows."""

import math

from impactjax._measure.recording import AnyRecording, ImpactTimes


def shown_unit(recording: AnyRecording) -> tuple[str, float]:
    """The unit in which a recording is shown, and the factor from SI."""
    if isinstance(recording, ImpactTimes):
        return "ms", 1e3
    quantity = recording.quantity
    return quantity.shown, 1 / quantity.units[quantity.shown]


def with_error(value: float, error: float) -> str:
    """A value with its standard error, both to two digits of the error."""
    if not (math.isfinite(error) and error > 0):
        return f"{value:.6g}"
    return f"{_rounded(value, error)} ± {_rounded(error, error)}"


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
    return f"{value:.3g}" if error > abs(value) else f"{value:.6g}"
