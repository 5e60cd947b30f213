"""Checks of the names and values in a setup, whoever said them."""

from collections.abc import Collection

from impactjax._compare.laws import LAWS, NO_LAW, USUAL_LAWS
from impactjax._compare.oscillators import DRY_FRICTION, complete
from impactjax._compare.said import refused_in_sidecar
from impactjax._compare.setup import Setup
from impactjax._compare.typical_systems import Law, Upper, typical_system
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import Range, ranges
from impactjax._problem.checks import check_known, check_value
from impactjax._problem.parameters import handles
from impactjax._record.read_recording import RecordingFile


def check_requests(
    setup: Setup, file: RecordingFile | None = None, arguments: Collection[str] = ()
) -> None:
    """Checks the names and values in a setup; a name may also belong to a law that is not tried.

    **Arguments:**

    - `setup`: what the sidecar and the arguments say together.
    - `file`: recording with its sidecar, if there is one.
    - `arguments`: names that come from the arguments, so that an error does not blame the sidecar.

    **Raises** `FileError` for a name in the sidecar, `ValueError` for another.
    """
    asked = dict.fromkeys([*setup.fixed, *setup.held, *setup.start, *setup.free])
    if not asked:
        return
    known = _known(setup, asked)
    values = {**setup.start, **setup.fixed}
    for name in asked:
        own = None if file is None or name in arguments else file
        written = name in values or name in setup.priors or own is None
        with refused_in_sidecar(own, name if written else "free"):
            check_known(name, known)
            if name in setup.free and name in {*setup.fixed, *setup.held}:
                table = "priors" if name in setup.priors else "free"
                raise ValueError(f"`{name}` is in both `{table}` and `fixed`.")
            if name == "t0" and name in setup.start:
                sentence = "`t0` cannot be started elsewhere: a search starts at the first impact."
                raise ValueError(sentence)
            if name in setup.free and name not in values and _lacks(setup.oscillator, name):
                sentence = f"`{name}` has no value to start from; give one, as under [start]."
                raise ValueError(sentence)
            if name in values:
                check_value(name, values[name], known[name])


def _lacks(oscillator: AbstractOscillator, name: str) -> bool:
    """True for a parameter that an oscillator leaves out, and that has no usual value."""
    return name != DRY_FRICTION and getattr(oscillator, name, 0.0) is None


def _known(setup: Setup, asked: Collection[str]) -> dict[str, Range]:
    """Ranges of the parameters of all laws that are tried, and of others if they are asked for."""
    found = parameters(setup.oscillator, [NO_LAW, *(setup.laws or USUAL_LAWS)], setup.upper)
    for part in (setup.sensor, setup.sensor.low_pass):
        found |= {} if part is None else ranges(part)
    if found.keys() >= {*asked}:
        return found
    return parameters(setup.oscillator, [NO_LAW, *LAWS], setup.upper) | found


def parameters(
    oscillator: AbstractOscillator, laws: Collection[Law], upper: Upper | None = None
) -> dict[str, Range]:
    """Ranges of all parameters of motion, contact laws and start, by name."""
    found: dict[str, Range] = {}
    for law in laws:
        known = handles(typical_system(complete(oscillator), law, upper))
        found |= {name: each.allowed for name, each in known.items() if each.path[0] != "sensor"}
    return found
