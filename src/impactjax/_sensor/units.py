"""Units in which quantities may be recorded, with factors to SI, and the ways to write them."""

import math

from impactjax._model.gravity import STANDARD_GRAVITY

_DEGREE = math.pi / 180
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE, "°": _DEGREE}
ANGULAR_VELOCITIES = {"rad/s": 1.0, "deg/s": _DEGREE, "°/s": _DEGREE}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
VELOCITIES = {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3}
ANGULAR_ACCELERATIONS = {
    "rad/s²": 1.0,
    "rad/s^2": 1.0,
    "rad/s2": 1.0,
    "deg/s²": _DEGREE,
    "deg/s^2": _DEGREE,
}
ACCELERATIONS = {
    "m/s²": 1.0,
    "m/s^2": 1.0,
    "m/s2": 1.0,
    "cm/s²": 1e-2,
    "mm/s²": 1e-3,
    "g": STANDARD_GRAVITY,
}
FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}

_WORDS = {
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("microsecond", "microseconds", "μs"), "µs"),  # μ: the Greek letter
    **dict.fromkeys(("nanosecond", "nanoseconds"), "ns"),
    **dict.fromkeys(("degree", "degrees", "º"), "deg"),
    **dict.fromkeys(("radian", "radians"), "rad"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("centimeter", "centimeters", "centimetre", "centimetres"), "cm"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("μm",), "µm"),
    **dict.fromkeys(("newton", "newtons"), "N"),
    **dict.fromkeys(("m/s/s", "m·s⁻²", "m·s^-2", "ms^-2", "m/sec^2", "m/s**2"), "m/s²"),
    **dict.fromkeys(("m·s⁻¹", "m·s^-1", "ms^-1", "m/sec"), "m/s"),
    **dict.fromkeys(("deg/sec", "degrees/s", "º/s", "dps"), "deg/s"),
    **dict.fromkeys(("radians/s", "rad/sec", "rad·s⁻¹"), "rad/s"),
    **dict.fromkeys(("rad/s/s", "rad·s⁻²", "rad/s**2"), "rad/s²"),
    **dict.fromkeys(("g's", "gs", "g0", "gₙ"), "g"),
}


def usual_unit(unit: str) -> str:
    """A unit as the tables of this file write it, if it is written in another known way."""
    short = unit.strip()
    return _WORDS.get(short.lower().replace(" ", ""), short.replace("s^2", "s²"))
