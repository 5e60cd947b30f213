"""Sentences on a recording before any fit."""

import math

import numpy as np

from impactjax._check.forecast import Forecast, Forecasts
from impactjax._compare.named import EQUILIBRIA, SEPARATIONS
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.survey import Survey
from impactjax._model.base_motion import Chirp, HarmonicMotion
from impactjax._model.measured_motion import MeasuredMotion
from impactjax._number_format import with_error, with_unit
from impactjax._parameter import ranges
from impactjax._record.recording import Recording
from impactjax._record.sample_noise import Noise
from impactjax._sensor.low_pass import Butterworth

_TYPICAL = {"steel on steel": 1e-4, "hard plastic or wood": 1e-3, "rubber": 5e-3}
"""Durations of contacts [s], of bodies of some centimetres."""
_MOTIONS = {
    HarmonicMotion: " harmonically",
    Chirp: " with a frequency that changes",
    MeasuredMotion: " as measured",
}
_RISE = 0.44  # duration of the main lobe of a Butterworth low-pass times its cut-off
_ONE_SIDED = 2.0  # least ratio of a value to its error for a bound on the side of zero


def read(found: Survey) -> list[str]:
    """Sentences on what was read and how."""
    recording, file = found.recording, found.file
    begin, end = float(np.asarray(recording.instants)[0]), _end(found)
    valid = np.asarray(recording.valid)
    count, all_ = np.count_nonzero(valid), len(valid)
    which = f"{count}" if count == all_ else f"{count} of {all_}"
    when = f"{begin:.4g} to {end:.4g} s"
    if isinstance(recording, Recording):
        unit, factor = recording.shown
        low, high = (each * factor for each in recording.span())
        told = (
            f"{which} samples of {recording.observed}, {when}, at {_rate(recording):.6g} Hz, from "
            f"{low:.4g} to {high:.4g} {unit}."
        )
    else:
        told = f"{which} impact times, {when}."
    beside = [] if file is None or file.sidecar_path is None else [f"Sidecar: {file.sidecar_path}."]
    return [told, *beside]


def system_words(found: Survey) -> list[str]:
    """Sentences on the system: what moves, what is known of it, and the instrument."""
    setup = found.setup
    names = {type(make()): name for name, make in OSCILLATORS.items()}
    own = names.get(type(setup.oscillator), type(setup.oscillator).__name__)
    told = [f"System: {own}, {found.why}."]
    values = [f"{name} = {value:.6g}" for name, value in setup.fixed.items()]
    of_sensor = {name: float(getattr(setup.sensor, name)) for name in ranges(setup.sensor)}
    values += [
        f"{name} = {of_sensor[name]:.6g}"
        if name in of_sensor
        else f"{name} where the search starts"
        for name in setup.held
    ]
    told += [f"Known, in SI units: {', '.join(values)}."] if values else []
    told += [f"Fitted as well: {', '.join(setup.free)}."] if setup.free else []
    if setup.separation is not None:
        rules = {type(rule): name for name, rule in SEPARATIONS.items()}
        told.append(f"Contact ends at {rules[type(setup.separation)].replace('-', ' ')}.")
    equilibrium = getattr(setup.oscillator, "equilibrium", None)
    if type(equilibrium) is type(EQUILIBRIA["inverted"]):
        told.append("The angle is counted from the upright position.")
    if setup.upper is not None:
        told.append(f"There is a second stop, above, at {setup.upper.gap:.4g} (SI).")
    base = getattr(setup.oscillator, "base", None)
    if base is not None:
        told.append(f"The base moves{_MOTIONS.get(type(base), '')}.")
    if isinstance(low_pass := setup.known_low_pass, Butterworth):
        told.append(f"Low-pass: {float(low_pass.cutoff):.4g} Hz, order {low_pass.order}.")
    return told


def noise_words(found: Survey, noise: Noise) -> str:
    """Sentence on the noise."""
    unit, factor = found.recording.shown
    if not noise.size > 0:
        return "No noise is visible."
    size = f"{noise.size * factor:.3g} {unit}"
    if not isinstance(found.recording, Recording):
        return f"The flights scatter by {size} about a smooth course."
    kind = "white" if noise.memory == 1 else f"smooth over about {noise.memory} samples"
    steps = f", steps of {noise.step * factor:.3g} {unit}" if noise.step else ""
    return f"{size} (standard deviation), {kind}{steps}."


def impacts(found: Survey) -> list[str]:
    """Sentences on the impacts, or on the free swing."""
    look, marks = found.look, found.look.marks
    if look.swings_freely:
        return [f"None: it swings freely, with {len(marks)} extremes."]
    if not len(marks):
        return ["None were found between flights."]
    span = f"from {marks[0]:.4g} to {marks[-1]:.4g} s" if len(marks) > 1 else f"at {marks[0]:.4g} s"
    told, speeds, ratios = [f"{len(marks)} found, {span}."], look.speeds, look.restitutions
    if look.is_blow:
        told.append(
            f"The impulse is that of an approach at {speeds[0]:.2g} m/s, if the restitution is "
            f"{look.restitution:g}."
        )
    elif speeds.size:
        told.append(f"Approach speeds from {speeds.max():.3g} to {speeds.min():.3g} m/s.")
        single = f"impacts from {ratios.min():.3g} to {ratios.max():.3g}"
        if look.usual_restitutions.size:
            told.append(f"Restitution {look.restitution:.3g}, single {single}.")
        else:
            told.append(f"Restitution of single {single}: none is between 0.02 and 1.")
    return told


def contacts(found: Survey) -> list[str]:
    """Sentences on how many samples a contact has, and whether a low-pass hides it."""
    recording = found.recording
    if found.look.swings_freely:
        return ["There is none."]
    if not isinstance(recording, Recording):
        return ["Not observed: impact times tell of it only as a delay of each flight."]
    rate = _rate(recording)
    values = np.asarray(recording.values)[np.asarray(recording.valid)]
    pulses = recording.quantity.contacts(values)
    if pulses:
        seen = math.pi / found.look.contact_frequency
        noun = "pulses" if len(pulses) > 1 else "pulse"
        samples = f"{seen * rate:.0f} samples"
        told = [f"{len(pulses)} {noun} of about {seen * 1e3:.3g} ms, {samples}."]
    else:
        each = [f"{_samples(t * rate)} of {t * 1e3:g} ms ({of})" for of, t in _TYPICAL.items()]
        told = [f"Not seen by itself. Samples in a typical contact: {', '.join(each)}."]
    low_pass = found.setup.known_low_pass
    if isinstance(low_pass, Butterworth):
        blur = _RISE / float(low_pass.cutoff)
        told.append(f"The low-pass smooths contacts shorter than about {blur * 1e3:.2g} ms.")
    return told


def bounded(found: Survey, forecast: Forecasts | None) -> list[str]:
    """Sentences on the parameters that such a record can bound, with expected standard errors."""
    if forecast is None:
        return ["No forecast: there is no noise to compare with, or no closed form for the record."]
    motion = ", ".join(_error(each) for each in forecast.motion)
    told = [f"{motion or 'nothing of the motion, all of which is known'}."]
    if forecast.line:
        told.append(f"r(v): {', '.join(_error(each) for each in forecast.line)}, {_range(found)}.")
    if forecast.gamma is not None:
        told.append(f"Force laws: {_stiffness(forecast)}")
    return told


def _stiffness(forecast: Forecasts) -> str:
    assert forecast.gamma is not None
    if forecast.shortest == math.inf:
        return "the stiffness is bounded from one side at most, whatever the contact's duration."
    if forecast.shortest == 0:
        return "stiffness (omega0) and damping (gamma) of any contact."
    limit = f"{forecast.shortest * 1e3:.2g} ms"
    return (
        f"the stiffness (omega0) if contacts last longer than about {limit}, only a lower bound of "
        f"it otherwise; {_error(forecast.gamma)}."
    )


def _range(found: Survey) -> str:
    speeds = found.look.speeds
    ratio = speeds.max() / speeds.min() if speeds.size and speeds.min() > 0 else 1.0
    return f"from speeds that differ by a factor of {ratio:.2g}"


def _error(each: Forecast) -> str:
    if not math.isfinite(each.error) or each.error > max(abs(each.value), 1.0) * 1e2:
        return f"{each.name} not at all"
    if each.name == "zeta" and each.value < _ONE_SIDED * each.error:
        return f"zeta only from above (to about {_ONE_SIDED * each.error:.1g})"
    shown = with_error(each.value, each.error).split(" ± ")[-1]
    return f"{each.name} to ± {with_unit(shown, each.unit)}"


def _samples(count: float) -> str:
    return f"{count:.0f}" if count >= 1 else f"{count:.1g}"


def _rate(recording: Recording) -> float:
    return 1 / float(np.median(np.diff(np.asarray(recording.ts))))


def _end(found: Survey) -> float:
    return float(np.nanmax(np.asarray(found.recording.instants)))
