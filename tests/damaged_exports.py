"""Damaged variants of exports: each must be refused, with the words that say why."""

import io
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import openpyxl

from exports import ABOUT, ACCELERATION, HEIGHTS, PLAIN, TEXTS, TS, zipped

Damaged = tuple[str, bytes, str]
"""Name of a file, its content, and words of the answer."""

NOISE = np.random.default_rng(1).bytes(2000)


def separator(written: str) -> str:
    line = written.splitlines()[-1]
    return next(each for each in ("\t", ";", ",") if each in line)


def row(change: Callable[[list[str]], Sequence[str]]) -> Callable[[str], str]:
    """A change of the cells of the row before the last but four."""

    def changed(written: str) -> str:
        mark, lines = separator(written), written.splitlines()
        lines[-5] = mark.join(change(lines[-5].split(mark)))
        return "\n".join(lines) + "\n"

    return changed


def clock_only(cells: list[str]) -> list[str]:
    """The cells up to the first that is filled."""
    return cells[: 1 + next(i for i, cell in enumerate(cells) if cell)]


def last_rows(change: Callable[[list[str]], list[str]]) -> Callable[[str], str]:
    """A change of the last twenty rows."""

    def changed(written: str) -> str:
        lines = written.splitlines()
        return "\n".join([*lines[:-20], *change(lines[-20:])]) + "\n"

    return changed


def filled(word: str, first: int) -> Callable[[list[str]], list[str]]:
    """The cells of a row from the first on, those that are not empty replaced by a word."""
    return lambda cells: [word if i >= first and cell else cell for i, cell in enumerate(cells)]


def cut(written: str) -> str:
    """The end of the file lost, in the middle of its last row."""
    mark, lines = separator(written), written.splitlines()
    return "\n".join([*lines[:-1], mark.join(clock_only(lines[-1].split(mark)))])


def again(written: str) -> str:
    """The header once more among the rows."""
    lines = written.splitlines()
    header = next(line for line in reversed(lines) if line.strip('"')[0] in "tTXRLs")
    return "\n".join([*lines[:-9], header, *lines[-9:]]) + "\n"


DAMAGES: dict[str, tuple[Callable[[str], str], str]] = {
    "word": (row(filled("oops", 1)), "`oops` is not a number"),
    "word in the clock": (row(filled("oops", 0)), "`oops` is not a number"),
    "infinite": (row(filled("inf", 0)), "`inf` is not finite"),
    "cells lost": (row(clock_only), "no column|is empty"),
    "cells too many": (row(lambda cells: [*cells, "1", "2", "3"]), "cells, but"),
    "backwards": (last_rows(lambda lines: lines[::-1]), "time does not increase"),
    "twice": (last_rows(lambda lines: [*lines, *lines]), "time does not increase"),
    "header again": (again, "` is not a number"),
    "cut": (cut, "no column|is empty"),
}
SAMPLED = [
    *("phyphox", "phyphox, decimal commas", "Tracker", "Vernier", "Vernier, decimal commas"),
    *("Capstone", "Sensor Logger", "LabVIEW, one clock", "row of units", "slashes"),
]


def damaged(name: str, change: str) -> Damaged:
    export, (damage, says) = TEXTS[name], DAMAGES[change]
    return export.name, damage(export.content.decode()).encode(), says


def replaced(name: str, old: str, new: str, says: str) -> Damaged:
    written = TEXTS[name].content.decode()
    assert old in written
    return TEXTS[name].name, written.replace(old, new).encode(), says


def book(rows: Sequence[list[Any]], end: int | None = None) -> bytes:
    buffer = io.BytesIO()
    made = openpyxl.Workbook()
    sheet = made.active
    assert sheet is not None
    for each in rows:
        sheet.append(each)
    made.save(buffer)
    return buffer.getvalue()[:end]


UFF = (  # after the description of the format, in text and evenly spaced
    "    -1\n    58\n"
    + "NONE\n" * 5
    + f"{1:5}{0:10}{0:5}{0:10} {'NONE':10}{1:10}{3:4} {'NONE':10}{0:10}{0:4}\n"
    + f"{2:10}{40:10}{1:10}{0:13.5E}{0.01:13.5E}{0:13.5E}\n"
    + f"{17:10}{0:5}{0:5}{0:5} {'Time':20} {'s':20}\n{8:10}{0:5}{0:5}{0:5} {'Height':20} {'m':20}\n"
    + f"{0:10}{0:5}{0:5}{0:5} {'NONE':20} {'NONE':20}\n" * 2
    + "".join(f"{x:13.5E}" + "\n" * (i % 6 == 5) for i, x in enumerate(HEIGHTS))
    + "\n    -1\n"
)
ROWS = [["Time (s)", "Height (m)"], *zip(TS.tolist(), HEIGHTS.tolist(), strict=True)]
OTHERS: dict[str, Damaged] = {
    "unknown unit of position": replaced("Vernier", "(m)", "(px)", "unknown unit `px`"),
    "unknown unit of time": replaced("Capstone", "(s)", "(fortnight)", "unit `fortnight`"),
    "unit lost": replaced("Capstone", "Time (s)", "Time", "no unit"),
    "volts": replaced("LabVIEW, one clock", "\tm\tN", "\tV\tV", "unknown unit `V`"),
    "unit of acceleration": replaced("phyphox", "m/s^2", "mph", "unknown unit `mph`"),
    "other abscissa": replaced("LabVIEW, one clock", "\tTime\tTime", "\tFrequency", "not time"),
    "no step": replaced("LabVIEW, no clock", "Delta_X", "Delta", "`X0` and `Delta_X`"),
    "two steps": replaced("LabVIEW, no clock", "0.010000\t0.010000", "0.01\t0.1", "differ in"),
    "no second header": replaced(
        "LabVIEW, one clock", "Channels", "***End_of_Header***", "no column"
    ),
    "header of LabVIEW": ("a.lvm", b"LabVIEW Measurement\t\n", "does not end twice"),
    "separator of LabVIEW": replaced("LabVIEW, one clock", "\tTab", "\tPipe", "separator `Pipe`"),
    "flights get longer": replaced("phyphox, flights", "0.491", "0.891", "do not get shorter"),
    "no flight": replaced("phyphox, flights", "0.571", "0", "do not get shorter"),
    "word for a bounce": replaced("phyphox, stopwatch", "1.771000000E+00", "no", "`no` is not a n"),
    "bounces swapped": replaced("phyphox, stopwatch", "1.771000000E+00", "9", "not increase"),
    "unit of bounces": replaced("phyphox, stopwatch", "(s)", "(h)", "unknown unit `h`"),
    "one bounce": ("a.csv", b'"Start (s)","Stop (s)"\n1.2,0\n', "1 impacts were found"),
    "gaps of blanks": ("a.txt", b"t [s] f [N] x [m]\n0 1 2\n0.1 2\n12 1 2\n", "in which columns"),
    "two families": ("a.csv", b"Time (s),Angle (deg),Height (m)\n0,1,2\n1,2,3\n", "2 quantities"),
    "gravity of a phone": ("Gravity.csv", TEXTS["Sensor Logger"].content, "quantities besides"),
    "constant": ("a.csv", b"Time (s),Height (m)\n0,1\n1,1\n2,1\n", "the same in every row"),
    "clock stops": replaced("since 1970", "1.7000000003", "1.7000000002", "not increase|is not"),
    "clock overflows": replaced("Tracker", "\n0.3\t", "\n3e200\t", "time is 3e.200 s"),
    "sheet cut": ("a.xlsx", book(ROWS, 3000), "not a spreadsheet"),
    "sheet of noise": ("a.xlsx", NOISE, "not a spreadsheet"),
    "sheet empty": ("a.xlsx", book([]), "empty"),
    "sheet of words": ("a.xlsx", book([["hello"], ["world"]]), "no unit|no rows"),
    "sheet with a word": ("a.xlsx", book([*ROWS, ["oops", 1]]), "`oops` is not a number"),
    "sheet with a date": ("a.xlsx", book([*ROWS, [TS[0], 1]]), "time does not increase"),
    "old sheet": ("a.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + NOISE, "before 2007"),
    "old sheet of noise": ("a.xls", NOISE, "not UTF-8 text"),
    "TDMS of noise": ("a.tdms", NOISE, "not a TDMS file"),
    "TDMS empty": ("a.tdms", b"", "no list of numbers|not a TDMS"),
    "UFF of noise": ("a.uff", NOISE, "not a UFF file|no list of numbers"),
    "UFF empty": ("a.uff", b"", "not a UFF file|no list of numbers"),
    "UFF cut": ("a.uff", UFF[: UFF.index("Time")].encode(), "data set 58 cannot be read"),
    "UFF without its end": ("a.uff", UFF[:-60].encode(), "a data set of 40 samples holds 3"),
    "UFF of frequencies": ("a.uff", UFF.replace("        17", "        18").encode(), "in time"),
    "UFF in volts": ("a.uff", UFF.replace("  m ", "  V ").encode(), "unknown unit `V`"),
    "archive cut": ("a.zip", zipped(**{"Raw.csv": ACCELERATION}, **ABOUT)[:900], "not a zip"),
    "archive of noise": ("a.zip", NOISE, "not a zip archive"),
    "archive empty": ("a.zip", zipped(), "not a zip|without a text"),
    "archive of pictures": ("a.zip", zipped(**{"a.png": "x"}), "without a text"),
    "archive about nothing": ("a.zip", zipped(**ABOUT), "without a text"),
    "archive of words": ("a.zip", zipped(**{"a.csv": "hello\n", "b.csv": "you\n"}), "."),
    "archive with a word": (
        "a.zip",
        zipped(**{"a.csv": PLAIN.replace("0.39,", "x,")}),
        "`x` is not",
    ),
}
DAMAGED = {
    **{
        f"{name}: {change}": damaged(name, change)
        for name in SAMPLED
        for change in DAMAGES
        if (name[:7], change) != ("LabVIEW", "header again")  # begins the next segment
    },
    **OTHERS,
}
