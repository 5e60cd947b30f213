"""One table of files that cannot be used, and of what must be said about each."""

from pathlib import Path
from typing import NamedTuple

GOOD = b"time [s], angle [deg]\n0, 45\n0.001, 44\n0.002, 43\n"


class Bad(NamedTuple):
    """A recording, its sidecar if any, and words of the answer in their order."""

    recording: bytes
    says: tuple[str, ...]
    sidecar: bytes | None = None

    def write(self, folder: Path) -> Path:
        path = folder / "record.csv"
        path.write_bytes(self.recording)
        if self.sidecar is not None:
            path.with_suffix(".toml").write_bytes(self.sidecar)
        return path


def rows(*lines: str) -> bytes:
    return "\n".join(["time [s], angle [deg]", *lines]).encode() + b"\n"


def beside(sidecar: str, *says: str) -> Bad:
    return Bad(GOOD, ("record.toml", *says), sidecar.encode())


RECORDINGS = {
    "rate beside a clock of another rate": Bad(
        GOOD, ("clock has 1000 samples", "`sample_rate` out"), b"[read]\nsample_rate = 500\n"
    ),
    "missing unit": Bad(b"time [s], angle\n0, 1\n", ("line 1", "`angle` has no unit", "write")),
    "unknown unit": Bad(b"time [s], angle [grad]\n0, 1\n", ("line 1", "`grad`", "use one of rad")),
    "unit of another quantity": Bad(b"time [deg], angle [deg]\n0, 1\n", ("line 1", "unit `deg`")),
    "unknown quantity": Bad(b"time [s], mass [kg]\n0, 1\n", ("line 1", "`mass`", "angle")),
    "no time": Bad(b"angle [deg]\n1\n2\n", ("line 1", "no column of time", "sample_rate")),
    "only time": Bad(b"time [s]\n1\n2\n", ("line 1", "0 quantities besides time")),
    "two quantities": Bad(
        b"time [s], angle [deg], displacement [mm]\n0, 1, 2\n", ("line 1", "2 quantities", "column")
    ),
    "no header": Bad(b"0, 45\n0.001, 44\n", ("line 1", "no header", "time [s], angle [deg]")),
    "word in a cell": Bad(rows("0, 45", "0.001, oops"), ("line 3", "`oops` is not a number")),
    "word in the first cell": Bad(rows("0, oops", "0.001, 44"), ("line 2", "`oops`", "delete")),
    "underscores": Bad(rows("0, 45", "1_0, 44"), ("line 3", "`1_0` is not a number")),
    "hexadecimal": Bad(rows("0, 45", "1, 0x10"), ("line 3", "`0x10` is not a number")),
    "empty cell": Bad(rows("0, 45", ", 44"), ("line 3", "column 1 is empty")),
    "short row": Bad(rows("0, 45", "0.001"), ("line 3", "no column 2", "complete")),
    "NaN in the clock": Bad(rows("0, 45", "NaN, 44"), ("line 3", "`NaN` is not finite")),
    "all NaN": Bad(rows("0, NaN", "1, nan", "2, "), ("0 usable values", "right column")),
    "all but one empty": Bad(rows("0, ", "1, 45", "2, "), ("1 usable values", "right column")),
    "infinite": Bad(rows("0, 45", "0.001, -inf"), ("line 3", "`-inf` is not finite")),
    "overflow": Bad(rows("0, 45", "0.001, 1e999"), ("line 3", "`1e999` is not finite")),
    "blank lines count": Bad(rows("0, 45", "", "", "0.001, x"), ("line 5", "`x`")),
    "time falls": Bad(rows("0, 45", "2, 44", "1, 43"), ("line 4", "1 s after 2 s", "sort")),
    "time repeated": Bad(rows("0, 45", "1, 44", "1, 44"), ("line 4", "1 s after 1 s", "repeated")),
    "impacts repeated": Bad(b"impact time [ms]\n100\n200\n200\n", ("line 4", "0.2 s after 0.2 s")),
    "empty": Bad(b"", ("empty", "header")),
    "blank": Bad(b"\n  \n , ,\n\n", ("empty", "header")),
    "header only": Bad(b"time [s], angle [deg]\n", ("line 1", "no rows follow", "add")),
    "one sample": Bad(rows("0, 45"), ("one row", "more than one")),
    "constant": Bad(rows("0, 45", "1, 45", "2, 45"), ("angle is the same in every row", "check")),
    "decimal commas": Bad(rows("0,000, 45,1", "0,001, 44,2"), ("line 2", "4 cells", "point")),
    "decimal comma in one column": Bad(rows("0, 45,1", "1, 44,2"), ("line 2", "3 cells", "point")),
    "semicolons": Bad(b"time [s]; angle [deg]\n0,0; 1,2,3\n", ("line 2", "`1,2,3` is not a num")),
    "tabs": Bad(b"time [s]\tangle [deg]\n0\t45\t1\n", ("line 2", "3 cells", "same columns")),
    "thousands": Bad(b"time [s]; angle [deg]\n0; 1.234,5\n", ("line 2", "`1.234,5` is not a n")),
    "Latin-1 below": Bad(rows("0, 45") + b"1, 44 \xb0\n", ("line 3", "`44 °` is not a number")),
    "UTF-16 cut": Bad(GOOD.decode().encode("utf-16")[:-1], ("line 1", "UTF-8", "save it")),
    "picture": Bad(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\xff\xd8", ("line 1", "UTF-8")),
    "zeros": Bad(b"\0" * 100 + b"\n" + b"\0" * 100, ("line 1", "no unit")),
    "control signs": Bad(rows("0, \x1b[31mred\x07"), ("line 2", "\\x1b[31mred\\x07", "number")),
    "open quote": Bad(rows("0, 45", '"0.001, 44', "0.002, 43"), ("line 3", "not CSV", "quotes")),
    "endless cell": Bad(rows('0, "' + "9" * 200_000), ("line 2", "not CSV", "quotes")),
    "endless header": Bad(b"x" * 100_000 + b"\n1\n", ("line 1", "no unit")),
}

SIDECARS = {
    "unknown key": beside("[read]\nskiprows = 1\n", "line 2", "`skiprows`", "mean `skip_rows`"),
    "unknown table": beside("[sytem]\n", "line 1", "`sytem`", "did you mean `system`"),
    "foreign key": beside("[sensor]\nx = 1\n", "line 2", "`x` in [sensor]", "use one of gain"),
    "unknown parameter": beside("\n\n[fixed]\nfriction = 1\n", "line 4", "`friction`", "`dry_f"),
    "unknown start": beside("[start]\nomega = 1\n", "line 2", "`omega`", "did you mean `omega"),
    "start of t0": beside("[start]\nt0 = 1\n", "line 2", "`t0` cannot be started elsewhere"),
    "free and fixed parameter": beside(
        '[fixed]\nmass = 1\n[fit]\nfree = ["mass"]\n', "line 2", "`mass` is in both"
    ),
    "unknown free parameter": beside(
        '[fit]\nfree = ["lengt"]\n', "line 2", "no parameter `lengt`", "did you mean `length`"
    ),
    "law of separation": beside(
        '[system]\nseparation = "zero"\n', "line 2", "no rule of separation `zero`", "zero-force"
    ),
    "unknown equilibrium of an oscillator": beside(
        '[system]\nequilibrium = "invert"\n', "line 2", "no equilibrium `invert`", "`inverted`"
    ),
    "drag of an oscillator without": beside("[system]\ndrag = true\n", "line 2", "has no drag"),
    "upper without gap": beside('[upper]\nlaw = "hertz"\n', "line 1", "no position", "add `gap`"),
    "upper law": beside('[upper]\ngap = 1.0\nlaw = "herz"\n', "line 3", "`herz`", "`hertz`"),
    "upper at zero": beside("[upper]\ngap = 0\n", "line 2", "`upper.gap`", "> 0"),
    "half a base": beside("[base]\namplitude = 1e-3\n", "line 1", "no `frequency`", "add"),
    "rate of a measured base": beside(
        "[base]\ncolumn = 2\nrate = 1.0\n", "line 1", "a measured motion and a harmonic one", "omit"
    ),
    "unknown key of the base": beside("[base]\nfreq = 3\n", "line 2", "`freq`", "`frequency`"),
    "unknown oscillator": beside('[system]\noscillator = "x"\n', "line 2", "`x`", "pendulum"),
    "unknown law": beside('[system]\nlaws = ["kelvin"]\n', "line 2", "`kelvin`", "`kelvin-voigt`"),
    "unsuited oscillator": Bad(
        GOOD, ("record.csv", "does not suit a free-mass"), b'[system]\noscillator = "free-mass"\n'
    ),
    "text for a number": beside('[fixed]\nlength = "1 m"\n', "line 2", "`fixed.length`", "number"),
    "truth value": beside("[sensor]\ngain = true\n", "line 2", "`sensor.gain`", "a number"),
    "list for a text": beside("[system]\noscillator = []\n", "line 2", "`system.oscillator`"),
    "not finite": beside("[fixed]\ngap = inf\n", "line 2", "`fixed.gap`", "finite"),
    "endless rate": beside("[read]\nsample_rate = inf\n", "line 2", "finite"),
    "negative cutoff": beside("[sensor]\ncutoff = -50\n", "line 2", "`sensor.cutoff`", "> 0"),
    "impossible parameter": beside("[fixed]\nlength = -1\n", "line 2", "`length`", "greater than"),
    "impossible start": beside("[start]\nomega_n = -1\n", "line 2", "`omega_n`", "greater than"),
    "impossible r": beside("[fixed]\nr = 1.5\n", "line 2", "`r`", "from 0 to 1"),
    "unknown quantity": beside('[read]\ncolumn = 1\nquantity = "v"\nunit = "m"\n', "line 3", "`v`"),
    "unknown unit": beside(
        '[read]\ncolumn = 1\nquantity = "angle"\nunit = "mm"\n', "line 4", "unit of angle `mm`"
    ),
    "unknown unit of time": beside('[read]\ntime_column = 1\ntime_unit = "h"\n', "line 3", "`h`"),
    "unit alone": beside('[read]\nunit = "deg"\n', "line 2", "`unit`", "add `quantity`"),
    "column that is not there": Bad(
        GOOD, ("record.csv", "line 1", "no column 3", "from 1 to 2"), b"[read]\ncolumn = 3\n"
    ),
    "name that is not there": Bad(
        GOOD, ("record.csv", "line 1", "no column `x`", "angle [deg]"), b'[read]\ncolumn = "x"\n'
    ),
    "time as quantity": Bad(GOOD, ("record.csv", "is the time"), b"[read]\ncolumn = 1\n"),
    "angle as time": Bad(GOOD, ("record.csv", "is not the time"), b"[read]\ntime_column = 2\n"),
    "window outside": Bad(GOOD, ("record.csv", "0 to 0.002 s"), b"[read]\nwindow = [1, 2]\n"),
    "window backwards": beside("[read]\nwindow = [2, 1]\n", "line 2", "ends before it begins"),
    "all rows skipped": Bad(GOOD, ("record.csv", "empty"), b"[read]\nskip_rows = 99\n"),
    "broken": beside("[read\n", "line 1", "not valid TOML"),
    "broken at the end": beside("a = 1\nb =", "line 2", "not valid TOML"),
    "given twice": beside("[read]\n[read]\n", "line 2", "not valid TOML"),
    "table as list": beside("[[read]]\n", "`read`", "a table"),
    "deep": beside("x = " + "[" * 100_000, "not valid TOML"),
    "long number": beside("[sensor]\ngain = " + "9" * 10_000, "not valid TOML"),
    "large number": beside("[sensor]\ngain = " + "9" * 1_000, "line 2", "`sensor.gain`"),
    "key of two lines": beside('[sensor]\n"a\\nb" = 1\n', "`a\\nb`", "use one of gain"),
    "Latin-1": Bad(GOOD, ("record.toml", "line 1", "UTF-8"), "# °\n".encode("latin-1")),
    "rubbish": Bad(GOOD, ("record.toml", "line 1"), bytes(range(1, 127))),
}
