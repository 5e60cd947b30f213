"""Numbers with as many digits as their error allows."""

import math

ANY = "any value"


def with_error(value: float, error: float) -> str:
    """A value with its standard error, both to two digits of the error."""
    if not (math.isfinite(error) and error > 0):
        return f"{value:.6g}"
    shown = _rounded(value, error)
    return f"{shown} ± {error:.2g}" if "e" in shown else f"{shown} ± {_rounded(error, error)}"


def interval(low: float, high: float, error: float) -> str:
    """The 95 % interval to two digits of the standard error: "0.51 to 0.63", "less than 0.63" if
    one side is open, "? to 0.63" if one end is not known (NaN).
    """
    if math.isnan(low) or math.isnan(high):
        ends = ("?" if math.isnan(end) else _rounded(end, error) for end in (low, high))
        return " to ".join(ends)
    if math.isinf(low) and math.isinf(high):
        return ANY
    if math.isinf(high):
        return f"more than {_rounded(low, error)}"
    if math.isinf(low):
        return f"less than {_rounded(high, error)}"
    return f"{_rounded(low, error)} to {_rounded(high, error)}"


def with_unit(shown: str, unit: str) -> str:
    """A number with its unit; a pure number, or any number, has none."""
    return shown if unit == "1" or shown == ANY else f"{shown} {unit}"


def apart(value: float, limit: float) -> tuple[str, str]:
    """Two numbers to three digits, or to as many as are needed to distinguish them."""
    for digits in range(3, 17):
        shown = f"{value:.{digits}g}", f"{limit:.{digits}g}"
        if shown[0] != shown[1]:
            return shown
    return f"{value:.3g}", f"{limit:.3g}"


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
