"""All laws on one recording, from first estimates to verdicts."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._fit.effort import effort
from impactjax._fit.estimate import Estimate
from impactjax._fit.experiment import Experiment
from impactjax._fit.first_estimates import FirstEstimates, first_estimates
from impactjax._fit.fit import pose, solve
from impactjax._fit.laws import LAWS, NO_LAW, USUAL_LAWS
from impactjax._fit.levenberg_marquardt import LevenbergMarquardt
from impactjax._fit.oscillators import OSCILLATORS
from impactjax._fit.problem import Problem
from impactjax._fit.profile import profiled
from impactjax._fit.search import Search, search
from impactjax._fit.starts import Starts
from impactjax._fit.system import handles, replaced
from impactjax._fit.verdict import Verdict
from impactjax._measure.recording import AnyRecording, ImpactTimes, Recording
from impactjax._measure.sensor import Sensor
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.stop import Stop
from impactjax._types import Scalar

_UNEXPLAINED, _SMOOTH = 0.05, 0.8  # share of the motion, and autocorrelation, of a wrong model


class Setup(NamedTuple):
    """What is known about an experiment beside its recording.

    - `oscillator`: one of the names in `OSCILLATORS`.
    - `dry_friction`: whether the oscillator has dry friction; `None` compares both in free flight.
    - `fixed`: parameters that are known, by name.
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
    """One law fitted to one recording."""

    law: str
    dry_friction: bool
    estimate: Estimate
    seconds: float


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
    if isinstance(recording, Recording) and setup.sensor is not None:
        offset = given.get("offset", setup.sensor.offset)
        values = (np.asarray(recording.values) - offset) / given.get("gain", setup.sensor.gain)
        recording = eqx.tree_at(lambda each: each.values, recording, values)
    return first_estimates(recording, oscillator, given.get("gap", 0.0))


def compare(
    recording: AnyRecording,
    setup: Setup,
    laws: Sequence[str],
    *,
    seed: int = 0,
    tell: Callable[[str], None] = lambda _: None,
    search: Search = search,
    each: Callable[..., Iterable[Fitted]] = map,
) -> list[Fitted]:
    """Each law fitted from first estimates, the best first by Akaike's criterion.

    **Arguments:**

    - `recording`: what was measured.
    - `setup`: what is known beside it.
    - `laws`: names from `LAWS`, or "none" for free flight.
    - `seed`: of the scattered starts.
    - `tell`: is told what begins.
    - `search`: what carries out the searches.
    - `each`: what goes through the laws, such as the `map` of a pool of threads, in which settings
      of JAX made by `with` do not hold.
    """

    def fitted(variant: tuple[str, bool]) -> Fitted:
        law, dry = variant
        tell(f"{law}, with dry friction" if dry else law)
        begin = time.perf_counter()
        estimate = _fitted(_problem(recording, setup, law, dry), seed, search)
        return Fitted(law, dry, estimate, time.perf_counter() - begin)

    variants = [(law, dry) for law in laws for dry in _frictions(setup, law)]
    return sorted(each(fitted, variants), key=_order)


def _frictions(setup: Setup, law: str) -> tuple[bool, ...]:
    """Without and with dry friction where free flight is to tell."""
    if law == NO_LAW and setup.dry_friction is None and _may_have_friction(setup):
        return False, True
    return (bool(setup.dry_friction),)


def _fitted(problem: Problem, seed: int, search: Search) -> Estimate:
    starts, optimiser = Starts(16, seed), LevenbergMarquardt()
    estimate = solve(problem, starts, optimiser, search)
    if bool(estimate.converged):
        estimate = profiled(estimate, optimiser, starts.count, search)
    if misfit(estimate) > 0:
        nothing = jnp.full_like(estimate.verdicts, Verdict.NOT_IDENTIFIED)
        estimate = eqx.tree_at(lambda each: each.verdicts, estimate, nothing)
    return estimate


def _order(fitted: Fitted) -> tuple[bool, float]:
    return not bool(fitted.estimate.converged), float(fitted.estimate.aic)


def misfit(estimate: Estimate) -> float:
    """The share of a record's standard deviation that a fit leaves, if that is so much, and so
    little like noise, that the model does not describe the record; else 0.
    """
    recording = estimate.problem.recording
    if isinstance(recording, ImpactTimes) or not bool(estimate.converged):
        return 0.0
    values, valid = np.asarray(recording.values), np.asarray(recording.valid)
    left = np.asarray(estimate.residuals)
    share = float(estimate.rms) / float(np.std(values[valid]))
    pairs = float(np.sum(left[1:] * left[:-1])) / float(np.sum(left**2))
    return share if share > _UNEXPLAINED and pairs > _SMOOTH else 0.0


def behind(best: Estimate, other: Estimate) -> Scalar:
    """By how much Akaike's criterion is worse than the best, for correlated residuals: the
    likelihood counts as that of the independent residuals which those of the best stand for.

    Source: Lebreton et al., Ecological Monographs 62, 67 (1992), the quasi-likelihood criterion.
    """
    n, p = best.problem.observations, len(best.names)
    share = jnp.minimum((best.freedom + p) / n.astype(best.freedom.dtype), 1.0)
    more = 2.0 * (len(other.names) - p)
    return (other.aic - best.aic - more) * share + more


def _may_have_friction(setup: Setup) -> bool:
    return setup.oscillator in ("pendulum", "linear-oscillator")


def _problem(recording: AnyRecording, setup: Setup, law: str, dry: bool) -> Problem:
    seen = first_sight(recording, setup, dry)
    stop = None if law == NO_LAW else Stop(LAWS[law](seen))
    model = ImpactOscillator(seen.oscillator, stop)
    posed = pose(Experiment(model, recording, seen.initial, setup.sensor))
    known = handles(posed.system)
    given = {name: value for name, value in {**setup.start, **setup.fixed}.items() if name in known}
    system = replaced(posed.system, tuple(given), tuple(given.values())) if given else posed.system
    wanted = {*posed.names, *setup.free} - setup.fixed.keys()
    names = tuple(name for name in known if name in wanted)
    return Problem(
        system=system,
        recording=recording,
        names=names,
        simulation=effort(recording, seen, system.model),
    )
