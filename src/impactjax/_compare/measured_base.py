"""Motion of the base that was recorded beside the motion on it."""

import numpy as np

from impactjax._compare.said import sidecar_error
from impactjax._model.measured_motion import MeasuredMotion
from impactjax._record.read_recording import RecordingFile, read_base
from impactjax._record.recording import Recording
from impactjax._sensor.quantity import Acceleration, Displacement

_MOTIONS = {Acceleration: MeasuredMotion, Displacement: MeasuredMotion.of_displacement}


def measured_base(file: RecordingFile) -> MeasuredMotion:
    """The motion of the base that [base] in a file's sidecar names: a column of the same file, or
    of another one, with the same clock.

    **Raises** `FileError` for a quantity other than acceleration and displacement, and for a
    measurement that does not cover the recording.
    """
    found, key = read_base(file), "recording" if file.sidecar.base.column is None else "column"
    measured, name = found.recording, found.path.name
    make = _MOTIONS.get(type(measured.quantity)) if isinstance(measured, Recording) else None
    if make is None or not isinstance(measured, Recording):
        problem = f"{name} holds {measured.observed}, which does not tell how the base moves"
        raise sidecar_error(file, key, problem, "name an acceleration or a displacement")
    valid = np.asarray(measured.valid)
    times, values = (np.asarray(each)[valid] for each in (measured.ts, measured.values))
    begin, end = float(file.recording.begin), float(file.recording.end)
    if not times[0] <= begin <= end <= times[-1]:
        problem = f"{name} goes from {times[0]:g} to {times[-1]:g} s"
        needed = f"the recording needs the motion of the base from {begin:g} to {end:g} s"
        raise sidecar_error(file, key, problem, needed)
    return make(times, values)
