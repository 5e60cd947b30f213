"""A low-pass that was fitted to a recorded velocity, and passes nearly all."""

import dataclasses

import numpy as np

from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Change, Settings, fit_models, ranked
from impactjax._compare.ranking import CLEAR, fall
from impactjax._problem.experiment import Experiment
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.read_recording import count_of
from impactjax._sensor.low_pass import Butterworth

_PASSES = 4.0  # cutoff, relative to the usual one, above which a low-pass passes nearly all


def without_needless_low_pass(
    low_pass: Butterworth | None,
    own: dict[str, Experiment],
    fits: dict[str, Fitted],
    settings: Settings,
) -> Change | None:
    """All models without the low-pass that was fitted to a recorded velocity; `None` unless it
    passes nearly all and all stops are rigid, or if it lowers the criterion clearly.

    The cutoff of such a low-pass has false minima, and without one the likelihood jumps where an
    impact passes a sample. So samples beside impacts, from which alone such a cutoff follows, are
    left out of both fits that are compared. If there is a law with contacts that last, nothing is
    left out: the same samples tell how long.

    **Arguments:**

    - `low_pass`: the low-pass that was fitted first, which nobody stated; `None` if there is none.
    """
    best = ranked(fits)[0]
    filtered, system = own[best.name], best.estimate.system
    recording = filtered.recording
    if low_pass is None or "cutoff" not in best.estimate.names:
        return None
    if not recording.jumps or any(np.any(x.estimate.impacts.duration) for x in fits.values()):
        return None
    if not float(best.estimate["cutoff"].value) > _PASSES * float(low_pass.cutoff):
        return None
    beside = np.asarray(recording.at_impacts(best.estimate.impacts, system.sensor.delay))
    if not np.any(beside & np.asarray(recording.valid)):
        return None
    rest = recording.without(beside)
    plain = {name: _unfiltered(each, rest) for name, each in own.items()}
    fewer = fit_models(plain, settings, fits)
    apart = {best.name: dataclasses.replace(filtered, recording=rest)}
    again = fit_models(apart, settings, {best.name: best})[best.name]
    found = ranked(fewer)[0].estimate
    if not bool(found.converged) or fall(found, again.estimate) >= CLEAR:
        return None
    said = (
        "The record does not ask for a low-pass, which was fitted first: there is none, and "
        f"{count_of(beside, 'sample')} beside a jump of velocity, and left out."
    )
    return Change(plain, fewer, said)


def _unfiltered(experiment: Experiment, recording: AbstractRecording) -> Experiment:
    """The experiment without a low-pass, on a recording."""
    sensor = dataclasses.replace(experiment.sensor, low_pass=None)
    free = [name for name in experiment.free if name != "cutoff"]
    return dataclasses.replace(experiment, recording=recording, sensor=sensor, free=free)
