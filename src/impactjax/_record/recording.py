"""Recording of a quantity sampled in time."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._first_look.blow import Pulse, blow, look_at_blow, surroundings
from impactjax._first_look.coordinate import pulse_duration
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
from impactjax._record.beside_impacts import beside_impacts
from impactjax._record.outliers import outliers
from impactjax._record.padded import continued, padded
from impactjax._record.restored import restored
from impactjax._record.velocity_jumps import MarkedJumps, marked_jumps
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


class Recording(AbstractRecording):
    """A quantity sampled in time.

    **Arguments:**

    - `ts`: strictly increasing times [s].
    - `values`: values in the quantity's SI unit.
    - `quantity`: observed quantity.
    - `valid`: mask of the samples that count; all by default. A fit ignores the others (empty,
      clipped), but simulates them, which the low-pass of a sensor needs. Values that are not finite
      do not count.
    - `jumps`: jumps of a velocity, as `with_jumps` finds them; none by default.

    **Raises** `ValueError` for lists that are empty or of different lengths, and for times that do
    not increase.
    """

    ts: Samples
    values: Samples
    quantity: AbstractQuantity
    valid: Valid
    jumps: MarkedJumps | None

    def __init__(
        self,
        ts: Numbers,
        values: Numbers,
        quantity: AbstractQuantity,
        valid: Numbers | None = None,
        jumps: MarkedJumps | None = None,
    ) -> None:
        self.ts = as_parameter(ts)
        self.values = as_parameter(values)
        self.jumps = jumps
        check_kind("quantity", quantity, AbstractQuantity, "Angle()")
        self.quantity = quantity
        check_list("ts", self.ts, self.ts.shape)
        check_list("values", self.values, self.ts.shape)
        check_increasing("ts", self.ts)
        self.valid = counted(self.values, valid)
        if jumps is not None:
            check_list("jumps", jumps.weights, self.ts.shape)

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
    def shows_jumps(self) -> bool:
        return self.jumps is not None

    def curves(self, residuals: np.ndarray) -> Curves:
        unit, factor = self.shown
        values = np.where(np.asarray(self.valid), np.asarray(self.values), np.nan) * factor
        deviations = residuals if self.jumps is None else self.jumps.unweighted(residuals)
        fitted = values + deviations * factor
        at, across = self.axis
        return Curves(at, values, fitted, across, f"{self.observed} [{unit}]", dense=True)

    def check_suits(self, model: ImpactOscillator, sensor: Sensor) -> None:
        self.quantity.check_suits(model)
        if self.jumps is not None and sensor.low_pass is not None:
            raise ValueError("A velocity with marked jumps has no low-pass, which smears them.")

    def residuals(
        self, system: System, simulation: Simulation, logged: Flag | None
    ) -> tuple[Residuals, ImpactLog]:
        trajectory = self._simulated(system, simulation, logged)
        shown = system.sensor.shown(system.model, trajectory, self.quantity)
        rows = shown - self.values
        if self.jumps is not None:
            rows = self.jumps.rows(system.sensor.shown_mean(trajectory), rows)
        return jnp.where(self.valid, rows, 0.0), trajectory.impacts

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
        jumps = None if self.jumps is None else self.jumps.shifted(rows)
        return dataclasses.replace(self, values=self.values - rows, jumps=jumps)

    def outliers(self, residuals: Residuals | None = None) -> Valid:
        values = self.values if residuals is None else residuals
        return outliers(np.asarray(values), np.asarray(self.valid), self.quantity)

    def places(self, impacts: np.ndarray) -> "Recording | None":
        quantity = self.quantity.of_places
        if quantity is None or not np.all(self.valid):
            return None
        found = restored(np.asarray(self.ts), np.asarray(self.values), impacts)
        return None if found is None else Recording(self.ts, found, quantity)

    def with_jumps(self) -> "Recording":
        if self.quantity.derivative != 1:
            return self
        jumps = marked_jumps(*map(np.asarray, (self.ts, self.values, self.valid)))
        return self if jumps is None else dataclasses.replace(self, jumps=jumps)

    def at_impacts(self, impacts: ImpactLog, delay: Number) -> Valid:
        return beside_impacts(plain(self.ts), impacts, delay)

    def within(self, share: float) -> Valid:
        ts = plain(self.ts)
        return plain(self.valid) & (ts - ts[0] <= share * (ts[-1] - ts[0]))

    def truncated(self, share: float) -> "Recording":
        return eqx.tree_at(lambda each: each.valid, self, self.within(share))

    def between(self, begin: float, end: float) -> "Recording":
        kept = (self.ts >= begin) & (self.ts <= end)
        jumps = None if self.jumps is None else self.jumps.at(kept)
        own = self.ts[kept], self.values[kept], self.quantity, self.valid[kept], jumps
        return Recording(*own)

    def turned(self) -> "Recording":
        jumps = None if self.jumps is None else self.jumps.turned()
        return dataclasses.replace(self, values=-plain(self.values), jumps=jumps)

    def padded(self, count: int) -> "Recording":
        more = count - self.ts.shape[0]
        if more <= 0:
            return self
        values, valid = padded(self.values, more), padded(self.valid, more, False)
        jumps = None if self.jumps is None else self.jumps.padded(more)
        return Recording(continued(self.ts, more), values, self.quantity, valid, jumps)

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
        duration = pulse_duration(ts, values, self.quantity.contacts(values))
        return look(ts, places, oscillator, gap, duration)

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

    def __repr__(self) -> str:
        if not is_known(self):
            return eqx.tree_pformat(self)
        valid, count = int(self.observations), self.valid.shape[0]
        which = f"{count} samples" if valid == count else f"{valid} of {count} samples"
        ends = f"{float(self.begin):g} to {float(self.end):g} s"
        return f"Recording({which} of {self.observed}, {ends})"
