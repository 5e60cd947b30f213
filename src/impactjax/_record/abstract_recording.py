"""The interface of recordings: observations of a motion."""

import abc
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Bool, Float, Int

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
from impactjax._types import Flag, Numbers

Own = TypeVar("Own", bound="AbstractRecording")
Residuals = Float[AnyArray, " observations"]
Instants = Float[AnyArray, " observations"]
Number = Float[AnyArray, ""]
Valid = Bool[AnyArray, " observations"]


class Curves(NamedTuple):
    """Recorded and fitted curves of a figure.

    - `at`, `recorded`, `fitted`: abscissa and the two ordinates.
    - `across`, `along`: labels of the axes.
    - `dense`: true to draw the recorded points as a line.
    """

    at: np.ndarray
    recorded: np.ndarray
    fitted: np.ndarray
    across: str
    along: str
    dense: bool


class Part(NamedTuple):
    """Part of a recording.

    - `begin`, `end`: times [s].
    - `reason`: clause that says why only this part is fitted.
    - `at_rest`: true if the mass is at rest when the part begins.
    """

    begin: float
    end: float
    reason: str
    at_rest: bool


class AbstractRecording(eqx.Module):
    """Observations of one motion, with a mask `valid` of those that count.

    It computes residuals for a fit, first estimates for a search, and curves for a figure.
    """

    valid: eqx.AbstractVar[Valid]

    @property
    @abc.abstractmethod
    def instants(self) -> Instants:
        """Times of the observations [s]."""

    @property
    def begin(self) -> Number:
        """Time of the first observation [s]."""
        return plain(self.instants)[0]

    @property
    @abc.abstractmethod
    def end(self) -> Number:
        """Time of the last known observation [s]."""

    @property
    @abc.abstractmethod
    def usual_oscillator(self) -> str:
        """The usual oscillator of such records, by its name on the command line."""

    @abc.abstractmethod
    def suits(self, oscillator: AbstractOscillator) -> bool:
        """True if the recording can be of an oscillator."""

    @property
    @abc.abstractmethod
    def observed(self) -> str:
        """Name of the observed quantity, as in a file's header."""

    @property
    @abc.abstractmethod
    def unit(self) -> str:
        """SI unit of the observations."""

    @property
    @abc.abstractmethod
    def shown(self) -> tuple[str, float]:
        """Unit in figures and tables, and the factor from the SI unit."""

    @property
    @abc.abstractmethod
    def axis(self) -> tuple[np.ndarray, str]:
        """Abscissa of the observations in a figure, and the label of that axis."""

    @property
    @abc.abstractmethod
    def observes_impacts(self) -> bool:
        """True if each observation is an impact. A fit then estimates the time of the first."""

    @property
    @abc.abstractmethod
    def needs_force_law(self) -> bool:
        """True if a rigid stop has nothing that could be recorded: for a force."""

    @property
    @abc.abstractmethod
    def shows_place(self) -> bool:
        """True if the coordinate itself was recorded."""

    @property
    @abc.abstractmethod
    def shows_rate(self) -> bool:
        """True if the velocity or the acceleration of the coordinate was recorded."""

    @property
    @abc.abstractmethod
    def shows_jumps(self) -> bool:
        """True for a velocity that jumps from one sample to the next, whose jumps are marked."""

    @abc.abstractmethod
    def curves(self, residuals: np.ndarray) -> Curves:
        """Recorded and fitted curves, in the unit `shown`."""

    @abc.abstractmethod
    def check_suits(self, model: ImpactOscillator, sensor: Sensor) -> None:
        """Raises `ValueError` if a model does not have the recorded quantity, or if a sensor has
        what such a recording does not show.
        """

    @abc.abstractmethod
    def residuals(
        self, system: System, simulation: Simulation, logged: Flag | None
    ) -> tuple[Residuals, ImpactLog]:
        """Simulated minus recorded in the SI unit, 0 if not valid; and the impact log, which is
        zero if `logged` is false when the program runs.
        """

    @abc.abstractmethod
    def result(self, system: System, simulation: Simulation) -> RESULTS:
        """Result code of a simulation of a system over the time of the recording."""

    @abc.abstractmethod
    def shifted(self: Own, rows: Residuals) -> Own:
        """The recording with rows subtracted from the observations; residuals grow by them."""

    @abc.abstractmethod
    def outliers(self, residuals: Residuals | None = None) -> Valid:
        """Mask of the samples that jump away from the motion and back, or of those whose residuals
        do.
        """

    def without(self: Own, wrong: Valid) -> Own:
        """The recording in which some observations do not count."""
        return eqx.tree_at(lambda each: each.valid, self, np.asarray(self.valid) & ~wrong)

    @abc.abstractmethod
    def places(self, impacts: np.ndarray) -> "AbstractRecording | None":
        """The recording of the places as whose differences a velocity seems to be computed, `None`
        if it does not seem to be, or if samples are missing. They are zero at the median of some
        impacts.

        **Arguments:**

        - `impacts`: their times.
        """

    @abc.abstractmethod
    @abc.abstractmethod
    def with_jumps(self: Own) -> Own:
        """The recording of a velocity whose jumps from one sample to the next are marked: there a
        fit compares means of the velocity, not samples. The recording itself if it has none, or if
        most jumps last longer.
        """

    @abc.abstractmethod
    def at_impacts(self, impacts: ImpactLog, delay: Number) -> Valid:
        """Mask of the samples during impacts, and of two before and after each; none of impacts
        that are themselves observed.

        **Arguments:**

        - `impacts`: impacts of the system.
        - `delay`: time from the motion to its record [s].
        """

    @abc.abstractmethod
    def within(self, share: float) -> Valid:
        """Mask of the observations that count in the first `share` of the time."""

    @abc.abstractmethod
    def truncated(self: Own, share: float) -> Own:
        """The recording with only the observations in the first `share` of the time valid."""

    @abc.abstractmethod
    def between(self: Own, begin: float, end: float) -> Own:
        """The observations from one time to another [s]."""

    @abc.abstractmethod
    def turned(self: Own) -> Own:
        """The recording with the opposite sign, if the quantity has one."""

    @abc.abstractmethod
    def padded(self: Own, count: int) -> Own:
        """The recording padded with observations that do not count, up to a total number, so that
        recordings of one length share a compiled program.
        """

    @abc.abstractmethod
    def span(self) -> tuple[float, float]:
        """The lowest and the highest observation."""

    @abc.abstractmethod
    def variation(self) -> Number:
        """Sum of squared deviations of a recorded motion from its mean; 0 for impact times."""

    @abc.abstractmethod
    def first_look(
        self, oscillator: AbstractOscillator, gap: float = 0.0, sensor: Sensor | None = None
    ) -> FirstLook:
        """First estimates of motion and contact.

        **Arguments:**

        - `oscillator`: oscillator that was recorded; values that the record does not show are kept.
        - `gap`: gap of the lower stop.
        - `sensor`: known gain and offset.
        """

    @abc.abstractmethod
    def free_part(self, look: FirstLook) -> Part | None:
        """The part that the model describes: the motion after a hand let go, or a single blow and
        what surrounds it; `None` if it is the whole.
        """

    @property
    def observations(self) -> Int[AnyArray, "..."]:
        """Number of observations that count."""
        return self.valid.sum(axis=-1)


def check_list(name: str, values: Array, shape: tuple[int, ...]) -> None:
    """Raises `ValueError` for an argument that is not a list of numbers, one for each time."""
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


def counted(values: Array, valid: Numbers | None) -> Valid:
    """Mask of the values that are finite and, if `valid` is given, valid."""
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
