"""The verb `check`: file or recording → what is in it, before any fit."""

import html
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from impactjax._check.doubts import doubts
from impactjax._check.forecast import Forecasts, forecasts
from impactjax._check.noise import noise_of
from impactjax._check.words import bounded, contacts, impacts, noise_words, read, system_words
from impactjax._compare.survey import Statements, Survey, survey
from impactjax._compare.typical_systems import Law
from impactjax._model.oscillator import AbstractOscillator
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.read_recording import RecordingFile
from impactjax._record.sample_noise import Noise
from impactjax._sensor.sensor import Sensor


class Check(NamedTuple):
    """Look at a recording before any fit. Its text is `str(check)`.

    - `survey`: recording, first estimates, and all that is known besides.
    - `noise`: noise of the record.
    - `doubts`: sentences on what looks wrong.
    - `forecasts`: expected standard errors; `None` if the record shows no noise to compare with, or
      if the quantity or the oscillator has no closed form.
    """

    survey: Survey
    noise: Noise
    doubts: tuple[str, ...]
    forecasts: Forecasts | None

    @property
    def sentences(self) -> dict[str, list[str]]:
        """Sentences by topic: what was read, noise, impacts, contacts, doubts, parameters."""
        found = self.survey
        return {
            "Read": [*read(found), *system_words(found)],
            "Noise": [noise_words(found, self.noise)],
            "Impacts": impacts(found),
            "Contact": contacts(found),
            "Changed": list(found.notes) or ["Nothing was left out or changed."],
            "Doubtful": list(self.doubts) or ["Nothing looks wrong."],
            "Such a record can bound": bounded(found, self.forecasts),
        }

    def __str__(self) -> str:
        lines = [self.survey.name]
        for topic, told in self.sentences.items():
            lines += [f"- {topic}: {told[0]}", *(f"  {each}" for each in told[1:])]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        rows = [
            f"<tr><th>{html.escape(topic)}</th><td>{'<br>'.join(map(html.escape, told))}</td></tr>"
            for topic, told in self.sentences.items()
        ]
        return f"<table><caption>{html.escape(self.survey.name)}</caption>{''.join(rows)}</table>"


def check(
    record: str | Path | RecordingFile | AbstractRecording,
    *,
    oscillator: AbstractOscillator | None = None,
    laws: Sequence[Law] | None = None,
    sensor: Sensor | None = None,
    fixed: Mapping[str, float | None] = {},
    start: Mapping[str, float] = {},
    free: Sequence[str] = (),
) -> Check:
    """Look at a recording before any fit, as the command `impactjax check` takes it: what was read,
    noise, impacts, what looks wrong, and which parameters such a record can bound.

    It compiles no simulation. The forecast of standard errors is the Cramér-Rao bound of a motion
    with the values of the first look, in closed form.

    **Arguments:**

    - `record`: file, result of `read_recording`, or recording.
    - `oscillator`, `laws`, `sensor`, `fixed`, `start`, `free`: those of `prepare`.

    **Raises** the errors of `prepare`.
    """
    said = Statements(oscillator, laws, sensor, fixed, start, free)
    return checked(survey(record, said))


def checked(found: Survey) -> Check:
    """The check of a survey."""
    noise = noise_of(found.recording)
    return Check(found, noise, doubts(found, noise), forecasts(found, noise))
