"""The sidecar NAME.toml beside a recording: information that the recording itself lacks."""

from pathlib import Path
from typing import Annotated

import msgspec

from impactjax._model.base_motion import Chirp, HarmonicMotion
from impactjax._record.file_error import FileError
from impactjax._record.text import read_text
from impactjax._record.toml_tables import LARGEST, Finite, Positive, line_of, tables_in
from impactjax._sensor.quantity import TIME, observables, units_of


class SystemTable(msgspec.Struct, forbid_unknown_fields=True):
    """[system]: oscillator, contact laws, friction and drag."""

    oscillator: str | None = None
    laws: list[str] | None = None
    dry_friction: bool | None = None
    drag: bool = False
    separation: str | None = None
    equilibrium: str | None = None


class UpperTable(msgspec.Struct, forbid_unknown_fields=True):
    """[upper]: position of a second stop, and its law if that is another."""

    gap: Positive | None = None
    law: str | None = None


class BaseTable(msgspec.Struct, forbid_unknown_fields=True):
    """[base]: motion of the base and the stops: harmonic, with a frequency that changes at a
    constant rate, or measured.
    """

    amplitude: Annotated[float, msgspec.Meta(ge=0, le=LARGEST)] | None = None
    frequency: Positive | None = None
    phase: Finite | None = None
    rate: Finite | None = None
    recording: str | None = None
    column: int | str | None = None
    quantity: str | None = None
    unit: str | None = None

    @property
    def is_measured(self) -> bool:
        """True if the motion is read from a file."""
        return self.recording is not None or self.column is not None

    def motion(self) -> HarmonicMotion | Chirp | None:
        """The motion, unless the base is at rest or was measured."""
        if self.amplitude is None or self.frequency is None:
            return None
        if self.rate is None:
            return HarmonicMotion(self.amplitude, self.frequency, self.phase or 0.0)
        return Chirp(self.amplitude, self.frequency, self.rate, self.phase or 0.0)


class SensorTable(msgspec.Struct, forbid_unknown_fields=True):
    """[sensor]: gain, offset, filter and noise of the instrument."""

    gain: Finite | None = None
    offset: Finite | None = None
    delay: Finite = 0.0
    drift: Finite | None = None
    sigma: Positive | None = None
    quantisation: Positive | None = None
    clip: Positive | None = None
    cutoff: Annotated[float, msgspec.Meta(gt=0)] | None = None  # infinite: no low-pass
    order: Annotated[int, msgspec.Meta(ge=1, le=12)] = 2
    impulse_response: Annotated[list[Finite], msgspec.Meta(min_length=2)] | None = None
    interval: Positive | None = None
    resonance: Positive | None = None
    resonance_damping: Annotated[float, msgspec.Meta(gt=0, le=0.99)] | None = None


class FitTable(msgspec.Struct, forbid_unknown_fields=True):
    """[fit]: parameters to fit although they are usually known."""

    free: list[str] = msgspec.field(default_factory=list)


class ReadTable(msgspec.Struct, forbid_unknown_fields=True):
    """[read]: description of a file without the usual header."""

    skip_rows: Annotated[int, msgspec.Meta(ge=0)] = 0
    column: int | str | None = None
    quantity: str | None = None
    unit: str | None = None
    time_column: int | str | None = None
    time_unit: str | None = None
    sample_rate: Positive | None = None
    frame_rate: Positive | None = None
    part: str | None = None
    window: tuple[float, float] | None = None


class Sidecar(msgspec.Struct, forbid_unknown_fields=True):
    """All tables of a sidecar. [priors] has values with their standard errors. The package ignores
    [truth], which is for readers of the file.
    """

    system: SystemTable = msgspec.field(default_factory=SystemTable)
    upper: UpperTable = msgspec.field(default_factory=UpperTable)
    base: BaseTable = msgspec.field(default_factory=BaseTable)
    fixed: dict[str, Finite] = msgspec.field(default_factory=dict)
    start: dict[str, Finite] = msgspec.field(default_factory=dict)
    priors: dict[str, tuple[Finite, Positive]] = msgspec.field(default_factory=dict)
    sensor: SensorTable = msgspec.field(default_factory=SensorTable)
    fit: FitTable = msgspec.field(default_factory=FitTable)
    read: ReadTable = msgspec.field(default_factory=ReadTable)
    truth: dict[str, object] = msgspec.field(default_factory=dict)


def read_sidecar(path: Path) -> Sidecar:
    """A sidecar file. Raises `FileError`."""
    text = read_text(path)
    sidecar = tables_in(path, text, Sidecar)
    _check_sensor(path, text, sidecar.sensor)
    check_complete(path, text, sidecar.upper, sidecar.base)
    _check_read(path, text, sidecar.read)
    return sidecar


def _check_sensor(path: Path, text: str, sensor: SensorTable) -> None:
    """Checks that a low-pass is given completely, and in one way only."""
    key, place = "impulse_response", line_of(text, "impulse_response")
    if (sensor.impulse_response is None) != (sensor.interval is None):
        place = line_of(text, "interval") if place is None else place
        raise FileError(path, place, f"`{key}` and `interval` need each other", "give both")
    if sensor.resonance_damping is not None and sensor.resonance is None:
        place = line_of(text, "resonance_damping")
        problem = "`resonance_damping` says nothing without `resonance`"
        raise FileError(path, place, problem, "add `resonance` [Hz]")
    keys = (key, "cutoff", "resonance")
    given = [each for each in keys if getattr(sensor, each) is not None]
    if len(given) > 1:
        problem = f"`{given[0]}` and `{given[1]}` are two low-passes"
        raise FileError(path, line_of(text, given[0]), problem, "give one of them")


def check_complete(path: Path, text: str, upper: UpperTable, base: BaseTable) -> None:
    """Checks that a second stop has a position, and a moving base one motion: a measured one, or an
    amplitude and a frequency.
    """
    if upper.law is not None and upper.gap is None:
        place = line_of(text, "upper")
        raise FileError(path, place, "the upper stop has no position", "add `gap` under [upper]")
    _check_column(path, text, base, "base")
    if base.is_measured:
        given = (base.amplitude, base.frequency, base.phase, base.rate)
        if given != (None, None, None, None):
            problem = "[base] has a measured motion and a harmonic one"
            raise FileError(path, line_of(text, "base"), problem, "omit one of them")
    elif base != BaseTable() and None in (base.amplitude, base.frequency):
        lacks = "amplitude" if base.amplitude is None else "frequency"
        place = line_of(text, "base")
        raise FileError(path, place, f"[base] has no `{lacks}`", f"add `{lacks}` under [base]")


def _check_read(path: Path, text: str, read: ReadTable) -> None:
    _check_column(path, text, read, "read")
    place, known = line_of(text, "time_unit", "read"), units_of(TIME)
    if read.time_unit is not None and read.time_column is None:
        problem = "`time_unit` says nothing without `time_column`"
        raise FileError(path, place, problem, "add `time_column`")
    if read.time_unit is not None and read.time_unit not in known:
        problem = f"unknown unit of time `{read.time_unit}`"
        raise FileError(path, place, problem, f"use one of {', '.join(known)}")
    if read.window is not None and not read.window[0] < read.window[1]:
        raise FileError(
            path, line_of(text, "window"), "the window ends before it begins", "swap its ends"
        )


def _check_column(path: Path, text: str, table: ReadTable | BaseTable, name: str) -> None:
    """Checks that a column has a known quantity and unit, if a table gives them."""
    for key, other, kind, allowed in (
        ("quantity", "column", "quantity", observables()),
        ("unit", "quantity", f"unit of {table.quantity}", units_of(table.quantity or "")),
    ):
        value, place = getattr(table, key), line_of(text, key, name)
        if value is not None and getattr(table, other) is None:
            problem = f"`{key}` says nothing without `{other}`"
            raise FileError(path, place, problem, f"add `{other}`")
        if value is not None and value not in allowed:
            problem = f"unknown {kind} `{value}`"
            raise FileError(path, place, problem, f"use one of {', '.join(allowed)}")
