"""heyoka: Taylor integration compiled at run time. One core throughout."""

import numpy as np
from scipy.optimize import least_squares

from . import heyoka_systems, reference, tasks
from .heyoka_systems import BATCH, EXACT
from .prepared import Prepared, Run, prepare


def _lanes(count: int) -> list[slice]:
    """Slices of `BATCH` lanes that cover all."""
    return [slice(i, i + BATCH) for i in range(0, count, BATCH)]


def t1(law: str) -> Prepared:
    """One trajectory."""

    def build() -> Run:
        simulate, values = heyoka_systems.single(law), tasks.parameters(law)
        return lambda: simulate(values)

    return prepare(build, "scalar, tol 1e-8")


def t2(law: str) -> Prepared:
    """A thousand trajectories."""

    def build() -> Run:
        simulate, values = heyoka_systems.batch(law), tasks.drawn_parameters(law)
        out = np.empty((tasks.LANES, tasks.TIMES.size))

        def run() -> np.ndarray:
            for lanes in _lanes(tasks.LANES):
                out[lanes] = simulate(values[lanes].T)
            return out

        return run

    return prepare(build, f"batch {BATCH}, tol 1e-8", tasks.LANES)


def exact(law: str) -> np.ndarray:
    """The samples of T2 at a tolerance of one rounding error."""
    simulate = heyoka_systems.single(law, EXACT)
    return np.array([simulate(values) for values in tasks.drawn_parameters(law)])


def t3(law: str) -> Prepared:
    """Derivatives of one trajectory."""

    def build() -> Run:
        simulate, values = heyoka_systems.tangent(law), tasks.parameters(law)
        return lambda: simulate(values)[1:]

    return prepare(build, "variational equations, saltation by hand, tol 1e-8")


def t3_batch(law: str) -> Prepared:
    """Derivatives of a thousand trajectories."""

    def build() -> Run:
        simulate, values = heyoka_systems.tangent_batch(law), tasks.drawn_parameters(law)
        out = np.empty((tasks.LANES, values.shape[1], tasks.TIMES.size))

        def run() -> np.ndarray:
            for lanes in _lanes(tasks.LANES):
                out[lanes] = simulate(values[lanes].T)
            return out

        return run

    how = f"variational equations, saltation by hand, batch {BATCH}, tol 1e-8"
    return prepare(build, how, tasks.LANES)


def t4(_law: str) -> Prepared:
    """The forced record."""

    def build() -> Run:
        simulate = heyoka_systems.driven()
        return lambda: simulate(tasks.RECORD_FORCING, tasks.RECORD_TIMES)

    return prepare(build, "scalar, tol 1e-8")


def t4_sweep(_law: str) -> Prepared:
    """The sweep of forcing frequencies."""
    forcings = [tasks.sweep_forcing(hertz) for hertz in tasks.SWEEP_FREQUENCIES]
    times = np.array([tasks.sweep_times(forcing) for forcing in forcings])

    def build() -> Run:
        simulate = heyoka_systems.driven_batch()

        def run() -> np.ndarray:
            lanes = _lanes(len(forcings))
            return np.concatenate([simulate(forcings[part], times[part]) for part in lanes])

        return run

    return prepare(build, f"batch {BATCH}, tol 1e-8", len(forcings))


def exact_sweep() -> tuple[np.ndarray, np.ndarray]:
    """The samples of the sweep, and at which frequencies two tight tolerances agree on them.

    Elsewhere the motion is chaotic or grazes, and no two integrators can agree.
    """
    forcings = [tasks.sweep_forcing(hertz) for hertz in tasks.SWEEP_FREQUENCIES]
    tight, tighter = (
        np.array([simulate(forcing, tasks.sweep_times(forcing)) for forcing in forcings])
        for simulate in (heyoka_systems.driven(1e-10), heyoka_systems.driven(EXACT))
    )
    return tighter, np.max(np.abs(tight - tighter), axis=1) < 1e-11


def t5(law: str) -> Prepared:
    """The fit: Levenberg-Marquardt with the variational Jacobian."""

    def build() -> Run:
        simulate, record = heyoka_systems.tangent(law), reference.record(law)
        last: dict[bytes, np.ndarray] = {}

        def rows(fitted: np.ndarray) -> np.ndarray:
            """The simulation at these parameters: residual and Jacobian come from the same one."""
            key = fitted.tobytes()
            if key not in last:
                last.clear()
                last[key] = simulate(tasks.with_start_angle(fitted))
            return last[key]

        def run() -> np.ndarray:
            last.clear()
            return least_squares(
                lambda fitted: rows(fitted)[0] - record,
                tasks.FIT_START[law],
                jac=lambda fitted: rows(fitted)[1:-1].T,  # pyright: ignore[reportArgumentType]
                method="lm",
                x_scale=tasks.FIT_START[law],
            ).x

        return run

    return prepare(build, "least_squares lm, variational Jacobian, tol 1e-8")
