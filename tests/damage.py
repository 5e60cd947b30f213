"""Damaged variants of a recording, each with the expected outcome."""

import zipfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

DATA = Path(__file__).parent.parent / "data"
RECORDING = DATA / "restitution.csv"
SIDECAR = RECORDING.with_suffix(".toml").read_text()
LINES = RECORDING.read_text().splitlines()
HEADER, ROWS = LINES[0], LINES[1:]
CELLS = [row.split(", ") for row in ROWS]
SHUFFLED = np.random.default_rng(0).permutation(len(ROWS))
NOISE = np.random.default_rng(1).bytes(4096)


class Damage(NamedTuple):
    """A damaged file, its name, its sidecar, and words of the answer if it cannot be used."""

    content: bytes
    says: str | None = None
    name: str = "record.csv"
    sidecar: bytes | None = SIDECAR.encode()


def table(rows: list[str], header: str = HEADER) -> bytes:
    return "\n".join([header, *rows]).encode() + b"\n"


def each(change: Callable[[int, str, str], str]) -> bytes:
    """Every row changed."""
    return table([change(i, t, x) for i, (t, x) in enumerate(CELLS)])


def beside(text: str) -> bytes:
    return (SIDECAR + text).encode()


def npz(**arrays: Any) -> bytes:
    buffer = BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def bomb() -> bytes:
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("x.npy", b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f8', 'shape': (9" + b"9" * 16)
    return buffer.getvalue()


TS = np.array([float(t) for t, _ in CELLS])
XS = np.array([float(x) for _, x in CELLS])
ARRAYS = npz(**{"time [s]": TS, "angle [deg]": XS})

READ = {
    "as it is": Damage(RECORDING.read_bytes()),
    "byte-order mark": Damage(b"\xef\xbb\xbf" + RECORDING.read_bytes()),
    "Windows": Damage(RECORDING.read_bytes().replace(b"\n", b"\r\n")),
    "old Macintosh": Damage(RECORDING.read_bytes().replace(b"\n", b"\r")),
    "no end of line": Damage(RECORDING.read_bytes().rstrip()),
    "blank lines": Damage(table([row + "\n" for row in ROWS])),
    "blanks around": Damage(each(lambda i, t, x: f"  {t} ,  {x}  ")),
    "commas at the end": Damage(each(lambda i, t, x: f"{t},{x},").replace(b"[deg]", b"[deg],")),
    "quotes": Damage(each(lambda i, t, x: f'"{t}","{x}"')),
    "semicolons": Damage(RECORDING.read_bytes().replace(b",", b";")),
    "decimal commas": Damage(RECORDING.read_bytes().replace(b", ", b";").replace(b".", b",")),
    "tabs": Damage(RECORDING.read_bytes().replace(b", ", b"\t")),
    "parentheses": Damage(RECORDING.read_bytes().replace(b"[", b"(").replace(b"]", b")")),
    "capitals": Damage(table(ROWS, "TIME [s], Angle [deg]")),
    "columns swapped": Damage(table([f"{x}, {t}" for t, x in CELLS], "angle [deg], time [s]")),
    "milliseconds": Damage(
        each(lambda i, t, x: f"{float(t) * 1e3:.17g}, {x}").replace(b"[s]", b"[ms]")
    ),
    "exponents": Damage(each(lambda i, t, x: f"{float(t):.17e}, {float(x):.17E}")),
    "empty cells": Damage(each(lambda i, t, x: t + ", " + ("" if i % 7 == 3 else x))),
    "NaN cells": Damage(each(lambda i, t, x: t + ", " + ("NaN" if i % 50 == 9 else x))),
    "dashes": Damage(each(lambda i, t, x: t + ", " + ("-" if i % 50 == 9 else x))),
    "a gap": Damage(each(lambda i, t, x: t + ", " + ("" if 300 < i < 360 else x))),
    "rows lost": Damage(table([row for i, row in enumerate(ROWS) if i % 11])),
    "half lost": Damage(table(ROWS[:700])),
    "another column": Damage(
        table([f"{row}, {i}" for i, row in enumerate(ROWS)], HEADER + ", number"),
        sidecar=beside('[read]\ncolumn = "angle [deg]"\n'),
    ),
    "header lost": Damage(
        table(ROWS[1:], ROWS[0]),
        sidecar=beside(
            '[read]\ncolumn = 2\nquantity = "angle"\nunit = "deg"\n'
            'time_column = 1\ntime_unit = "s"\n'
        ),
    ),
    "clock lost": Damage(
        table([x for _, x in CELLS], "angle [deg]"), sidecar=beside("[read]\nsample_rate = 1000\n")
    ),
    "title above": Damage(
        b"Laboratory, Tuesday\n\n" + RECORDING.read_bytes(),
        sidecar=beside("[read]\nskip_rows = 2\n"),
    ),
    "NumPy": Damage(ARRAYS, name="record.npz"),
    "UTF-16": Damage(RECORDING.read_text().encode("utf-16")),
    "Windows-1252": Damage(RECORDING.read_text().replace("deg", "°").encode("cp1252")),
}

WRONG_CLOCK, WRONG_CELL = "time does not increase", "is not"
REFUSED = {
    "empty": Damage(b"", "it is empty"),
    "header only": Damage(table([]), "no rows follow"),
    "one sample": Damage(table(ROWS[:1]), "one row"),
    "few samples": Damage(table(ROWS[:3]), "too few"),
    "cut inside a row": Damage(RECORDING.read_bytes()[:5003], "no column 2"),
    "shuffled": Damage(table([ROWS[i] for i in SHUFFLED]), WRONG_CLOCK),
    "backwards": Damage(table(ROWS[::-1]), WRONG_CLOCK),
    "times twice": Damage(table([row for row in ROWS for _ in (0, 1)]), WRONG_CLOCK),
    "clock rounded": Damage(each(lambda i, t, x: f"{float(t):.2f}, {x}"), WRONG_CLOCK),
    "two runs in one": Damage(table(ROWS + ROWS), WRONG_CLOCK),
    "constant": Damage(each(lambda i, t, x: f"{t}, 45"), "the same in every row"),
    "all NaN": Damage(each(lambda i, t, x: f"{t}, nan"), "0 usable values"),
    "all clipped": Damage(
        RECORDING.read_bytes(),
        "0 usable",
        sidecar=SIDECAR.replace("[sensor]", "[sensor]\nclip=1e-9").encode(),
    ),
    "infinite": Damage(each(lambda i, t, x: f"{t}, {'inf' if i == 9 else x}"), WRONG_CELL),
    "overflow": Damage(each(lambda i, t, x: f"{t}, {'1e400' if i == 9 else x}"), WRONG_CELL),
    "a word": Damage(each(lambda i, t, x: f"{t}, {'overload' if i == 9 else x}"), "`overload`"),
    "a clock of NaN": Damage(each(lambda i, t, x: f"{'nan' if i == 9 else t}, {x}"), WRONG_CELL),
    "commas for points": Damage(RECORDING.read_bytes().replace(b".", b","), "cells, but 2"),
    "unit lost": Damage(table(ROWS, "time [s], angle"), "no unit"),
    "unit of time lost": Damage(table(ROWS, "time, angle [deg]"), "no unit"),
    "wrong unit": Damage(table(ROWS, "time [s], angle [mm]"), "unknown unit `mm`"),
    "wrong quantity": Damage(table(ROWS, "time [s], voltage [V]"), "unknown quantity"),
    "wrong system": Damage(table(ROWS, "time [s], displacement [mm]"), "does not suit a pendulum"),
    "header twice": Damage(table([*ROWS[:9], HEADER, *ROWS[9:]]), "is not a number"),
    "quote left open": Damage(table([*ROWS[:9], '"' + ROWS[9], *ROWS[10:]]), "quotes"),
    "binary rubbish": Damage(NOISE, "UTF-8"),
    "rubbish in the middle": Damage(table(ROWS[:9]) + NOISE, "UTF-8"),
    "NUL bytes": Damage(table([*ROWS[:9], "\0\0\0"]), ""),
    "a zip file": Damage(ARRAYS, "UTF-8"),
    "a page": Damage(b"<!DOCTYPE html><html><body>404</body></html>", ""),
    "NumPy cut": Damage(ARRAYS[:3000], "not a NumPy file", name="record.npz"),
    "NumPy rubbish": Damage(NOISE, "not a NumPy file", name="record.npz"),
    "NumPy bomb": Damage(bomb(), "not a NumPy file", name="record.npz"),
    "NumPy of text": Damage(npz(x=np.array(["a"])), "no list of numbers", name="record.npz"),
    "MATLAB rubbish": Damage(NOISE, "not a MATLAB file", name="record.mat"),
    "NetCDF rubbish": Damage(NOISE, "not a NetCDF file", name="record.nc"),
    "HDF5 cut": Damage(b"\x89HDF\r\n\x1a\n" + NOISE, "not a HDF5 file", name="record.h5"),
    "WAV rubbish": Damage(b"RIFF\0\0\0\0WAVEfmt " + NOISE, "not a WAV file", name="record.wav"),
    "path for a system": Damage(
        RECORDING.read_bytes(),
        "there is no oscillator",
        sidecar=b'[system]\noscillator = "../../etc/passwd"\n',
    ),
    "path in a column": Damage(
        RECORDING.read_bytes(), "there is no column", sidecar=b'[read]\ncolumn = "/etc/passwd"\n'
    ),
    "deep TOML": Damage(RECORDING.read_bytes(), "not valid TOML", sidecar=b"x=" + b"[" * 9999),
    "long TOML number": Damage(
        RECORDING.read_bytes(), "not valid TOML", sidecar=b"[sensor]\ngain=" + b"9" * 9999
    ),
    "endless order": Damage(
        RECORDING.read_bytes(), "`sensor.order`", sidecar=b"[sensor]\norder = 999999999\n"
    ),
    "endless response": Damage(
        RECORDING.read_bytes(), "need each other", sidecar=b"[sensor]\nimpulse_response = [1, 2]\n"
    ),
    "free and fixed": Damage(
        RECORDING.read_bytes(),
        "in both `free` and `fixed`",
        sidecar=b'[fit]\nfree = ["gap"]\n[fixed]\ngap = 0\n',
    ),
    "free what is not there": Damage(
        RECORDING.read_bytes(), "did you mean `offset`", sidecar=b'[fit]\nfree = ["offst"]\n'
    ),
}
