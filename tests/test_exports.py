"""Exports of programs and instruments are read at the first try, and damaged ones refused."""

import re
import sys

import nptdms
import numpy as np
import openpyxl
import pytest
import pyuff

import impactjax as ij
from damaged_exports import DAMAGED
from exports import (
    FORCES,
    HEIGHTS,
    PULSES,
    QUIET,
    SYNONYMS,
    TEXTS,
    TS,
    Export,
    table_of,
    write,
    zipped,
)
from tiers import quick

pytestmark = quick


def assert_read(export: Export, folder):
    file = ij.io.read_recording(write(export, folder))
    found = file.recording
    assert found.observed == export.quantity
    assert np.asarray(found.valid).all()
    if isinstance(found, ij.Recording):
        np.testing.assert_allclose(found.ts, export.ts, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(found.values, export.values, rtol=1e-6, atol=1e-6)
    else:
        np.testing.assert_allclose(found.instants, export.values, rtol=1e-6)
    for words in export.says:
        assert any(words in note for note in file.notes), (words, file.notes)
    for note in file.notes:
        assert note.endswith(".")


@pytest.mark.parametrize("name", TEXTS)
def test_export_is_read_at_the_first_try(name, tmp_path):
    assert_read(TEXTS[name], tmp_path)


@pytest.mark.parametrize("header", SYNONYMS)
def test_names_and_units_of_other_programs(header, tmp_path):
    quantity, values, factor = SYNONYMS[header]
    content = table_of(f"Time (s);{header}", values / factor, separator=";")
    assert_read(Export("a.csv", content, quantity, TS, values, (quantity,)), tmp_path)


# Formats with a reader of their own: written by the same packages' writers.


def sheets(*tables):
    """A writer of a workbook with a sheet of rows for each name."""

    def save(path):
        book = openpyxl.Workbook()
        for name, rows in tables:
            sheet = book.create_sheet(name)
            for row in rows:
                sheet.append(row)
        book.remove(book.worksheets[0])
        book.save(path)

    return save


def rows(header, *columns):
    return [header, *(list(map(float, row)) for row in zip(*columns, strict=True))]


def tdms(*channels):
    def save(path):
        with nptdms.TdmsWriter(path) as file:
            file.write_segment([nptdms.ChannelObject(*channel) for channel in channels])

    return save


def clock(unit):
    return {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": unit}


def uff(*sets, binary=0):
    def save(path):
        file = pyuff.UFF(str(path))
        for values, kind, unit in sets:
            about = {"ordinate_spec_data_type": kind, "ordinate_axis_units_lab": unit}
            made = dict.fromkeys(pyuff.prepare_58(return_full_dict=True), 0)
            made |= {f"id{i}": "NONE" for i in range(1, 6)}
            made |= {name: "NONE" for name in made if name.endswith(("_lab", "_name"))}
            made |= {"type": 58, "binary": binary, "func_type": 1, "rsp_node": 1, "rsp_dir": 3}
            made |= {"abscissa_spacing": 1, "abscissa_spec_data_type": 17, **about}
            file.write_sets({**made, "data": values, "x": TS}, "add")

    return save


DATES = np.datetime64("2026-11-25T10:00:00", "us") + np.arange(len(TS)) * np.timedelta64(10, "ms")
TITLE = [["Laboratory"], ["room", 7], []]
PHONE = ["Time (s)", *(f"Acceleration {axis} (m/s^2)" for axis in "xyz")]
POSITION = rows(["Time (s)", "Position (mm)"], TS, 1e3 * HEIGHTS)
BINARIES = {
    "sheet": ("a.xlsx", sheets(("Sheet1", POSITION)), "displacement", HEIGHTS, ()),
    "sheet with a title": ("a.xlsx", sheets(("A", TITLE + POSITION)), "displacement", HEIGHTS, ()),
    "phyphox": (
        "a.xlsx",
        sheets(
            ("Raw Data", rows(PHONE, TS, QUIET, -QUIET, PULSES)),
            ("Metadata Device", [["property", "value"], ["version", "1.1.16"]]),
        ),
        "proper acceleration",
        PULSES,
        ("Acceleration z (m/s^2)",),
    ),
    "sheets of runs": (
        "a.xlsx",
        sheets(("First", POSITION[:9]), ("Second", POSITION)),
        "displacement",
        HEIGHTS,
        ("Of the sheets First, Second the longest is used", ": Second;"),
    ),
    "TDMS": (
        "a.tdms",
        tdms(("Log", "Load", FORCES, clock("N")), ("Log", "Name", np.array([1, 2]))),
        "contact force",
        FORCES,
        ("`Load [N]`",),
    ),
    "TDMS with a clock": (
        "a.tdms",
        tdms(
            ("Log", "Time", TS, {"unit_string": "s"}), ("Log", "ai0", HEIGHTS, {"unit_string": "m"})
        ),
        "displacement",
        HEIGHTS,
        ("`ai0 [m]` is read as displacement",),
    ),
    "TDMS with dates": (
        "a.tdms",
        tdms(("L", "Time", DATES, {}), ("L", "Height", HEIGHTS, {"unit_string": "m"})),
        "displacement",
        HEIGHTS,
        (),
    ),
    "TDMS with groups": (
        "a.tdms",
        tdms(("One", "Height", QUIET[:9], clock("m")), ("Two", "Height", HEIGHTS, clock("m"))),
        "displacement",
        HEIGHTS,
        (": Two;",),
    ),
    "UFF": ("a.uff", uff((HEIGHTS, 8, "m")), "displacement", HEIGHTS, ()),
    "UFF, binary": ("a.unv", uff((PULSES, 12, "m/s2"), binary=1), "acceleration", PULSES, ()),
    "UFF without units": ("a.uff", uff((FORCES, 13, "NONE")), "contact force", FORCES, ()),
    "UFF, several": (
        "a.uff",
        uff((QUIET, 12, "m/s^2"), (PULSES, 12, "m/s^2")),
        "acceleration",
        PULSES,
        (),
    ),
}


@pytest.mark.filterwarnings("ignore:unclosed file")  # by pyuff's writer
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", BINARIES)
def test_file_of_other_reader_is_read_at_the_first_try(name, tmp_path):
    called, save, quantity, values, says = BINARIES[name]
    save(tmp_path / called)
    content = (tmp_path / called).read_bytes()
    assert_read(Export(called, content, quantity, TS, values, says), tmp_path)


@pytest.mark.parametrize(
    ("name", "part", "quantity"),
    [
        ("Vernier", "Run 3", "displacement"),
        ("Tracker, two bodies", "2", "displacement"),
        ("Sensor Logger, archive", "TotalAcceleration", "proper acceleration"),
        ("phyphox, stopwatches", "Simple", "impact times"),
    ],
)
def test_sidecar_chooses_a_part(name, part, quantity, tmp_path):
    path = write(TEXTS[name], tmp_path)
    default = ij.io.read_recording(path).recording
    path.with_suffix(".toml").write_text(f'[read]\npart = "{part}"\n')
    found = ij.io.read_recording(path)
    assert found.recording.observed == quantity
    assert not any("`part`" in note for note in found.notes)
    if "archive" not in name:
        assert len(found.recording.instants) < len(default.instants)
    path.with_suffix(".toml").write_text('[read]\npart = "Run 9"\n')
    with pytest.raises(ij.io.FileError, match="no part `Run 9`"):
        ij.io.read_recording(path)


def test_column_of_another_run_has_its_own_clock(tmp_path):
    path = write(TEXTS["Vernier"], tmp_path)
    path.with_suffix(".toml").write_text('[read]\ncolumn = "Run 3: Position (m)"\n')
    assert len(ij.io.read_recording(path).recording.instants) == 22


@pytest.mark.parametrize(("module", "suffix"), [("openpyxl", "xlsx"), ("nptdms", "tdms")])
def test_absent_package_is_one_sentence(module, suffix, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    content = zipped(**{"xl/workbook.xml": ""}) if suffix == "xlsx" else b"TDSm"
    (tmp_path / f"a.{suffix}").write_bytes(content)
    with pytest.raises(ij.io.FileError, match=r"pip install 'impactjax\[formats\]'") as caught:
        ij.io.read_recording(tmp_path / f"a.{suffix}")
    assert_one_sentence(caught.value)


def assert_one_sentence(error):
    message = str(error)
    assert message.isprintable()
    assert re.fullmatch(r"[^;]+(, line \d+)?: .+; .+\.", message), message
    assert len(message) < 700


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_export_is_refused_in_one_sentence(name, tmp_path):
    called, content, says = DAMAGED[name]
    (tmp_path / called).write_bytes(content)
    with pytest.raises(ij.io.FileError, match=says) as caught:
        ij.io.read_recording(tmp_path / called)
    assert str(tmp_path / called) in str(caught.value)
    assert_one_sentence(caught.value)


def test_there_are_enough_damaged_exports():
    assert len(DAMAGED) >= 60


def test_cut_waveforms_are_refused_without_another_word(tmp_path, capfd):
    path = tmp_path / "a.tdms"
    BINARIES["TDMS"][1](path)
    whole = path.read_bytes()
    for end in (20, 60, len(whole) // 2, len(whole) - 4):
        path.write_bytes(whole[:end])
        with pytest.raises(ij.io.FileError) as caught:
            ij.io.read_recording(path)
        assert_one_sentence(caught.value)
    assert capfd.readouterr() == ("", "")


def test_frames_without_a_rate_are_refused(tmp_path):
    path = write(TEXTS["frames"]._replace(sidecar=None), tmp_path)
    with pytest.raises(ij.io.FileError, match="counts frames; add `frame_rate`"):
        ij.io.read_recording(path)
