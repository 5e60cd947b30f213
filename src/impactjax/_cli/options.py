"""Options of a fit that say what Python can say, from their texts."""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

from impactjax._check.noise import noise_of
from impactjax._cli.refusal import Refusal
from impactjax._compare.named import LOSSES, check_named
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.survey import Statements, Survey, survey
from impactjax._model.oscillator import AbstractOscillator
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.prior import Normal
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.file_error import FileError
from impactjax._record.read_recording import read_recording

_RECORDINGS_HELP = "File, or several; of a folder, all its files that are not hidden."
Recordings = Annotated[list[Path], typer.Argument(metavar="RECORDING", help=_RECORDINGS_HELP)]
SystemName = Annotated[
    str | None,
    typer.Option("--system", metavar="NAME", help=f"What moves: {', '.join(OSCILLATORS)}."),
]
SidecarFile = Annotated[
    Path | None,
    typer.Option("--sidecar", metavar="FILE", help="TOML file to use instead of NAME.toml."),
]
Force = Annotated[bool, typer.Option("--force", help="Overwrite files in DIR.")]

_FREE_HELP = "A parameter to fit although it is usually known. May be given several times."
Free = Annotated[list[str] | None, typer.Option("--free", metavar="NAME", help=_FREE_HELP)]

_FIX_HELP = (
    "A parameter not to fit, at a value in SI units and radians, or where the search would start. "
    "May be given several times."
)
Fix = Annotated[list[str] | None, typer.Option("--fix", metavar="NAME[=VALUE]", help=_FIX_HELP)]

_PRIOR_HELP = (
    "A parameter that was measured before, with its standard error, in SI units and radians. May "
    "be given several times."
)
Prior = Annotated[
    list[str] | None, typer.Option("--prior", metavar="NAME=VALUE,ERROR", help=_PRIOR_HELP)
]

_LOSS_HELP = (
    f"Cost of a residual: {', '.join(LOSSES)}. SCALE is the size of a large one in the SI unit; by "
    "default twice the noise."
)
LossName = Annotated[str, typer.Option("--loss", metavar="NAME[=SCALE]", help=_LOSS_HELP)]

_SIDECAR = ".toml"
_NO_LOW_PASS = "cutoff", "inf"  # the only value that may be infinite
_MOST_HELD_OUT = 0.9
_USUAL_SCALE = 2.0  # in standard deviations of the noise


class Options(NamedTuple):
    """Options of a fit: names to free, values to fix (`None` where a search starts), prior
    knowledge, and a loss.
    """

    free: tuple[str, ...]
    fixed: dict[str, float | None]
    loss: str = "squares"
    priors: Mapping[str, Normal] = {}

    def loss_for(self, recording: AbstractRecording) -> AbstractLoss:
        """The loss, with a scale that follows from the noise of a recording unless it was given.

        **Raises** `Refusal` for a recording that shows no noise.
        """
        name, _, scale = self.loss.partition("=")
        if name == "squares":
            return Squares()
        size = float(scale) if scale else _USUAL_SCALE * noise_of(recording).size
        if not size > 0:
            raise Refusal(f"the record shows no noise; give a scale, as in --loss {name}=0.001.")
        return LOSSES[name](size)


def options(
    free: Sequence[str], fix: Sequence[str], loss: str = "squares", prior: Sequence[str] = ()
) -> Options:
    """Options from their texts. Raises `Refusal`."""
    name, equals, scale = loss.partition("=")
    try:
        check_named("loss", name, LOSSES)
    except ValueError as error:
        raise Refusal(str(error)) from error
    if equals and (name == "squares" or not _number("--loss", loss, scale) > 0):
        remedy = "has no scale" if name == "squares" else "needs a scale greater than 0"
        raise Refusal(f"the loss `{name}` {remedy}.")
    return Options(tuple(free), dict(_fixed(text) for text in fix), loss, _priors(prior))


def files_of(recordings: Sequence[Path]) -> list[Path]:
    """The files of a command's arguments, each once; of a folder all that are neither sidecars nor
    hidden, in the order of their names. Raises `Refusal` for a folder without any.
    """
    found: dict[Path, Path] = {}
    for path in recordings:
        own = _inside(path) if path.is_dir() else [path]
        if not own:
            raise Refusal(f"{path} has no file in it; name a recording, or a folder of some.")
        for each in own:
            found.setdefault(each.resolve(), each)
    return [*found.values()]


def _inside(folder: Path) -> list[Path]:
    return sorted(
        path
        for path in folder.iterdir()
        if path.is_file() and path.suffix != _SIDECAR and not path.name.startswith(".")
    )


def surveyed(
    path: Path,
    sidecar: Path | None,
    oscillator: AbstractOscillator | None,
    laws: Sequence[str] | None,
    said: Options,
) -> Survey:
    """The survey of a recording with what the options say. Raises `FileError` or `Refusal`."""
    try:
        file = read_recording(path, sidecar)
        told = Statements(oscillator, laws, None, said.fixed, {}, said.free, said.priors)
        return survey(file, told)
    except FileError:
        raise
    except ValueError as error:
        raise Refusal(f"{path}: {error}") from error


def held_out(text: str, fitted: Sequence[Path]) -> float | Path:
    """The share of a recording, or another recording, that is held out. Raises `Refusal`."""
    try:
        share = float(text)
    except ValueError:
        if Path(text).resolve() in {path.resolve() for path in fitted}:
            raise Refusal(f"{text} is fitted itself: hold out another recording.") from None
        return Path(text)
    if not 0 <= share <= _MOST_HELD_OUT:
        raise Refusal(f"--holdout {text} must be a share from 0 to {_MOST_HELD_OUT}.")
    return share


def _fixed(text: str) -> tuple[str, float | None]:
    name, equals, value = text.partition("=")
    if not re.fullmatch(r"\w+", name):
        raise Refusal(f"`{text}` is neither NAME nor NAME=VALUE.")
    if (name, value) == _NO_LOW_PASS:
        return name, math.inf
    return name, _number("--fix", text, value) if equals else None


def _priors(texts: Sequence[str]) -> dict[str, Normal]:
    """Prior knowledge from the texts of the option. Raises `Refusal`."""
    found: dict[str, Normal] = {}
    for text in texts:
        parts = re.fullmatch(r"(\w+)=([^,]*),([^,]*)", text)
        if parts is None:
            raise Refusal(f"`{text}` is not NAME=VALUE,ERROR.")
        name, *numbers = parts.groups()
        value, error = (_number("--prior", text, number.strip()) for number in numbers)
        if not error > 0:
            raise Refusal(f"the error in --prior `{text}` must be greater than 0.")
        if name in found:
            raise Refusal(f"`{name}` has two priors; combine them to one.")
        found[name] = Normal(value, error)
    return found


def _number(option: str, text: str, value: str) -> float:
    """A finite number from a part of an option's text. Raises `Refusal`."""
    try:
        found = float(value)
    except ValueError as error:
        sentence = f"`{value}` in {option} `{text}` is not a number in the SI unit."
        raise Refusal(sentence) from error
    if not np.isfinite(found) or "_" in value:
        raise Refusal(f"`{value}` in {option} `{text}` is not a finite number.")
    return found
