"""Exports of programs and instruments, written after public descriptions of their layouts."""

import io
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

COUNT = 40
TS = np.arange(COUNT) / 100
HEIGHTS = 0.1 + 0.4 * np.abs(np.cos(9 * TS)) * 0.8 ** np.floor(9 * TS / np.pi + 0.5)
SIDEWAYS = 0.05 + 0.9 * TS  # farther than the heights, but along a straight line
PULSES = 9.8 + 60 * np.exp(-(((TS - 0.2) / 0.02) ** 2))
RATES = 3 * np.cos(8 * TS)
FORCES = 25 * np.exp(-(((TS - 0.15) / 0.03) ** 2))
ANGLES = 40 * np.cos(8 * TS)
QUIET = 0.1 + 0.02 * np.sin(5 * TS)
BOUNCES = 1.2 + np.array([0.0, 0.571, 1.062, 1.489, 1.856])
EPOCH = 1698501144381000000  # [ns] since 1970


class Export(NamedTuple):
    """A file's name and content, and what must be read from it.

    - `quantity`, `ts`, `values`: its name, times [s] and values in the SI unit; for impact times
      the values are the times.
    - `says`: words of the sentences on what was chosen.
    - `sidecar`: sidecar, if it needs one.
    """

    name: str
    content: bytes
    quantity: str
    ts: np.ndarray
    values: np.ndarray
    says: tuple[str, ...] = ()
    sidecar: str | None = None


def text(
    header: Sequence[str],
    columns: Sequence[np.ndarray],
    separator: str = ",",
    form: str = "%.9E",
    quote: str = "",
) -> str:
    """A table; NaN is an empty cell."""
    lines = [separator.join(f"{quote}{cell}{quote}" for cell in header)]
    for row in zip(*columns, strict=True):
        cells = ["" if value is None or value != value else form % value for value in row]
        lines.append(separator.join(cells))
    return "\n".join(lines) + "\n"


def comma(written: str) -> str:
    """Decimal commas, and semicolons between columns."""
    return written.replace(",", ";").replace(".", ",")


def padded(values: np.ndarray, count: int) -> np.ndarray:
    return np.append(values[:count], np.full(len(values) - count, np.nan))


def zipped(**files: str) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def phone(name: str, unit: str, size: str = "Absolute acceleration (m/s^2)") -> list[str]:
    return ["Time (s)", *(f"{name} {axis} ({unit})" for axis in "xyz"), size]


AXES = (TS, QUIET, -QUIET, PULSES, np.hypot(QUIET, PULSES))
ACCELERATION = text(phone("Acceleration", "m/s^2"), AXES, quote='"')
LINEAR = text(phone("Linear Acceleration", "m/s^2"), AXES, quote='"')
GYROSCOPE = text(phone("Gyroscope", "rad/s", "Absolute (rad/s)"), (TS, QUIET, RATES, QUIET, RATES))
ABOUT = {
    "meta/device.csv": '"property","value"\n"version","1.1.16"\n"depthFrontSensor","0"\n',
    "meta/time.csv": '"event","experiment time","system time"\n"START",0.0,1698501144.381\n',
}
WHICH = ("varies most", "Acceleration z (m/s^2)", "proper acceleration")
HEARD = [
    f"{name} {i} ({unit})" for i in range(5) for name, unit in (("Bounce", "s"), ("Height", "m"))
]
FELL = np.append(np.diff(BOUNCES), 0.3) ** 2 * 9.81 / 8
COLLISION = text(HEARD, [np.array([x]) for pair in zip(BOUNCES, FELL, strict=True) for x in pair])
FLIGHTS = [
    *("Height 0 (cm)", "Time 1 (s)", "Height 1 (cm)", "Energy retained 1 (%)"),
    *("Time 2 (s)", "Height 2 (cm)", "Energy retained 2 (%)", "Time 3 (s)"),
]
ONE_ROW = "50.1,0.571,41.2,82,0.491,33.8,81,0.427\n"
STOPS = ["Start (s)", *(f"Stop {i} (s)" for i in range(1, 6))]
HALTED = [np.array([x]) for x in (*BOUNCES, 0.0)]
SIMPLE = text(["Start (s)", "Stop (s)", "Difference (s)"], [np.array([x]) for x in (1.2, 1.7, 0.5)])

TRACKED = text(["t", "x", "y"], (TS, SIDEWAYS, HEIGHTS), "\t", "%.12g")
TWO_BODIES = "ball\t\t\tfloor\t\t\n" + text(
    ["t", "x", "y"] * 2, (TS, SIDEWAYS, HEIGHTS, *(padded(x, 9) for x in (TS, QUIET, QUIET))), "\t"
)
MOTION = ("Time (s)", "Position (m)", "Velocity (m/s)", "Acceleration (m/s²)")


def runs(
    form: Callable[[str, int], str], names: Sequence[str], lengths: Sequence[int], separator=","
) -> str:
    """Runs side by side; the second holds the heights."""
    header = [form(name, i) for i in range(1, len(lengths) + 1) for name in names]
    columns: list[np.ndarray] = []
    for i, length in enumerate(lengths):
        values = [HEIGHTS if i == 1 else QUIET, RATES, RATES][: len(names) - 1]
        columns += [padded(x, length) for x in (TS, *values)]
    return text(header, columns, separator, "%.12g", '"')


VERNIER = runs(lambda name, i: f"Run {i}: {name}", MOTION[:3], (30, 40, 22))
LATEST = text(
    ["Latest: Time (s)", "Latest: Force (N)", "Run 1: Time (s)", "Run 1: Force (N)"],
    (TS, np.full(COUNT, -0.05), TS, FORCES),
    quote='"',
)
CAPSTONE = runs(lambda name, i: f"{name} Run #{i}", MOTION[:3], (30, 40))
CHANNELS = runs(lambda name, i: name.replace(" (", ", Ch P1 (") + f" Run #{i}", MOTION[:2], (9, 40))
LOGGER_PRO = (
    "Vernier Format 2\nbounce.cmbl 11/25/2026 10:00:00 .\nRun 1\nTime\tPosition\nt\tx\ns\tm\n\n"
    + text(["", ""], (TS, HEIGHTS), "\t").split("\n", 1)[1]
)
LOGGED = "time,seconds_elapsed,z,y,x\n" + "".join(
    f"{EPOCH + 10_000_000 * i},{t:.9f},{x:.12g},0.1,{-0.1 - 0.01 * (i % 2)}\n"
    for i, (t, x) in enumerate(zip(TS, PULSES, strict=True))
)
TURNED = text(["time", "seconds_elapsed", "z", "y", "x"], (TS + 1.7e18, TS, QUIET, RATES, QUIET))
ABOUT_LOGGER = "version,device name,recording epoch time\n1.29,phone,1698501144381\n"
LABVIEW_FILE = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
    "Decimal_Separator\t.\nMulti_Headings\tNo\nX_Columns\t{columns}\nTime_Pref\tRelative\n"
    "Operator\tlab\nDate\t2024/01/01\nTime\t10:00:00.123\n***End_of_Header***\t\n\t\n"
)
LABVIEW_SEGMENT = (
    "Channels\t2\t\t\nSamples\t40\t40\t\nDate\t2024/01/01\t2024/01/01\t\n"
    "Time\t10:00:00\t10:00:00\t\nY_Unit_Label\t{units}\t\nX_Dimension\tTime\tTime\t\n"
    "X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t\nDelta_X\t0.010000\t0.010000\t\n"
    "***End_of_Header***\t\t\t\n"
)


def labview(columns: str, header: str, units: str, values: Sequence[np.ndarray]) -> str:
    body = text(header.split(), values, "\t", "%.9f").split("\n", 1)[1]
    if columns == "No":
        body = "".join("\t" + line + "\n" for line in body.splitlines())
    segment = LABVIEW_SEGMENT.format(units=units)
    return LABVIEW_FILE.format(columns=columns) + segment + "\t".join(header.split()) + "\n" + body


ONE = labview("One", "X_Value Position Load Comment", "m\tN", (TS, HEIGHTS, FORCES))
NO = labview("No", "X_Value Position Load Comment", "m\tN", (HEIGHTS, FORCES))
G = 9.80665
MULTI = labview("Multi", "X_Value ax X_Value az Comment", "g\t\tg", (TS, QUIET, TS, PULSES / G))
MULTI = MULTI.replace("ax", "Acceleration x").replace("az", "Acceleration z")
BLANKS = (
    "Ball, Tuesday\n\n"
    + "  Time (s)  Load (N)  Height (mm)\n"
    + "".join(
        f"{t:10.2f}{'' if i % 5 else f'{f:.3f}':>10}{1e3 * x:13.6f}\n"
        for i, (t, f, x) in enumerate(zip(TS, FORCES, HEIGHTS, strict=True))
    )
)
PLAIN = text(["Time (s)", "Position (m)"], (TS, HEIGHTS), form="%.12g")
FRAMES = text(["Frame", "y (mm)"], (np.arange(COUNT) + 7.0, 1e3 * HEIGHTS), form="%.9g")


def table_of(header: str, values: np.ndarray, ts: np.ndarray = TS, separator: str = ",") -> bytes:
    return text(header.split(separator), (ts, values), separator, "%.12g").encode()


def height(name: str, content: str | bytes, *says: str, sidecar: str | None = None) -> Export:
    written = content.encode() if isinstance(content, str) else content
    return Export(name, written, "displacement", TS, HEIGHTS, says, sidecar)


def felt(name: str, content: str | bytes, *says: str, quantity: str = WHICH[2]) -> Export:
    written = content.encode() if isinstance(content, str) else content
    return Export(name, written, quantity, TS, PULSES, says)


def heard(name: str, content: str | bytes, *says: str, begin: float = BOUNCES[0]) -> Export:
    written = content.encode() if isinstance(content, str) else content
    times = BOUNCES - BOUNCES[0] + begin
    return Export(name, written, "impact times", times, times, says)


TEXTS = {
    "phyphox": felt("raw.csv", ACCELERATION, *WHICH),
    "phyphox, decimal commas": felt("raw.csv", comma(ACCELERATION), *WHICH),
    "phyphox, tabs": felt("raw.csv", ACCELERATION.replace(",", "\t"), *WHICH),
    "phyphox, linear": felt("raw.csv", LINEAR, "read as acceleration", quantity="acceleration"),
    "phyphox, gyroscope": Export("a.csv", GYROSCOPE.encode(), "angular velocity", TS, RATES),
    "phyphox, archive": felt("raw.zip", zipped(**{"Raw Data.csv": ACCELERATION}, **ABOUT), *WHICH),
    "phyphox, collision": heard("energy.csv", COLLISION, "Bounce 0 (s)"),
    "phyphox, flights": Export(
        "energy.csv",
        (",".join(FLIGHTS) + "\n" + ONE_ROW).encode(),
        "impact times",
        np.array([0, 0.571, 1.062, 1.489]),
        np.array([0, 0.571, 1.062, 1.489]),
        ("sums of the durations",),
    ),
    "phyphox, stopwatch": heard("multiple.csv", text(STOPS, HALTED), "Start (s)"),
    "phyphox, stopwatches": heard(
        "stop.zip", zipped(**{"Simple.csv": SIMPLE, "Multiple.csv": text(STOPS, HALTED)}, **ABOUT)
    ),
    "Tracker": height("t.txt", "mass_A\t\t\n" + TRACKED, "`y` is read", "without a unit", "varies"),
    "Tracker, commas": height("t.csv", "mass_A\n" + TRACKED.replace("\t", ","), "varies most"),
    "Tracker, two bodies": height("t.txt", TWO_BODIES, "Of the parts 1, 2 the longest", ": 1;"),
    "Tracker, no name": height("t.txt", TRACKED, "displacement in m, and time in s"),
    "Vernier": height("v.csv", VERNIER, "Run 1, Run 2, Run 3 the longest", ": Run 2;"),
    "Vernier, decimal commas": height("v.csv", comma(VERNIER), "Run 2"),
    "Vernier, latest": Export("v.csv", LATEST.encode(), "contact force", TS, FORCES, ("Run 1",)),
    "Vernier, older": height("v.txt", LOGGER_PRO),
    "Capstone": height("c.csv", CAPSTONE, "Run #1, Run #2", ": Run #2;"),
    "Capstone, channels": height("c.csv", CHANNELS, "Run #2"),
    "Sensor Logger": felt("TotalAcceleration.csv", LOGGED, "proper acceleration in m/s²", "`z`"),
    "Sensor Logger, other": felt("Accelerometer.csv", LOGGED, "`z`", quantity="acceleration"),
    "Sensor Logger, gyroscope": Export(
        "Gyroscope.csv", TURNED.encode(), "angular velocity", TS, RATES, ("rad/s", "`y`")
    ),
    "Sensor Logger, archive": felt(
        "log.zip",
        zipped(
            **{"Gravity.csv": TURNED, "TotalAcceleration.csv": LOGGED, "Meta.csv": ABOUT_LOGGER}
        ),
    ),
    "LabVIEW, one clock": height("a.lvm", ONE, "`Load [N]` is not used"),
    "LabVIEW, no clock": height("a.lvm", NO),
    "LabVIEW, clocks": felt("a.lvm", MULTI, "Acceleration z [g]"),
    "LabVIEW, decimal commas": height("a.lvm", ONE.replace(".", ",")),
    "blanks with gaps": height("a.txt", BLANKS, "`Load (N)` is not used"),
    "comments": height(
        "a.txt", "# made by hand\n# Time (s),Position (m)\n" + PLAIN.split("\n", 1)[1]
    ),
    "text around": height(
        "a.csv", "Laboratory\nroom, 7\n\n" + PLAIN + "\nMean, 3\n", "The text after"
    ),
    "row of units": height("a.csv", table_of("Time,Height\ns,mm", 1e3 * HEIGHTS)),
    "slashes": height("a.txt", table_of("t / s\ty / mm", 1e3 * HEIGHTS, separator="\t")),
    "underscores": height("a.csv", table_of("time_ms,height_mm", 1e3 * HEIGHTS, 1e3 * TS)),
    "since 1970": height(
        "a.csv", table_of("timestamp,z [cm]", 1e2 * HEIGHTS, 1.7e12 + 1e3 * TS), "from a date"
    ),
    "frames": height("a.csv", FRAMES, sidecar="[read]\nframe_rate = 100\n")._replace(ts=TS + 0.07),
}
SYNONYMS = {
    "Position (m)": ("displacement", HEIGHTS, 1.0),
    "Height (cm)": ("displacement", HEIGHTS, 1e-2),
    "Vertical Position (mm)": ("displacement", HEIGHTS, 1e-3),
    "Distance (metres)": ("displacement", HEIGHTS, 1.0),
    "y (m)": ("displacement", HEIGHTS, 1.0),
    "Force (N)": ("contact force", FORCES, 1.0),
    "Load (kN)": ("contact force", FORCES, 1e3),
    "θ (degrees)": ("angle", ANGLES, np.pi / 180),
    "Angular Position (rad)": ("angle", ANGLES, 1.0),
    "ω (rad/s)": ("angular velocity", RATES, 1.0),
    "Gyroscope y (deg/s)": ("angular velocity", RATES, np.pi / 180),
    "wz (dps)": ("angular velocity", RATES, np.pi / 180),
    "gyroX_dps": ("angular velocity", RATES, np.pi / 180),
    "accX (m/s^2)": ("proper acceleration", PULSES, 1.0),
    "ax (m/s^2)": ("proper acceleration", PULSES, 1.0),
    "X Acceleration 1 (m/s²)": ("proper acceleration", PULSES, 1.0),
    "Linear acceleration x (m/s/s)": ("acceleration", PULSES, 1.0),
    "v / (m/s)": ("velocity", RATES, 1.0),
}


def write(export: Export, folder: Path) -> Path:
    path = folder / export.name
    path.write_bytes(export.content)
    if export.sidecar is not None:
        path.with_suffix(".toml").write_text(export.sidecar)
    return path
