"""Measurements of contacts beside a record: speeds, durations, penetrations, forces."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._identify.directions import Sensitivities
from impactjax._known import known
from impactjax._model.equivalents import ClosedForm
from impactjax._model.law import AbstractForceLaw, AbstractImpactLaw
from impactjax._optimise.linearisation import Vector
from impactjax._problem.padding import padded_size
from impactjax._problem.problem import Problem
from impactjax._refusal import check_number
from impactjax._simulate.single_impact import single_impact


class Accuracy(NamedTuple):
    """Standard deviations of what is measured of a contact.

    - `speed`: of the speed after an impact [m/s].
    - `duration`: of the duration of a contact [s].
    - `penetration`: of the deepest penetration of a contact [m].
    - `force`: of the largest force of a contact [N].
    """

    speed: float = 1e-3
    duration: float = 1e-4
    penetration: float = 1e-5
    force: float = 0.1

    def check(self) -> None:
        """Raises `ValueError` unless all are positive."""
        for name, size in self._asdict().items():
            check_number(name, size)
            if not size > 0:
                raise ValueError(f"The accuracy of a {name} must be positive, and is {size}.")


def contact_rows(
    problem: Problem, values: Vector, speeds: Float[np.ndarray, " impacts"], accuracy: Accuracy
) -> dict[str, Sensitivities]:
    """Derivatives of the measurements of impacts at some speeds, divided by their noise; zero for
    an impact that cannot be simulated, which tells nothing.
    """
    count = padded_size(len(speeds))  # so that motions share a program
    padded = jnp.asarray(np.resize(speeds, count))
    found = known(_slopes(problem, jnp.asarray(values), padded))
    sizes = accuracy._asdict()
    told = {name: rows[: len(speeds)] / sizes[name] for name, rows in found.items()}
    return {name: np.where(np.isfinite(rows), rows, 0.0) for name, rows in told.items()}


def beyond_integration(rows: Sensitivities, values: Vector) -> Sensitivities:
    """Derivatives without parameters and directions by which the data change no more than an
    integration errs, compared with the largest change. Left as they are, they would enlarge the
    bounds of what is determined.
    """
    rows, values = np.asarray(rows), np.asarray(values)
    errs = 1e-6 if rows.dtype == np.float64 else 1e-3  # 100 times the usual tolerance
    units = np.where(values != 0, np.abs(values), 1.0)
    lengths = np.linalg.norm(rows * units, axis=0)
    scaled = np.where(lengths > errs * lengths.max(initial=0.0), rows * units, 0.0)
    left, sizes, right = np.linalg.svd(scaled, full_matrices=False)
    told = np.where(sizes > errs * sizes.max(initial=0.0), sizes, 0.0)
    return (left * told) @ right / units


@eqx.filter_jit
def _slopes(
    problem: Problem, values: Vector, speeds: Float[Array, " impacts"]
) -> dict[str, Sensitivities]:
    """Derivatives of the outcomes of impacts at some speeds, by all parameters."""

    def outcomes(values: Vector) -> dict[str, Float[Array, " impacts"]]:
        system = problem.system_with(values)
        assert system.model.lower is not None
        law, mass = system.model.lower.law, system.model.oscillator.mass
        if isinstance(law, AbstractImpactLaw):
            return {"speed": speeds * law.restitution(speeds)}
        assert isinstance(law, AbstractForceLaw)
        closed = isinstance(law, ClosedForm)
        found = law.equivalents(speeds, mass) if closed else single_impact(law, speeds, mass)
        return {
            "speed": speeds * found.restitution,
            "duration": found.duration,
            "penetration": found.deepest_penetration,
            "force": found.peak_force,
        }

    return jax.jacfwd(outcomes)(values)
