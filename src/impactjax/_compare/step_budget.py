"""Numbers of steps and impacts that the simulation of a recording is expected to need."""

import math

import jax.numpy as jnp

from impactjax._first_look.first_look import FirstLook
from impactjax._hybrid.chunks import CHUNK
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._simulate.default_step import natural_step
from impactjax._simulate.simulation import Simulation
from impactjax._simulate.taylor_step import TaylorStep

_TOLERANCE = 1e-8  # default of `simulate` in double precision
_FADED = 1e-3  # speed, relative to the fastest, below which a chatter series is summed
_MARGIN = 1.5  # safety factor, since parameters differ from the first estimates
_TURN_STEPS = 8  # steps for a swing from one side to the other
_IMPACT_STEPS = 8  # steps for an impact and the flight that follows
_CYCLE_STEPS = 20  # steps for a cycle of a mass that settles in a compliant stop
_SLOWEST = 100  # cycles of settling that are expected at most
_DEARER = 4  # ratio of the steps of a Runge-Kutta method to those of Taylor series


def step_budget(
    recording: AbstractRecording, look: FirstLook, model: ImpactOscillator
) -> Simulation:
    """Simulation settings with 1.5 times the steps and impacts that are expected, rounded up to
    powers of two.
    """
    swings = _swings(recording, look)
    impacts = 0.0 if model.lower is None else swings + look.speeds.size + _chatter(look, model)
    step = natural_step(model, _TOLERANCE)
    dearer = 1 if isinstance(step, TaylorStep) else _DEARER
    moving = _TURN_STEPS * swings + _IMPACT_STEPS * impacts + _settling(recording, look, model)
    steps = dearer * moving + _pieces(recording, model)
    steps = _MARGIN * steps + CHUNK
    return Simulation(max_steps=_power(steps), max_impacts=_power(_MARGIN * impacts + 8))


def _power(number: float) -> int:
    """The next power of two, so that similar recordings share a compiled program."""
    return 2 ** math.ceil(math.log2(number))


def _pieces(recording: AbstractRecording, model: ImpactOscillator) -> float:
    """Expected number of smooth pieces of the equation of motion, of which each takes a step."""
    begin, end = (jnp.asarray(float(time)) for time in (recording.begin, recording.end))
    first = model.oscillator.smooth_until(begin)
    second = None if first is None else model.oscillator.smooth_until(first)
    return 0.0 if first is None or second is None else float((end - begin) / (second - first))


def _swings(recording: AbstractRecording, look: FirstLook) -> float:
    """Expected number of half periods; 0 for an oscillator without an equilibrium."""
    if recording.observes_impacts or not look.oscillator.has_equilibrium():
        return 0.0
    half = look.oscillator.half_period(0.0)
    return 0.0 if half is None else float(recording.end - recording.begin) / half


def _chatter(look: FirstLook, model: ImpactOscillator) -> float:
    """Expected impacts of a chatter series before it is summed; 0 if no force presses the mass onto
    the stop.
    """
    assert model.lower is not None
    return 0.0 if _is_still(look, model) else math.log(_FADED) / math.log(_restitution(look))


def _settling(recording: AbstractRecording, look: FirstLook, model: ImpactOscillator) -> float:
    """Expected steps of a mass that comes to rest in a compliant stop: its speed falls by r in half
    a cycle, down to the tolerance. None if the record ends before.
    """
    compliant = model.lower is not None and isinstance(model.lower.law, AbstractForceLaw)
    if not compliant or _is_still(look, model):
        return 0.0
    weight, r = look.oscillator.weight(), _restitution(look)
    if weight is not None and look.speeds.size:
        flights = 2 * float(look.speeds[-1]) * r / (weight * (1 - r))
        if float(recording.end) < float(look.marks[-1]) + flights:
            return 0.0
    cycles = math.log(_TOLERANCE) / (2 * math.log(r))
    return _CYCLE_STEPS * min(cycles, _SLOWEST)


def _is_still(look: FirstLook, model: ImpactOscillator) -> bool:
    """True if no force presses the mass onto the stop."""
    assert model.lower is not None
    return look.oscillator.has_equilibrium() and float(model.lower.gap) == 0


def _restitution(look: FirstLook) -> float:
    return min(max(look.restitution, 0.1), 0.97)
