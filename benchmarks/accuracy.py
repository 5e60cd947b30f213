"""The error of a result of each task, against `rivals/reference.py`."""

from functools import cache

import numpy as np

from rivals import reference, tasks
from rivals.prepared import Prepared

RADIANS = "rad"
RELATIVE = "largest value of each derivative"
DEVIATIONS = "standard errors of the estimate"
CHECKED_LANES = (0, 300, 700, 950)


@cache
def _angles(law: str, lane: int | None) -> np.ndarray:
    values = tasks.parameters(law) if lane is None else tasks.drawn_parameters(law)[lane]
    return reference.angles(law, values, tasks.TIMES)


@cache
def _derivatives(law: str, lane: int | None) -> np.ndarray:
    values = tasks.parameters(law) if lane is None else tasks.drawn_parameters(law)[lane]
    return reference.derivatives(law, values, tasks.TIMES)


@cache
def _record() -> np.ndarray:
    values = tasks.parameters(tasks.KELVIN_VOIGT)
    times, forcing = tasks.RECORD_TIMES, tasks.RECORD_FORCING
    return reference.angles(tasks.KELVIN_VOIGT, values, times, forcing)


@cache
def _all_lanes(law: str) -> np.ndarray | None:
    """All lanes of T2 by heyoka at rounding error; mpmath would take minutes."""
    try:
        from rivals import heyoka_rival
    except ImportError:
        return None
    return heyoka_rival.exact(law)


@cache
def _sweep() -> tuple[np.ndarray, np.ndarray] | None:
    """The sweep by heyoka at rounding error, and at which frequencies samples can be compared."""
    try:
        from rivals import heyoka_rival
    except ImportError:
        return None
    return heyoka_rival.exact_sweep()


def _far(result: np.ndarray, exact: np.ndarray) -> float:
    return float(np.max(np.abs(result - exact)))


def _relative(result: np.ndarray, exact: np.ndarray) -> float:
    scale = np.max(np.abs(exact), axis=1, keepdims=True)
    return _far(result / scale, exact / scale)


def _t2(law: str, prepared: Prepared, result: np.ndarray) -> float:
    lanes = [lane for lane in CHECKED_LANES if lane % prepared.stride == 0]
    worst = max(_far(result[lane // prepared.stride], _angles(law, lane)) for lane in lanes)
    exact = _all_lanes(law)
    return worst if exact is None else max(worst, _far(result, exact[:: prepared.stride]))


def _t3_batch(law: str, prepared: Prepared, result: np.ndarray) -> float:
    lanes = [lane for lane in CHECKED_LANES[:2] if lane % prepared.stride == 0]
    return max(_relative(result[k // prepared.stride], _derivatives(law, k)) for k in lanes)


def _t4_sweep(prepared: Prepared, result: np.ndarray) -> float | None:
    exact = _sweep()
    if exact is None:
        return None
    samples, comparable = (part[:: prepared.stride] for part in exact)
    return _far(result[comparable], samples[comparable])


def _t5(law: str, result: np.ndarray) -> float:
    best, deviations = reference.best_fit(law)
    return float(np.max(np.abs(result - best) / deviations))


def error(function: str, law: str, prepared: Prepared) -> tuple[float | None, str]:
    """The largest error of a task's result, and its unit."""
    result = prepared.run()
    match function:
        case "t1":
            return _far(result, _angles(law, None)), RADIANS
        case "t2":
            return _t2(law, prepared, result), RADIANS
        case "t3":
            return _relative(result, _derivatives(law, None)), RELATIVE
        case "t3_batch":
            return _t3_batch(law, prepared, result), RELATIVE
        case "t4":
            return _far(result, _record()), RADIANS
        case "t4_sweep":
            return _t4_sweep(prepared, result), RADIANS
        case "t5":
            return _t5(law, result), DEVIATIONS
    raise ValueError(f"Argument `function` must name a task, but is {function!r}.")
