"""The interface of observed quantities, and what several of them share."""

import abc
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._first_look.coordinate import (
    from_pulses,
    from_swing,
    from_velocity,
    is_peaked,
    pulses,
)
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._sensor.forces import acceleration, free_acceleration, slopes
from impactjax._sensor.low_pass import AbstractLowPass
from impactjax._shown import with_numbers
from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Samples

Row = np.ndarray  # a number, or a flag, a sample


class AbstractQuantity(eqx.Module):
    """A quantity that a trajectory has at every instant."""

    name: ClassVar[str]
    """Name in a file's header."""
    synonyms: ClassVar[tuple[str, ...]] = ()
    """Other names in the headers of exports."""
    units: ClassVar[dict[str, float]]
    """Factors from each unit to the SI unit, which comes first."""
    shown: ClassVar[str]
    """Unit in figures and tables."""
    of_angle: ClassVar[bool | None]
    """True for oscillators whose coordinate is an angle, false for others, `None` for both."""

    of_places: "ClassVar[AbstractQuantity | None]" = None
    """For a velocity, the quantity whose derivative it is."""
    derivative: ClassVar[int | None] = None
    """The order of the derivative of the coordinate that it is: 0 for the coordinate itself, `None`
    for other quantities.
    """
    is_carried: ClassVar[bool] = False
    """True if its sensor usually moves with a falling body."""
    is_felt: ClassVar[bool] = False
    """True if it is zero in free fall."""
    shows_blows: ClassVar[bool] = False
    """True if a record with a single pulse is usually that of a blow."""
    is_force: ClassVar[bool] = False
    """True for the force of a stop, which only a force law has."""
    density: ClassVar[int] = 1
    """Samples of a trajectory for each recorded one behind a low-pass."""

    @property
    def unit(self) -> str:
        """The SI unit."""
        return next(iter(self.units))

    def check_suits(self, model: ImpactOscillator) -> None:
        """Raises `ValueError` if a model does not have this quantity."""
        if self.of_angle not in (None, model.oscillator.is_angle()):
            raise ValueError(
                f"A record of {self.name} does not suit a {type(model.oscillator).__name__}."
            )

    @abc.abstractmethod
    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        """The quantity at the samples of a trajectory."""

    def filtered(
        self, low_pass: AbstractLowPass, model: ImpactOscillator, trajectory: Trajectory
    ) -> Samples:
        """The output at the samples of a low-pass with this quantity as its input. Its rate is
        computed from differences of its samples, as if it had no kinks between them.
        """
        values = self.value(model, trajectory)
        return low_pass.filtered(trajectory.ts, values, slopes(trajectory.ts, values))

    @abc.abstractmethod
    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        """The coordinate, reconstructed roughly from recorded values for a first look."""

    def contacts(self, values: Row) -> list[tuple[int, int]]:
        """Index pairs of the contacts that appear as pulses: first sample, and first one after."""
        del values
        return []

    def push(self, values: Row, oscillator: AbstractOscillator) -> Row | None:
        """Acceleration of the coordinate by the stops; `None` if the quantity shows more."""
        del values, oscillator

    def free_fall(self, ts: Row, values: Row, valid: Row) -> tuple[float, float] | None:
        """Begin and end [s] of a free fall and its landing, after the body was held."""
        del ts, values, valid

    __repr__ = with_numbers


class AbstractPlace(AbstractQuantity):
    """The coordinate itself."""

    derivative: ClassVar[int | None] = 0

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        del model
        return trajectory.position

    def filtered(
        self, low_pass: AbstractLowPass, model: ImpactOscillator, trajectory: Trajectory
    ) -> Samples:
        del model
        each = trajectory
        return low_pass.filtered(each.ts, each.position, each.velocity, each.jumps)

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        del ts, oscillator
        return values


class AbstractSpeed(AbstractQuantity):
    """The rate of the coordinate."""

    derivative: ClassVar[int | None] = 1
    density: ClassVar[int] = 4

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        del model
        return trajectory.velocity

    def filtered(
        self, low_pass: AbstractLowPass, model: ImpactOscillator, trajectory: Trajectory
    ) -> Samples:
        del model
        each = trajectory
        return low_pass.filtered_velocity(each.ts, each.position, each.velocity, each.jumps)

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        del oscillator
        return from_velocity(ts, values)


class AbstractPulsed(AbstractQuantity):
    """A quantity with a pulse at each contact: `factor` times the acceleration of the coordinate,
    and a rest without pulses.

    A low-pass filters the acceleration as the second derivative of the coordinate, which holds the
    whole impulse of a contact, however short. Before the first sample the motion was free, or at
    rest.
    """

    density: ClassVar[int] = 4

    @abc.abstractmethod
    def factor(self, model: ImpactOscillator) -> Float[Array, "..."]:
        """The ratio of its pulses to those of the acceleration."""

    def filtered(
        self, low_pass: AbstractLowPass, model: ImpactOscillator, trajectory: Trajectory
    ) -> Samples:
        ts, factor = trajectory.ts, self.factor(model)
        inner = acceleration(model, trajectory)
        free = free_acceleration(model, trajectory)
        flies = jnp.abs(free[0]) <= jnp.abs(inner[0])  # a contact at the first sample begins there
        before = (
            jnp.where(flies, free[0], inner[0]),
            jnp.where(flies, slopes(ts, free)[0], 0.0),
        )
        pulses = low_pass.filtered_acceleration(
            ts, trajectory.position, trajectory.velocity, before, trajectory.jumps
        )
        rest = self.value(model, trajectory) - factor * inner
        return factor * pulses + low_pass.filtered(ts, rest, slopes(ts, rest))


class AbstractAcceleration(AbstractPulsed):
    """The second derivative of the coordinate."""

    derivative: ClassVar[int | None] = 2

    def factor(self, model: ImpactOscillator) -> Float[Array, "..."]:
        del model
        return jnp.ones(())

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        return acceleration(model, trajectory)

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        if is_peaked(values):
            return from_pulses(ts, values, oscillator.weight())
        return from_swing(ts, values)

    def contacts(self, values: Row) -> list[tuple[int, int]]:
        return pulses(values) if is_peaked(values) else []
