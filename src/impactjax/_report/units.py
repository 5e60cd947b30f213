"""Units as people read them: degrees, milliseconds."""

from impactjax._record.recording import AnyRecording, ImpactTimes


def shown_unit(recording: AnyRecording) -> tuple[str, float]:
    """The unit in which a recording is shown, and the factor from SI."""
    if isinstance(recording, ImpactTimes):
        return "ms", 1e3
    quantity = recording.quantity
    return quantity.shown, 1 / quantity.units[quantity.shown]
