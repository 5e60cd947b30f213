"""Recording of the times of impacts."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from impactjax._first_look.first_look import FirstLook, look_at_flights
from impactjax._known import is_known, namespace
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import as_parameter, plain
from impactjax._record.abstract_recording import (
    AbstractRecording,
    Curves,
    Instants,
    Number,
    Part,
    Residuals,
    Valid,
    check_increasing,
    check_list,
    counted,
)
from impactjax._results import RESULTS
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.simulate import simulate
from impactjax._simulate.simulation import Simulation
from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Flag, Numbers


class ImpactTimes(AbstractRecording):
    """The times of successive impacts, from a sound or another detector.

    **Arguments:**

    - `times`: strictly increasing times [s]; the first must be known.
    - `valid`: mask of the times that count; all by default. A missed impact needs a row that does
      not count, so that later impacts keep their number. NaN does not count.

    **Raises** `ValueError` for lists that are empty or of different lengths, and for times that do
    not increase.
    """

    times: Float[Array, " impacts"]
    valid: Valid

    def __init__(self, times: Numbers, valid: Numbers | None = None) -> None:
        self.times = as_parameter(times)
        check_list("times", self.times, self.times.shape)
        self.valid = counted(self.times, valid)
        if not isinstance(self.times, Tracer):
            times = np.asarray(self.times)
            if not np.isfinite(times[0]):
                raise ValueError("The first of the impact times has to be known: begin with it.")
            check_increasing("times", times[np.isfinite(times)])

    @property
    def instants(self) -> Instants:
        return self.times

    @property
    def end(self) -> Number:
        return jnp.nanmax(self.times)

    @property
    def usual_oscillator(self) -> str:
        return "bouncing-ball"

    def suits(self, oscillator: AbstractOscillator) -> bool:
        return oscillator.weight() is not None

    @property
    def observed(self) -> str:
        return "impact times"

    @property
    def unit(self) -> str:
        return "s"

    @property
    def shown(self) -> tuple[str, float]:
        return "ms", 1e3

    @property
    def axis(self) -> tuple[np.ndarray, str]:
        return np.arange(self.times.shape[0]), "impact number"

    @property
    def observes_impacts(self) -> bool:
        return True

    @property
    def needs_force_law(self) -> bool:
        return False

    @property
    def shows_place(self) -> bool:
        return False

    @property
    def shows_rate(self) -> bool:
        return False

    @property
    def shows_jumps(self) -> bool:
        return False

    def curves(self, residuals: np.ndarray) -> Curves:
        unit, factor = self.shown
        times, valid = np.asarray(self.times), np.asarray(self.valid)
        whole = valid[1:] & valid[:-1]
        flights = np.diff(times)[whole] * factor
        fitted = np.diff(times + residuals)[whole] * factor
        number, label = np.arange(1, len(times))[whole], f"duration of flight [{unit}]"
        return Curves(number, flights, fitted, "flight number", label, dense=False)

    def check_suits(self, model: ImpactOscillator, sensor: Sensor) -> None:
        """Accepts any model, since every model may have impacts, but no sensor of a motion."""
        del model
        values = (sensor.gain, 1.0), (sensor.offset, 0.0), (sensor.drift, 0.0)
        acts = sensor.low_pass is not None
        for value, without in values:
            acts = acts or (is_known(value) and bool(np.any(np.asarray(value) != without)))
        if acts:
            raise ValueError(
                "Times of impacts have no gain, offset, drift or low-pass: a sensor of them has a "
                "`delay` and a `sigma`."
            )

    def residuals(
        self, system: System, simulation: Simulation, logged: Flag | None
    ) -> tuple[Residuals, ImpactLog]:
        """Simulated minus recorded times. The simulation starts at the first impact; the others are
        those of its impact log.
        """
        del logged
        times, trajectory = self.times, self._simulated(system, simulation)
        simulated = jnp.concatenate([system.start.t0[None], trajectory.impacts.time])
        happened = jnp.concatenate([jnp.ones(1, bool), trajectory.impacts.happened])
        late = jnp.where(happened, simulated + system.sensor.delay - times, jnp.nan)
        return jnp.where(self.valid, late, 0.0), trajectory.impacts

    def result(self, system: System, simulation: Simulation) -> RESULTS:
        return self._simulated(system, simulation).result

    def _simulated(self, system: System, simulation: Simulation) -> Trajectory:
        return simulate(
            system.model,
            system.initial,
            (2 * self.end - self.begin)[None],
            t0=system.start.t0,
            step=simulation.step,
            tolerance=simulation.tolerance,
            max_steps=simulation.max_steps,
            max_impacts=self.times.shape[0] - 1,
            factors=system.factors,
        )

    def shifted(self, rows: Residuals) -> "ImpactTimes":
        return eqx.tree_at(lambda each: each.times, self, self.times - rows)

    def outliers(self, residuals: Residuals | None = None) -> Valid:
        del residuals
        return np.zeros(self.valid.shape, bool)

    def places(self, impacts: np.ndarray) -> None:
        del impacts
        return

    def with_jumps(self) -> "ImpactTimes":
        return self

    def at_impacts(self, impacts: ImpactLog, delay: Number) -> Valid:
        del impacts, delay
        return np.zeros(self.valid.shape, bool)

    def within(self, share: float) -> Valid:
        times = plain(self.times)
        last = namespace(times).nanmax(times)
        return plain(self.valid) & (times - times[0] <= share * (last - times[0]))

    def truncated(self, share: float) -> "ImpactTimes":
        return ImpactTimes(self.times, self.within(share))

    def between(self, begin: float, end: float) -> "ImpactTimes":
        kept = (self.times >= begin) & (self.times <= end)
        return ImpactTimes(self.times[kept], self.valid[kept])

    def turned(self) -> "ImpactTimes":
        return self

    def padded(self, count: int) -> "ImpactTimes":
        times, valid = plain(self.times), plain(self.valid)
        xp, more = namespace(times, valid), max(count - times.shape[0], 0)
        unknown = xp.pad(times, (0, more), constant_values=np.nan)
        return ImpactTimes(unknown, xp.pad(valid, (0, more)))

    def span(self) -> tuple[float, float]:
        return float(self.begin), float(self.end)

    def variation(self) -> Number:
        return np.zeros((), self.times.dtype)

    def first_look(
        self, oscillator: AbstractOscillator, gap: float = 0.0, sensor: Sensor | None = None
    ) -> FirstLook:
        del gap, sensor
        return look_at_flights(np.asarray(self.times), oscillator)

    def free_part(self, look: FirstLook) -> Part | None:
        """`None`: the motion between impacts is always free."""
        del look

    def __repr__(self) -> str:
        if not is_known(self):
            return eqx.tree_pformat(self)
        valid, count = int(self.observations), self.valid.shape[0]
        which = f"{count} impacts" if valid == count else f"{valid} of {count} impacts"
        return f"ImpactTimes({which}, {float(self.begin):g} to {float(self.end):g} s)"
