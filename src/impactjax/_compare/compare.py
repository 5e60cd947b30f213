"""All laws on one recording, from first estimates to verdicts."""

import dataclasses
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from impactjax._compare.laws import LAWS, NO_LAW, USUAL_LAWS
from impactjax._compare.nested import Variant, in_stages, special_case, starts_beside
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.ranking import best_first
from impactjax._compare.step_budget import effort
from impactjax._first_look.first_estimates import FirstEstimates, first_estimates
from impactjax._fit.estimate import Estimate
from impactjax._fit.fit import best_from, pose
from impactjax._fit.profile import profiled_by
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._fit.verdict import Verdict
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.stop import Stop
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._parameter import Range
from impactjax._problem.checks import check_known, check_value
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import Start, System, handles, replaced
from impactjax._problem.problem import Problem
from impactjax._record.recording import AnyRecording, ImpactTimes
from impactjax._sensor.sensor import Sensor

_ROUNDING = 1e-6  # relative, of an rms


class Setup(NamedTuple):
    """What is known about an experiment beside its recording.

    - `oscillator`: one of the names in `OSCILLATORS`.
    - `dry_friction`: whether the oscillator has dry friction; `None` compares both in free flight.
    - `fixed`: parameters that are known, by name; those that only other laws have do not matter.
    - `start`: better starting values than the first estimates, by name.
    - `free`: parameters to fit although they are usually known, such as a sensor's offset.
    - `sensor`: what stands between motion and recording, if anything.
    """

    oscillator: str
    dry_friction: bool | None = None
    fixed: Mapping[str, float] = {}
    start: Mapping[str, float] = {}
    free: Sequence[str] = ()
    sensor: Sensor | None = None


class Fitted(NamedTuple):
    """One law fitted to one recording.

    - `stated`: the parameters whose values somebody stated, by name.
    - `worse_than`: names of special cases of it that fit better, which is an error of the search:
      the estimate counts as not converged.
    """

    law: str
    dry_friction: bool
    estimate: Estimate
    seconds: float
    stated: tuple[str, ...] = ()
    worse_than: tuple[str, ...] = ()


def laws_for(recording: AnyRecording, setup: Setup) -> list[str]:
    """The usual laws, to try where none was asked for; no law at all if the motion is free."""
    if isinstance(recording, ImpactTimes):
        return list(USUAL_LAWS)
    seen = first_sight(recording, setup)
    return [NO_LAW] if seen.swings_freely and seen.elsewhere is None else list(USUAL_LAWS)


def first_sight(recording: AnyRecording, setup: Setup, dry: bool = False) -> FirstEstimates:
    """What the recording shows before any fit, given what is known."""
    oscillator = OSCILLATORS[setup.oscillator](setup.fixed, dry)
    given = {**setup.start, **setup.fixed}
    own = Sensor() if setup.sensor is None else setup.sensor
    sensor = Sensor(given.get("gain", own.gain), given.get("offset", own.offset))
    return first_estimates(recording, oscillator, given.get("gap", 0.0), sensor)


def compare(
    recording: AnyRecording,
    setup: Setup,
    laws: Sequence[str],
    *,
    seed: int = 0,
    tell: Callable[[str], None] = lambda _: None,
    each: Callable[..., Iterable[Fitted]] = map,
) -> list[Fitted]:
    """Each law fitted from first estimates, the best first by Akaike's criterion. A law that holds
    others as special cases is fitted after them, and from their answers too.

    **Arguments:**

    - `recording`: what was measured.
    - `setup`: what is known beside it.
    - `laws`: names from `LAWS`, or "none" for free flight.
    - `seed`: of the scattered starts.
    - `tell`: is told what begins.
    - `each`: what goes through the laws, such as the `map` of a pool of threads, in which settings
      of JAX made by `with` do not hold.

    **Raises** `ValueError` as `fit` does, for an oscillator or a law that has no such name, and for
    what a setup says of a parameter that the system does not have with any law.
    """
    return compare_by(Search(), recording, setup, laws, seed, tell, each)


def compare_by(
    search: Search,
    recording: AnyRecording,
    setup: Setup,
    laws: Sequence[str],
    seed: int,
    tell: Callable[[str], None],
    each: Callable[..., Iterable[Fitted]],
) -> list[Fitted]:
    """As `compare`, by a search that one chooses."""
    _check_names(setup, laws)

    done: dict[Variant, Fitted] = {}

    def fitted(variant: Variant) -> Fitted:
        law, dry = variant
        tell(f"{law}, with dry friction" if dry else law)
        begin = time.perf_counter()
        problem = _problem(recording, setup, law, dry)
        cases = _special_cases(variant, problem, done)
        beside = [values for values, _ in cases.values()]
        estimate = _fitted(problem, seed, search, beside)
        better = tuple(name for name, (_, own) in cases.items() if _is_worse(estimate, own))
        if better:
            nothing = jnp.full_like(estimate.verdicts, Verdict.NOT_IDENTIFIED)
            estimate = dataclasses.replace(
                estimate, converged=jnp.zeros_like(estimate.converged), verdicts=nothing
            )
        return Fitted(law, dry, estimate, time.perf_counter() - begin, stated, better)

    stated = tuple({**setup.start, **setup.fixed})
    variants = [(law, dry) for law in laws for dry in _frictions(setup, law)]
    _check_setup(recording, setup, variants)
    for stage in in_stages(variants):
        done |= dict(zip(stage, each(fitted, stage), strict=True))
    fits = list(done.values())
    return [fits[i] for i in best_first([fit.estimate for fit in fits])]


def _special_cases(
    variant: Variant, problem: Problem, done: Mapping[Variant, Fitted]
) -> dict[str, tuple[np.ndarray, Estimate]]:
    """The answers of a model's special cases, as its own parameters, by their names."""
    found = {}
    for small, fitted in done.items():
        if bool(fitted.estimate.converged):
            values = special_case(variant, problem, small, fitted.estimate)
            if values is not None:
                name = f"{small[0]} with dry friction" if small[1] else small[0]
                found[name] = (values, fitted.estimate)
    return found


def _is_worse(estimate: Estimate, special: Estimate) -> bool:
    return not float(estimate.rms) <= (1 + _ROUNDING) * float(special.rms)


def _frictions(setup: Setup, law: str) -> tuple[bool, ...]:
    """Without and with dry friction where free flight is to tell; with it if it is spoken of."""
    if "dry_friction" in {*setup.fixed, *setup.start, *setup.free}:
        return (True,)
    if law == NO_LAW and setup.dry_friction is None and _may_have_friction(setup):
        return False, True
    return (bool(setup.dry_friction),)


def _check_names(setup: Setup, laws: Sequence[str]) -> None:
    named = [("oscillator", setup.oscillator, [*OSCILLATORS])]
    named += [("law", law, [NO_LAW, *LAWS]) for law in laws]
    for kind, name, known in named:
        if name not in known:
            raise ValueError(f"There is no {kind} `{name}`; there are {', '.join(known)}.")


def _check_setup(
    recording: AnyRecording, setup: Setup, variants: Sequence[tuple[str, bool]]
) -> None:
    """Checks what is said of parameters, of those that only other laws have too."""
    given = [*setup.fixed.items(), *setup.start.items()]
    asked = dict.fromkeys([*setup.fixed, *setup.start, *setup.free])
    if not asked:
        return
    if setup.dry_friction is False and "dry_friction" in asked:
        raise ValueError("The setup speaks of `dry_friction`, and says that there is none.")
    dry = any(dry for _, dry in variants)
    known: dict[str, Range] = {}
    for law in dict.fromkeys([*(law for law, _ in variants), *LAWS]):
        if not known.keys() >= asked.keys():
            found = handles(_system(first_sight(recording, setup, dry), setup, law))
            known |= {name: handle.allowed for name, handle in found.items()}
    for name in asked:
        check_known(name, known)
        if name in setup.free and name in setup.fixed:
            raise ValueError(f"`{name}` is in both `free` and `fixed` of the setup.")
    for name, value in given:
        check_value(name, value, known[name])


def _fitted(problem: Problem, seed: int, search: Search, cases: Sequence[np.ndarray]) -> Estimate:
    """The best of searches from scattered starts and from special cases."""
    starts, optimiser = Starts(16, seed), LevenbergMarquardt()
    lanes = starts.lanes(problem)
    beside = starts_beside(problem, cases, lanes) if cases else None
    estimate = best_from(problem, lanes, optimiser, search, beside)
    return profiled_by(search, estimate, optimiser)


def _may_have_friction(setup: Setup) -> bool:
    return setup.oscillator in ("pendulum", "linear-oscillator")


def _problem(recording: AnyRecording, setup: Setup, law: str, dry: bool) -> Problem:
    seen = first_sight(recording, setup, dry)
    system = _system(seen, setup, law)
    known = handles(system)
    fixed, start = (
        {name: value for name, value in given.items() if name in known}
        for given in (setup.fixed, setup.start)
    )
    free = [name for name in setup.free if name in known]
    posed = pose(Experiment(system.model, recording, system.initial, system.sensor, fixed, free))
    start = {name: value for name, value in start.items() if name not in fixed}
    begun = replaced(posed.system, tuple(start), tuple(start.values())) if start else posed.system
    simulation = effort(recording, seen, begun.model)
    return dataclasses.replace(posed, system=begun, simulation=simulation)


def _system(seen: FirstEstimates, setup: Setup, law: str) -> System:
    """The system that a recording shows at first sight, with a law."""
    stop = None if law == NO_LAW else Stop(LAWS[law](seen))
    sensor = Sensor() if setup.sensor is None else setup.sensor
    return System(ImpactOscillator(seen.oscillator, stop), seen.initial, Start(0.0), sensor)
