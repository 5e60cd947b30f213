"""Parameters that a fit held at a value: does the record ask for them?

Their columns of the Jacobian are central differences of the evaluation that the fit compiled, so
that no program is compiled.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from impactjax._fit.estimate import Estimate
from impactjax._fit.evaluation import Evaluate
from impactjax._fit.filtered import filtered_records
from impactjax._fit.fit import best_from
from impactjax._fit.scatter_score import linearised_with_scatter
from impactjax._fit.scatter_test import as_held, assuming_scatter, scatter_test
from impactjax._fit.score_test import (
    Around,
    Candidate,
    Column,
    HeldParameter,
    linearised,
    tested,
)
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._known import AnyArray, is_known, known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.parameters import Handle, handles, with_values
from impactjax._problem.problem import Problem
from impactjax._sensor.low_pass import Butterworth
from impactjax._sensor.sensor import Sensor

_NOTICED = 2.0  # expected fall of AIC, at two standard errors or more
_DOUBTED = ("cutoff",)  # a wrong value of it moves the others, and hardly shows
_ROUNDS = 3  # fits with more and more parameters
_TESTED = ("gap", "drag", "dry_friction")  # beside those of the sensor
_FIRST = 1e-7  # first step of a difference, relative to the value, or in its unit
_CHANGE = 1e-5  # change of the record by the final step, relative to its span


def left_out(estimate: Estimate[Problem]) -> tuple[HeldParameter, ...]:
    """The parameters that a fit held at a value, those first that would lower AIC the most.

    They are the gap of each stop, drag and dry friction of an oscillator that has them, the
    parameters of the sensor, if they were neither fitted nor tied, and `scatter` of the speed after
    an impact from impact to impact, if two impacts or more were fitted by least squares. Those that
    the fitted parameters can replace are left out, and scatter that would not lower AIC. The cutoff
    of a low-pass that the sensor does not have is among them if the record looks filtered.

    **Arguments:**

    - `estimate`: estimate of a single fit.

    **Raises** `ValueError` for an estimate under `jit`, of many fits or of several recordings, for
    one with scatter from impact to impact, and for one that did not converge.
    """
    _check_no_scatter(estimate)
    candidates = _candidates(estimate, Search().evaluate)
    tests = [held for held, _ in _tests(estimate, linearised(estimate), candidates)]
    scatter = scatter_test(estimate)
    found = tests if scatter is None else [*tests, scatter]
    return tuple(sorted(found, key=lambda held: -held.gain))


def with_left_out(
    estimate: Estimate[Problem],
    *,
    fixed: Sequence[str] = (),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> Estimate[Problem]:
    """The estimate, fitted again with the parameters that the record asks for.

    Of the parameters that `left_out` calls needed the most needed one is freed, then the most
    needed one beside it, until none is left; then the fit is repeated, from the old values. The
    new estimate is kept if its AIC is lower. At the end, scatter from impact to impact is fitted if
    that is needed.

    **Arguments:**

    - `estimate`: estimate of a single fit.
    - `fixed`: names of parameters that are known, and are not to be freed; `"scatter"` for none.
    - `optimiser`: settings of the search.

    **Raises** `ValueError` as `left_out` does.
    """
    _check_no_scatter(estimate)
    for _ in range(_ROUNDS):
        found = needed(estimate, fixed)
        if not found:
            break
        problem = _freed(estimate, found)
        more = best_from(problem, Starts(1).lanes(problem), optimiser)
        if not (bool(more.converged) and float(more.aic) < float(estimate.aic)):
            break
        estimate = more
    scattering = None if "scatter" in fixed else assuming_scatter(estimate)
    clear = scattering is not None and as_held(estimate, scattering).is_needed
    return scattering if scattering is not None and clear else estimate


def _check_no_scatter(estimate: Estimate[Problem]) -> None:
    if estimate.scatter is not None:
        raise ValueError(
            "Of an estimate with scatter from impact to impact it is not tested what was left out: "
            "fit the experiment with `scatter=NoScatter()` first."
        )


def needed(
    estimate: Estimate[Problem], fixed: Sequence[str] = (), search: Search = Search()
) -> list[HeldParameter]:
    """The parameters to be freed together: each the most needed one beside those before it."""
    if estimate.scatter is not None:
        return []
    candidates = [x for x in _candidates(estimate, search.evaluate) if x.name not in fixed]
    around = linearised(estimate)
    found: list[HeldParameter] = []
    while tests := _tests(estimate, around, candidates):
        held, column = max(tests, key=lambda test: test[0].gain)
        if not held.is_needed:
            break
        found.append(held)
        around = around.beside(column)
        candidates = [each for each in candidates if each.name != held.name]
    return found


class Undecided(NamedTuple):
    """A held parameter, and the derivatives of the fitted values by it."""

    held: HeldParameter
    effect: Float[AnyArray, " parameters"]


def not_excluded(
    estimate: Estimate[Problem], fixed: Sequence[str] = (), search: Search = Search()
) -> list[Undecided]:
    """The parameters that are expected to lower AIC noticeably, but less than clearly; and the
    cutoff of a low-pass, however little it is expected to lower AIC.
    """
    candidates = [x for x in _candidates(estimate, search.evaluate) if x.name not in fixed]
    scatters, found = estimate.scatter is not None, []
    around = linearised_with_scatter(estimate, search) if scatters else linearised(estimate)
    for held, column in _tests(estimate, around, candidates):
        noticed = held.gain > _NOTICED or held.name in _DOUBTED
        if noticed and not held.is_needed:
            found.append(Undecided(held, around.effect(column)))
    return found


def _sensor_with(sensor: Sensor, found: Sequence[HeldParameter]) -> Sensor:
    """The sensor, with a Butterworth low-pass of order 2 if a cutoff was found and it has none."""
    cutoffs = [each.value for each in found if each.name == "cutoff"]
    if not cutoffs or sensor.low_pass is not None:
        return sensor
    return dataclasses.replace(sensor, low_pass=Butterworth(cutoffs[0]))


def _freed(estimate: Estimate[Problem], found: Sequence[HeldParameter]) -> Problem:
    """The problem with some more parameters to fit, which starts from the estimate."""
    problem, system = estimate.problem, estimate.system
    system = dataclasses.replace(system, sensor=_sensor_with(system.sensor, found))
    wanted = {*problem.names, *(each.name for each in found)}
    order = tuple(name for name in handles(system) if name in wanted)
    return dataclasses.replace(problem, system=system, names=order)


def _tests(
    estimate: Estimate[Problem], around: Around, candidates: Sequence[Candidate]
) -> list[tuple[HeldParameter, Column]]:
    """The tests of candidates that the record tells of, with their columns; of several low-passes
    the best one.
    """
    found: dict[str, tuple[HeldParameter, Column]] = {}
    for each in candidates:
        test = tested(estimate, around, each)
        better = each.name not in found or (test and test.gain > found[each.name][0].gain)
        if test is not None and better:
            found[each.name] = test, each.column
    return [*found.values()]


def _candidates(estimate: Estimate[Problem], evaluated: Evaluate) -> list[Candidate]:
    """The held parameters of sensor, stops and oscillator, with their columns."""
    if not is_known(estimate):
        raise ValueError(
            "`left_out` needs an estimate whose numbers are known: call it outside `jit`."
        )
    estimate.check_single()
    if not isinstance(estimate.problem, Problem):
        raise ValueError(
            "What was left out is tested for one recording fitted by `fit`: of several, take one "
            "by `of_experiment(...)`."
        )
    if not bool(estimate.converged):
        raise ValueError("The fit did not converge: what it left out cannot be tested.")
    problem, system = estimate.problem, estimate.system
    taken = {*problem.names, *(name for name, _ in problem.ties)}
    found = []
    for name, handle in handles(system).items():
        if name not in taken and (handle.path[0] == "sensor" or handle.path[-1] in _TESTED):
            held = float(handle.get(system))
            column = _column(estimate, handle, evaluated)
            if column is not None:
                found.append(Candidate(name, handle.allowed.unit, held, column))
    for low_pass, column in filtered_records(estimate):
        found.append(Candidate("cutoff", "Hz", math.inf, column, low_pass))
    return found


def _column(estimate: Estimate[Problem], handle: Handle, evaluated: Evaluate) -> Column | None:
    """Derivative of the residuals by a held parameter; `None` if the record does not show it."""
    problem, allowed = estimate.problem, handle.allowed
    padded, held = problem.padded(), handle.get(problem.system)
    if estimate.scatter is not None:
        padded = padded.scattered(known(estimate.scatter.logarithms))
    padded = padded.of_record()
    u = jnp.asarray(problem.coordinates(known(estimate.values)))
    parts, no = jnp.asarray(padded.parts(LevenbergMarquardt().horizons)), jnp.zeros((), bool)
    count = problem.valid.shape[-1]

    def residuals(change: float) -> Column:
        # The sum has the type of `held`, so that the compiled evaluation is found again.
        system = with_values(padded.system, [handle], [held + change])
        answer = evaluated(dataclasses.replace(padded, system=system), u, parts, no)
        return np.asarray(answer.answer.residuals)[:count]

    def difference(step: float) -> Column:
        low, high = max(-step, allowed.low - float(held)), min(step, allowed.high - float(held))
        return (residuals(high) - residuals(low)) / (high - low)

    with np.errstate(all="ignore"):
        effect = float(np.max(np.abs(difference(_FIRST * (abs(float(held)) or 1.0)))))
        if not np.isfinite(effect) or effect == 0:
            return None
        lowest, highest = problem.recording.span()
        column = difference(_CHANGE * (highest - lowest) / effect)
    return column if np.all(np.isfinite(column)) else None
