"""Parameters of the sensor that are fitted to a motion with impacts, because nobody stated them.

A small error of each moves parameters of the contact out of their intervals, and a test of the
residuals seldom shows it: of the zero, half the noise; of the gain, 3 %; of a low-pass, a cutoff of
60 Hz that is taken for none. Where the recording tells such a parameter, the intervals of the
others hardly grow by fitting it.
"""

import dataclasses

import numpy as np

from impactjax._compare.setup import Setup
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._sensor.low_pass import Butterworth

_BENT = 0.04  # departure of a restoring force from proportionality by which a record tells its gain
_START = 0.1  # first cutoff, relative to the sampling rate


def with_unstated_sensor(recording: AbstractRecording, setup: Setup, said: set[str]) -> Setup:
    """The setup in which zero and drift, gain and low-pass are fitted, those that nobody stated.

    **Arguments:**

    - `recording`: recorded motion with impacts.
    - `setup`: as given by the user.
    - `said`: parameters about which the user stated anything.
    """
    zero = () if "offset" in said else ("offset", "drift")
    scale = ("gain",) if _tells_scale(recording, setup) else ()
    more = [name for name in (*zero, *scale) if name not in said]
    setup = setup._replace(free=(*dict.fromkeys([*setup.free, *more]),))
    return _with_low_pass(recording, setup, said)


def _with_low_pass(recording: AbstractRecording, setup: Setup, said: set[str]) -> Setup:
    """The setup with a Butterworth low-pass of order 2 to be fitted, unless the user named one."""
    if setup.sensor.low_pass is not None or "cutoff" in said:
        return setup
    ts, _ = recording.axis
    low_pass = Butterworth(_START / float(np.median(np.diff(ts))))
    sensor = dataclasses.replace(setup.sensor, low_pass=low_pass)
    return setup._replace(sensor=sensor, free=(*setup.free, "cutoff"))


def _tells_scale(recording: AbstractRecording, setup: Setup) -> bool:
    """True if the restoring force is far from proportional to the displacement, as that of a
    pendulum released at 30 degrees: then the period depends on the amplitude.
    """
    largest = np.max(np.abs(recording.span()))
    restoring = setup.oscillator.restoring(np.array([largest]))[0]
    return bool(abs(restoring / largest - 1) > _BENT)
