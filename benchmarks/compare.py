"""One comparison: both sides prepared, timed in turn, checked."""

import importlib
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING

import accuracy
import ours
import timing
from rivals.prepared import Prepared

if TYPE_CHECKING:
    from peers import Task

Line = dict[str, object]


@cache
def _rival(peer: str) -> ModuleType | None:
    """The peer's module, or None where the peer is not installed."""
    try:
        return importlib.import_module(f"rivals.{peer}_rival")
    except ModuleNotFoundError as missing:
        if missing.name is not None and missing.name.startswith("rivals"):
            raise
        return None


@cache
def _ours(function: str, law: str) -> Prepared | None:
    """Our side, or None while it is not written."""
    try:
        return getattr(ours, function)(law)
    except NotImplementedError:
        return None


def line(row: "Task", law: str, peer: str, quick: bool) -> Line | None:
    """The comparison's line; None where the peer does not offer the task."""
    head: Line = {"task": row.task, "part": row.part, "law": law, "peer": peer}
    rival = _rival(peer)
    if rival is None:
        # said once a task: a variant belongs to one peer
        return None if row.variant else {**head, "status": "not installed"}
    if not hasattr(rival, row.rival_function):
        return None
    theirs = getattr(rival, row.rival_function)(law)
    return {**head, **_measured(row.function, law, theirs, quick)}


def _measured(function: str, law: str, theirs: Prepared, quick: bool) -> Line:
    own = _ours(function, law)
    sides = [theirs] if own is None else [own, theirs]
    effort = timing.QUICK if quick else timing.FULL
    timings = timing.in_turn([side.run for side in sides], effort)
    theirs_error, unit = accuracy.error(function, law, theirs)
    line: Line = {"status": "ours not implemented" if own is None else "measured"}
    line |= {"how": theirs.how, "ours_how": None, "ours_us": None, "ratio": None}
    line |= _side("theirs", theirs, timings[-1]) | {"theirs_error": theirs_error}
    line |= {"ours_error": None, "error_unit": unit, "lanes": theirs.lanes}
    if own is not None:
        line |= _side("ours", own, timings[0]) | {"ours_how": own.how}
        line["ours_error"] = accuracy.error(function, law, own)[0]
        per_lane = timings[0].median / own.lanes, timings[-1].median / theirs.lanes
        line["ratio"] = _rounded(per_lane[0] / per_lane[1])
    return line


def _side(name: str, prepared: Prepared, measured: timing.Timing) -> Line:
    return {
        f"{name}_us": _rounded(measured.median / prepared.lanes * 1e6),
        f"{name}_spread": _rounded(measured.spread),
        f"{name}_build_s": _rounded(prepared.build_seconds),
    }


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
