"""Observations of a motion, whatever their kind."""

import abc
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from impactjax._first_look.first_look import FirstLook
from impactjax._known import AnyArray
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import plain
from impactjax._results import RESULTS
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.simulation import Simulation
from impactjax._types import Flag, Scalar

Own = TypeVar("Own", bound="AbstractRecording")
Residuals = Float[AnyArray, " observations"]
Instants = Float[AnyArray, " observations"]
Number = Float[AnyArray, ""]
Valid = Bool[AnyArray, " observations"]


class Curves(NamedTuple):
    """Recorded and fitted curves of a figure.

    - `at`, `recorded`, `fitted`: what to draw.
    - `across`, `along`: names of the axes.
    - `dense`: whether the points are so many that a line shows them.
    """

    at: np.ndarray
    recorded: np.ndarray
    fitted: np.ndarray
    across: str
    along: str
    dense: bool


class AbstractRecording(eqx.Module):
    """Observations of one motion, each of which counts or does not.

    A fit asks it for residuals, a first look for what it shows, a figure for axes.
    """

    valid: eqx.AbstractVar[Valid]

    @property
    @abc.abstractmethod
    def instants(self) -> Instants:
        """Times of the observations [s]."""

    @property
    def begin(self) -> Number:
        """Time of the first observation [s]."""
        return self.instants[0]

    @property
    @abc.abstractmethod
    def end(self) -> Number:
        """Time of the last observation that is known [s]."""

    @property
    @abc.abstractmethod
    def usual_oscillator(self) -> str:
        """What most such records are of, by its name on the command line."""

    @abc.abstractmethod
    def suits(self, oscillator: AbstractOscillator) -> bool:
        """Whether a first look can start from it with an oscillator."""

    @property
    @abc.abstractmethod
    def observed(self) -> str:
        """What was observed, as in a file's header."""

    @property
    @abc.abstractmethod
    def unit(self) -> str:
        """SI unit of the observations."""

    @property
    @abc.abstractmethod
    def shown(self) -> tuple[str, float]:
        """The unit in which people read it, and the factor from SI."""

    @property
    @abc.abstractmethod
    def axis(self) -> tuple[np.ndarray, str]:
        """Where observations stand in a figure, and what that axis is called."""

    @property
    @abc.abstractmethod
    def observes_impacts(self) -> bool:
        """Whether each observation is an impact; then the time of the first is found."""

    @property
    @abc.abstractmethod
    def shows_place(self) -> bool:
        """Whether the coordinate itself was recorded."""

    @abc.abstractmethod
    def curves(self, residuals: np.ndarray) -> Curves:
        """Recorded and fitted curves, in the unit in which people read the recording."""

    @abc.abstractmethod
    def check_suits(self, model: ImpactOscillator) -> None:
        """Raises `ValueError` if a model does not have what was recorded."""

    @abc.abstractmethod
    def residuals(
        self, system: System, simulation: Simulation, logged: Flag | None
    ) -> tuple[Residuals, ImpactLog]:
        """Simulated minus recorded in the SI unit, 0 if not valid, and the impact log, as far as
        `simulate_logged` gives it.
        """

    @abc.abstractmethod
    def result(self, system: System, simulation: Simulation) -> RESULTS:
        """What becomes of a simulation of a system over the time of the recording."""

    @abc.abstractmethod
    def shifted(self: Own, rows: Residuals) -> Own:
        """The recording with so much taken from each observation: residuals grow by it."""

    @abc.abstractmethod
    def within(self, share: float) -> Valid:
        """Which observations count in the first part of the time."""

    @abc.abstractmethod
    def truncated(self: Own, share: float) -> Own:
        """The recording with only the observations of the first part of its time counted."""

    @abc.abstractmethod
    def between(self: Own, begin: float, end: float) -> Own:
        """The observations from one time to another [s]."""

    @abc.abstractmethod
    def turned(self: Own) -> Own:
        """The recording with the other sign, where it has one."""

    @abc.abstractmethod
    def padded(self: Own, count: int) -> Own:
        """The recording with observations that do not count up to a number of them: recordings of
        one length share one compiled program.
        """

    @abc.abstractmethod
    def span(self) -> tuple[float, float]:
        """The lowest and the highest of what was observed."""

    @property
    @abc.abstractmethod
    def shows_fall(self) -> bool:
        """Whether a free fall shows in it as such."""

    @abc.abstractmethod
    def variation(self) -> Scalar:
        """Sum of the squared deviations of a recorded motion from its mean; 0 of what is none."""

    @abc.abstractmethod
    def first_look(
        self, oscillator: AbstractOscillator, gap: float = 0.0, sensor: Sensor | None = None
    ) -> FirstLook:
        """Motion and contact as the recording shows them before any fit, for an oscillator of a
        given kind whose known values are kept, by a sensor of known gain and offset.
        """

    @abc.abstractmethod
    def free_part(self, look: FirstLook) -> tuple[float, float] | None:
        """From when to when [s] the motion is free, after a hand let go; `None` if it always is."""

    @property
    def observations(self) -> Int[AnyArray, "..."]:
        """How many observations count."""
        return self.valid.sum(axis=-1)


def check_list(name: str, values: Array, shape: tuple[int, ...]) -> None:
    """Raises `ValueError` for what is no list of numbers, one for each of the times."""
    if values.ndim != 1 or values.size == 0:
        raise ValueError(
            f"Argument `{name}` must be a list of at least one number, but its shape is "
            f"{values.shape}."
        )
    if values.shape != shape:
        raise ValueError(
            f"There are {values.shape[0]} `{name}` for {shape[0]} times; there must be as many."
        )


def check_increasing(name: str, times: Array | np.ndarray) -> None:
    """Raises `ValueError` for times that are known not to increase strictly."""
    if isinstance(times, Tracer):
        return
    wrong = ~(np.diff(np.asarray(times)) > 0)
    if wrong.any():
        where = int(np.argmax(wrong))
        raise ValueError(
            f"Argument `{name}` must increase strictly, but {times[where + 1]} follows "
            f"{times[where]}."
        )


def counted(values: Array, valid: ArrayLike | None) -> Valid:
    """Which values count: those that are finite, and valid if a list says which are."""
    finite = abs(plain(values)) < np.inf
    if valid is None:
        return jnp.asarray(finite)
    mask = plain(jnp.asarray(valid))
    if mask.dtype != bool or mask.shape != values.shape:
        raise ValueError(
            f"Argument `valid` must be true or false for each of {len(values)} observations, but "
            f"it is {mask.dtype} of shape {mask.shape}."
        )
    return jnp.asarray(finite & mask)
