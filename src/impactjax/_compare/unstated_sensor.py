"""Parameters of the sensor that are fitted to a motion with impacts, because nobody stated them.

A small error of each moves parameters of the contact out of their intervals, and a test of the
residuals seldom shows it: of the zero, half the noise; of the gain, 3 %; of a low-pass, a cutoff of
60 Hz that is taken for none; of a load cell, its resonance. Where the recording tells such a
parameter, the intervals of the others hardly grow by fitting it.
"""

import dataclasses
import math

import numpy as np

from impactjax._compare.setup import Setup
from impactjax._first_look.first_look import FirstLook
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._sensor.low_pass import Butterworth, Resonance

_BENT = 0.04  # departure of a restoring force from proportionality by which a record tells its gain
_RESONANCE = ("resonance", "resonance_damping")
_RINGS, _DAMPING = 2.0, 0.5  # first resonance, relative to the usual cutoff, and its damping
_FEW = 50  # samples that do not tell of a low-pass beside all else
_START = 0.1  # first cutoff, relative to the sampling rate


def with_unstated_sensor(
    recording: AbstractRecording, look: FirstLook, setup: Setup, said: set[str]
) -> Setup:
    """The setup in which zero and drift, gain and low-pass are fitted, those that nobody stated.

    **Arguments:**

    - `recording`: recorded motion with impacts.
    - `look`: first look at it.
    - `setup`: as given by the user.
    - `said`: parameters about which the user stated anything.
    """
    zero = () if "offset" in said else ("offset", "drift")
    scale = ("gain",) if _tells_scale(recording, look, setup) else ()
    more = [name for name in (*zero, *scale) if name not in said]
    setup = setup._replace(free=(*dict.fromkeys([*setup.free, *more]),))
    return _with_low_pass(recording, setup, said)


def with_possible_low_pass(recording: AbstractRecording, setup: Setup, said: set[str]) -> Setup:
    """The setup with a low-pass to try, unless the user named one, or there are too few samples to
    tell. It is not fitted at once where a force may jump between two samples, as in a record of an
    acceleration: where there is no low-pass, its cutoff moves other parameters. Arguments are those
    of `with_unstated_sensor`.
    """
    if not _may_be_filtered(recording, setup, said):
        return setup
    return setup._replace(possible_low_pass=Butterworth(_usual_cutoff(recording), setup.order))


def with_unstated_instrument(recording: AbstractRecording, setup: Setup, said: set[str]) -> Setup:
    """The setup in which zero and resonance of the instrument that records a blow are fitted, those
    that nobody stated. Arguments are those of `with_unstated_sensor`.
    """
    if "offset" not in said:
        setup = setup._replace(free=(*dict.fromkeys([*setup.free, "offset"]),))
    few = len(recording.axis[0]) < _FEW
    if few or setup.sensor.low_pass is not None or said & {"cutoff", *_RESONANCE}:
        return setup
    low_pass = Resonance(_RINGS * _usual_cutoff(recording), _DAMPING)
    setup = setup._replace(sensor=dataclasses.replace(setup.sensor, low_pass=low_pass))
    return setup._replace(free=(*setup.free, *_RESONANCE))


def with_named_low_pass(recording: AbstractRecording, setup: Setup) -> Setup:
    """The setup with a Butterworth low-pass, if the user named a cutoff and the sensor has none. It
    has none if the cutoff is infinite, or held without a value. Likewise with a resonance.
    """
    values = {**setup.start, **setup.fixed}
    named = {*values, *setup.held, *setup.free} & {*_RESONANCE}
    if "resonance" in setup.held and setup.sensor.low_pass is None:
        return setup._replace(held=[name for name in setup.held if name not in _RESONANCE])
    if named and setup.sensor.low_pass is None:
        low_pass = Resonance(values.get("resonance", _RINGS * _usual_cutoff(recording)), _DAMPING)
        free = () if "resonance" in named else ("resonance",)
        sensor = dataclasses.replace(setup.sensor, low_pass=low_pass)
        return setup._replace(sensor=sensor, free=(*setup.free, *free))
    if "cutoff" not in {*values, *setup.held, *setup.free}:
        return setup
    unknown = "cutoff" in setup.held and setup.sensor.low_pass is None
    if unknown or values.get("cutoff") == math.inf:
        return setup._replace(
            sensor=dataclasses.replace(setup.sensor, low_pass=None),
            fixed={name: value for name, value in setup.fixed.items() if name != "cutoff"},
            start={name: value for name, value in setup.start.items() if name != "cutoff"},
            held=[name for name in setup.held if name != "cutoff"],
        )
    if setup.sensor.low_pass is not None:
        return setup
    return _filtered(setup, values.get("cutoff", _usual_cutoff(recording)))


def _with_low_pass(recording: AbstractRecording, setup: Setup, said: set[str]) -> Setup:
    """The setup with a Butterworth low-pass to be fitted, unless the user named one, a velocity
    jumps from one sample to the next, or there are too few samples to tell.
    """
    if recording.shows_jumps or not _may_be_filtered(recording, setup, said):
        return setup
    setup = _filtered(setup, _usual_cutoff(recording))
    return setup._replace(free=(*setup.free, "cutoff"))


def _may_be_filtered(recording: AbstractRecording, setup: Setup, said: set[str]) -> bool:
    """True unless the user named a low-pass, or there are too few samples to tell."""
    few = len(recording.axis[0]) < _FEW
    return not few and setup.sensor.low_pass is None and "cutoff" not in said


def _usual_cutoff(recording: AbstractRecording) -> float:
    ts, _ = recording.axis
    return _START / float(np.median(np.diff(ts)))


def _filtered(setup: Setup, cutoff: float) -> Setup:
    low_pass = Butterworth(cutoff, order=setup.order)
    return setup._replace(sensor=dataclasses.replace(setup.sensor, low_pass=low_pass))


def _tells_scale(recording: AbstractRecording, look: FirstLook, setup: Setup) -> bool:
    """True if the restoring force is far from proportional to the displacement, as that of a
    pendulum released at 30 degrees: then the period depends on the amplitude.
    """
    first = abs(float(look.initial.position))
    largest = float(np.max(np.abs(recording.span()))) if recording.shows_place else first
    restoring = float(setup.oscillator.restoring(np.array([largest]))[0])
    return abs(restoring - largest) > _BENT * largest
