"""Recording of a quantity sampled in time."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._first_look.blow import Pulse, blow, look_at_blow, surroundings
from impactjax._first_look.first_look import FirstLook, look_at_motion
from impactjax._first_look.forced import look_at_forced_motion
from impactjax._first_look.hand_release import release
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
from impactjax._record.outliers import outliers
from impactjax._record.restored import restored
from impactjax._refusal import check_kind
from impactjax._results import RESULTS
from impactjax._sensor.abstract_quantity import AbstractQuantity
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import System
from impactjax._simulate.chatter import Chatter
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.simulate import simulate_logged
from impactjax._simulate.simulation import Simulation
from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Flag, Numbers, Samples

_HELD = "A hand seems to hold or push at first"
_BESIDE = 2  # samples before and after an impact that may show it
_PADDING = 0.02  # spacing of padding samples, relative to that of the others


class Recording(AbstractRecording):
    """A quantity sampled in time.

    **Arguments:**

    - `ts`: strictly increasing times [s].
    - `values`: values in the quantity's SI unit.
    - `quantity`: observed quantity.
    - `valid`: mask of the samples that count; all by default. A fit ignores the others (empty,
      clipped), but simulates them, which the low-pass of a sensor needs. Values that are not finite
      do not count.

    **Raises** `ValueError` for lists that are empty or of different lengths, and for times that do
    not increase.
    """

    ts: Samples
    values: Samples
    quantity: AbstractQuantity
    valid: Valid

    def __init__(
        self,
        ts: Numbers,
        values: Numbers,
        quantity: AbstractQuantity,
        valid: Numbers | None = None,
    ) -> None:
        self.ts = as_parameter(ts)
        self.values = as_parameter(values)
        check_kind("quantity", quantity, AbstractQuantity, "Angle()")
        self.quantity = quantity
        check_list("ts", self.ts, self.ts.shape)
        check_list("values", self.values, self.ts.shape)
        check_increasing("ts", self.ts)
        self.valid = counted(self.values, valid)

    @property
    def instants(self) -> Instants:
        return self.ts

    @property
    def end(self) -> Number:
        return plain(self.ts)[-1]

    @property
    def usual_oscillator(self) -> str:
        if self.quantity.shows_blows and self._blow_of_any_sign() is not None:
            return "free-mass"
        if self.quantity.is_carried:
            return "bouncing-ball"
        return "pendulum" if self.quantity.of_angle else "linear-oscillator"

    def suits(self, oscillator: AbstractOscillator) -> bool:
        return self.quantity.of_angle in (None, oscillator.is_angle())

    @property
    def observed(self) -> str:
        return self.quantity.name

    @property
    def unit(self) -> str:
        return self.quantity.unit

    @property
    def shown(self) -> tuple[str, float]:
        return self.quantity.shown, 1 / self.quantity.units[self.quantity.shown]

    @property
    def axis(self) -> tuple[np.ndarray, str]:
        return np.asarray(self.ts), "time [s]"

    @property
    def observes_impacts(self) -> bool:
        return False

    @property
    def needs_force_law(self) -> bool:
        return self.quantity.is_force

    @property
    def shows_place(self) -> bool:
        return self.quantity.derivative == 0

    @property
    def shows_rate(self) -> bool:
        return self.quantity.derivative in (1, 2)

    @property
    def jumps(self) -> bool:
        return self.quantity.derivative == 1

    def curves(self, residuals: np.ndarray) -> Curves:
        unit, factor = self.shown
        values = np.where(np.asarray(self.valid), np.asarray(self.values), np.nan) * factor
        fitted = values + residuals * factor
        at, across = self.axis
        return Curves(at, values, fitted, across, f"{self.observed} [{unit}]", dense=True)

    def check_suits(self, model: ImpactOscillator, sensor: Sensor) -> None:
        del sensor
        self.quantity.check_suits(model)

    def residuals(
        self, system: System, simulation: Simulation, logged: Flag | None
    ) -> tuple[Residuals, ImpactLog]:
        trajectory = self._simulated(system, simulation, logged)
        shown = system.sensor.shown(system.model, trajectory, self.quantity)
        return jnp.where(self.valid, shown - self.values, 0.0), trajectory.impacts

    def result(self, system: System, simulation: Simulation) -> RESULTS:
        return self._simulated(system, simulation, None).result

    def _simulated(self, system: System, simulation: Simulation, logged: Flag | None) -> Trajectory:
        return simulate_logged(
            system.model,
            system.initial,
            system.sensor.sampled(self.ts, self.quantity),
            t0=system.start.t0 - system.sensor.delay,
            step=simulation.step,
            tolerance=simulation.tolerance,
            max_steps=simulation.max_steps,
            max_impacts=simulation.max_impacts,
            chatter=Chatter(),
            logged=logged,
            factors=system.factors,
        )

    def shifted(self, rows: Residuals) -> "Recording":
        return eqx.tree_at(lambda each: each.values, self, self.values - rows)

    def outliers(self, residuals: Residuals | None = None) -> Valid:
        values = self.values if residuals is None else residuals
        return outliers(np.asarray(values), np.asarray(self.valid), self.quantity)

    def places(self, impacts: np.ndarray) -> "Recording | None":
        ts, quantity = np.asarray(self.ts), self.quantity.of_places
        if quantity is None or not np.all(self.valid):
            return None
        found = restored(ts, np.asarray(self.values))
        if found is None:
            return None
        return Recording(ts, found - np.median(np.interp(impacts, ts, found)), quantity)

    def at_impacts(self, impacts: ImpactLog, delay: Number) -> Valid:
        ts = plain(self.ts)
        xp = namespace(ts, impacts, delay)
        begin = xp.where(impacts.happened, impacts.time, xp.inf) + delay
        end = xp.where(impacts.complete, begin + impacts.duration, xp.inf)
        number = np.arange(ts.shape[0])
        behind, ahead = (ts[np.clip(number + n, 0, number[-1])] for n in (-_BESIDE, _BESIDE))
        return xp.any((ahead[:, None] >= begin) & (behind[:, None] <= end), axis=-1)

    def within(self, share: float) -> Valid:
        ts = plain(self.ts)
        return plain(self.valid) & (ts - ts[0] <= share * (ts[-1] - ts[0]))

    def truncated(self, share: float) -> "Recording":
        return Recording(self.ts, self.values, self.quantity, self.within(share))

    def between(self, begin: float, end: float) -> "Recording":
        kept = (self.ts >= begin) & (self.ts <= end)
        return Recording(self.ts[kept], self.values[kept], self.quantity, self.valid[kept])

    def turned(self) -> "Recording":
        return eqx.tree_at(lambda each: each.values, self, -plain(self.values))

    def padded(self, count: int) -> "Recording":
        more = count - self.ts.shape[0]
        if more <= 0:
            return self
        ts, values, valid = (plain(x) for x in (self.ts, self.values, self.valid))
        xp = namespace(ts, values, valid)
        beyond = xp.arange(1, more + 1, dtype=ts.dtype)
        later = ts[-1] + _PADDING * (ts[-1] - ts[-2]) * beyond
        return Recording(
            xp.concatenate([ts, later]),
            xp.pad(values, (0, more), mode="edge"),
            self.quantity,
            xp.pad(valid, (0, more)),
        )

    def span(self) -> tuple[float, float]:
        values = np.asarray(self.values)[np.asarray(self.valid)]
        return float(values.min()), float(values.max())

    def variation(self) -> Number:
        valid, values = plain(self.valid), plain(self.values)
        xp = namespace(valid, values)
        mean = xp.sum(xp.where(valid, values, 0.0)) / xp.sum(valid).astype(values.dtype)
        return xp.sum(xp.where(valid, values - mean, 0.0) ** 2)

    def first_look(
        self, oscillator: AbstractOscillator, gap: float = 0.0, sensor: Sensor | None = None
    ) -> FirstLook:
        own = self if sensor is None else self._before(sensor)
        ts, values = own._without_gaps()
        flies_straight = oscillator.weight() is None and not oscillator.has_equilibrium()
        push = self.quantity.push(values, oscillator) if flies_straight else None
        pulse = None if push is None else own._blow()
        if push is not None and pulse is not None:
            return look_at_blow(ts, push, pulse, oscillator)
        places = self.quantity.coordinate(ts, values, oscillator)
        look = look_at_forced_motion if oscillator.is_forced() else look_at_motion
        return look(ts, places, oscillator, gap, own._contact_duration())

    def free_part(self, look: FirstLook) -> Part | None:
        ts, values, valid = (np.asarray(x) for x in (self.ts, self.values, self.valid))
        pulse = self._blow_of_any_sign() if look.is_blow else None
        if pulse is not None:
            found, reason = surroundings(ts, pulse), "There is one blow"
        elif self.quantity.is_felt:
            found, reason = self.quantity.free_fall(ts, values, valid), _HELD
        else:
            places = self.quantity.coordinate(*self._without_gaps(), look.oscillator)
            found, reason = release(ts, places, valid, look), _HELD
        falls = self.quantity.is_felt and pulse is None
        return None if found is None else Part(*found, reason, falls)

    def _blow(self) -> Pulse | None:
        """Samples of the contact, if the record is that of a single blow."""
        _, values = self._without_gaps()
        return blow(values) if self.quantity.contacts(values) else None

    def _blow_of_any_sign(self) -> Pulse | None:
        return self._blow() or self.turned()._blow()

    def _before(self, sensor: Sensor) -> "Recording":
        """The quantity before a sensor: (values − offset) / gain."""
        values = (plain(self.values) - plain(sensor.offset)) / plain(sensor.gain)
        return eqx.tree_at(lambda each: each.values, self, values)

    def _without_gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Times, and values with linear interpolation over samples that do not count."""
        ts, valid = np.asarray(self.ts), np.asarray(self.valid)
        return ts, np.interp(ts, ts[valid], np.asarray(self.values)[valid])

    def _contact_duration(self) -> float | None:
        """Duration of the contacts [s] that appear as pulses: that of half a sine wave with the
        pulses' width at half maximum.
        """
        ts, values = self._without_gaps()
        pulses = [values[begin:end] for begin, end in self.quantity.contacts(values)]
        if not pulses:
            return None
        samples = np.median([np.count_nonzero(pulse > pulse.max() / 2) for pulse in pulses])
        return 1.5 * float(samples * np.median(np.diff(ts)))

    def __repr__(self) -> str:
        if not is_known(self):
            return eqx.tree_pformat(self)
        valid, count = int(self.observations), self.valid.shape[0]
        which = f"{count} samples" if valid == count else f"{valid} of {count} samples"
        ends = f"{float(self.begin):g} to {float(self.end):g} s"
        return f"Recording({which} of {self.observed}, {ends})"
