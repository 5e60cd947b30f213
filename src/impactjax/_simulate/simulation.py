"""Settings of the simulations in a fit."""

import equinox as eqx

from impactjax._shown import with_numbers
from impactjax._simulate.step import AbstractStep


class Simulation(eqx.Module):
    """Settings with which a fit simulates.

    **Arguments:**

    - `tolerance`, `max_steps`, `max_impacts`, `step`: as for `simulate`.
    """

    tolerance: float | None = eqx.field(default=None, static=True)
    max_steps: int = eqx.field(default=512, static=True)
    max_impacts: int = eqx.field(default=64, static=True)
    step: AbstractStep | None = None

    __repr__ = with_numbers
