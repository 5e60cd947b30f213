"""Recordings that are only planned."""

import jax.numpy as jnp
import numpy as np

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._parameter import as_parameter
from impactjax._record.impact_times import ImpactTimes
from impactjax._record.recording import Recording
from impactjax._refusal import whole
from impactjax._sensor.abstract_quantity import AbstractQuantity
from impactjax._simulate.simulate import simulate
from impactjax._simulate.simulation import Simulation
from impactjax._types import Numbers

_LONG = 1e6  # time within which all impacts happen that ever do [s]


def planned(ts: Numbers, quantity: AbstractQuantity) -> Recording:
    """A recording that is only planned: its values are zero, and count in `information` as if they
    were measured. `synthetic` gives it simulated values.

    **Arguments:**

    - `ts`: strictly increasing times of the samples [s].
    - `quantity`: quantity to record.

    **Raises** `ValueError` as `Recording` does.
    """
    times = as_parameter(ts)
    return Recording(times, jnp.zeros_like(times), quantity)


def planned_impacts(model: ImpactOscillator, initial: InitialState, count: int) -> ImpactTimes:
    """A list of impact times that is only planned: those of a simulated motion from its first
    impact, at time zero.

    The model and the initial state must be known numbers.

    **Arguments:**

    - `model`: the oscillator and its stops.
    - `initial`: the state just after the first impact.
    - `count`: number of impact times, with the first.

    **Raises** `ValueError` for fewer than two times, and if fewer impacts happen.
    """
    others = whole("count", count, 2) - 1
    usual = Simulation()
    most = max(others, usual.max_impacts)
    run = simulate(model, initial, [_LONG], t0=0.0, max_steps=usual.max_steps, max_impacts=most)
    times = np.asarray(run.impacts.time)[np.asarray(run.impacts.happened)][:others]
    if len(times) < others:
        raise ValueError(
            f"Only {len(times) + 1} impacts with flights between them happen, fewer than the "
            f"{count} that are planned."
        )
    return ImpactTimes(np.concatenate([[0.0], times]))
