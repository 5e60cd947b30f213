"""impactjax's own side of the comparison: public names only, nothing derived by hand."""

import os
from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import impactjax as ij
from contact_alone import ContactAlone
from impactjax._cli.compiler_flags import FAST
from rivals import reference, tasks
from rivals.prepared import Prepared, prepare

os.environ.setdefault("XLA_FLAGS", FAST)  # read before the first computation
jax.config.update("jax_enable_x64", True)

T = TypeVar("T")

STEP, TOLERANCE = ij.TaylorStep(order=12), 5e-8
STEPS, IMPACTS = 64, 32
RECORD_STEP, RECORD_TOLERANCE = ij.TaylorStep(order=18), 1.2e-9  # errors grow over many impacts
RECORD_STEPS, SWEEP_STEPS = 1024, 2560
TOGETHER, SWEEP_TOGETHER = 50, 20  # lanes: what they need together fits into the cache
HOW = f"TaylorStep, order {STEP.order}, tolerance {TOLERANCE:g}"
RECORD_HOW = f"TaylorStep, order {RECORD_STEP.order}, tolerance {RECORD_TOLERANCE:g}"
SWEEP_HOW = f"{RECORD_HOW}, lax.map of vmap over {SWEEP_TOGETHER}"
BATCH_HOW = f"{HOW}, lax.map of vmap over {TOGETHER}"


def model(law: str, values: Array, alone: Array | None = None) -> ij.ImpactOscillator:
    """The pendulum of the tasks; the contact acts alone, as they define it, of the pendulum with
    the values `alone`, if they are given.
    """
    omega_n, zeta, *rest = values
    if law == tasks.RESTITUTION:
        return ij.ImpactOscillator(ij.Pendulum(omega_n, zeta), ij.Stop(ij.Restitution(rest[0])))
    pendulum = ij.Pendulum(omega_n, zeta, length=1.0)
    contact = _contact(rest[1], rest[0], values if alone is None else alone)
    return ij.ImpactOscillator(pendulum, contact)


def _contact(omega0: Array, gamma: Array, alone: Array) -> ij.Stop:
    omega_n, zeta, *_ = alone
    return ij.Stop(ContactAlone(omega0, gamma, omega_n**2, 2 * zeta * omega_n))


def angles(law: str, values: Array) -> Array:
    """The samples of T1."""
    start = ij.InitialState(values[-1])
    times = jnp.asarray(tasks.TIMES)
    return ij.simulate(
        model(law, values),
        start,
        times,
        step=STEP,
        tolerance=TOLERANCE,
        max_steps=STEPS,
        max_impacts=IMPACTS,
    ).position


def _ready(function: Callable[..., Array], *arguments: np.ndarray) -> Callable[[], np.ndarray]:
    compiled = jax.jit(function)
    arrays = [jnp.asarray(argument) for argument in arguments]
    return lambda: np.asarray(compiled(*arrays))


def together(function: Callable[[str, Array], T], law: str) -> Callable[[Array], T]:
    """A function of many parameter sets, in portions that fit into the cache."""
    return lambda lanes: jax.lax.map(lambda p: function(law, p), lanes, batch_size=TOGETHER)


def t1(law: str) -> Prepared:
    """One trajectory: (1401,)."""
    values = tasks.parameters(law)
    return prepare(lambda: _ready(lambda p: angles(law, p), values), HOW)


def t2(law: str) -> Prepared:
    """A thousand trajectories: (1000, 1401)."""
    values = tasks.drawn_parameters(law)
    return prepare(lambda: _ready(together(angles, law), values), BATCH_HOW, tasks.LANES)


def derivatives(law: str, values: Array) -> Array:
    """The derivatives of T3."""
    return jax.jacfwd(lambda p: angles(law, p))(values).T


def t3(law: str) -> Prepared:
    """Derivatives of one trajectory: (parameters, 1401)."""
    values = tasks.parameters(law)
    return prepare(lambda: _ready(lambda p: derivatives(law, p), values), f"jacfwd, {HOW}")


def t3_batch(law: str) -> Prepared:
    """Derivatives of a thousand trajectories: (1000, parameters, 1401)."""
    values = tasks.drawn_parameters(law)
    how = f"jacfwd, {BATCH_HOW}"
    return prepare(lambda: _ready(together(derivatives, law), values), how, tasks.LANES)


def _driven(law: str, ratio: Array, frequency: Array, times: Array, steps: int) -> Array:
    values = jnp.asarray(tasks.parameters(law))
    omega_n, zeta, gamma, omega0, theta0 = values
    pendulum = ij.Pendulum(omega_n, zeta, length=1.0, base=ij.HarmonicMotion(ratio, frequency))
    return ij.simulate(
        ij.ImpactOscillator(pendulum, _contact(omega0, gamma, values)),
        ij.InitialState(theta0),
        times,
        t0=0.0,
        step=RECORD_STEP,
        tolerance=RECORD_TOLERANCE,
        max_steps=steps,
        max_impacts=steps // 4,
    ).position


def t4(law: str) -> Prepared:
    """The forced record: (22001,)."""
    ratio, frequency = tasks.RECORD_FORCING

    def record(ratio: Array, frequency: Array, times: Array) -> Array:
        return _driven(law, ratio, frequency, times, RECORD_STEPS)

    arguments = np.asarray(ratio), np.asarray(frequency), tasks.RECORD_TIMES
    return prepare(lambda: _ready(record, *arguments), RECORD_HOW)


def t4_sweep(law: str) -> Prepared:
    """The sweep of forcing frequencies: (200, 50)."""
    forcings = [tasks.sweep_forcing(hertz) for hertz in tasks.SWEEP_FREQUENCIES]
    times = np.array([tasks.sweep_times(forcing) for forcing in forcings])
    ratios, frequencies = np.array(forcings).T

    def sweep(ratios: Array, frequencies: Array, times: Array) -> Array:
        def one(each: tuple[Array, Array, Array]) -> Array:
            return _driven(law, *each, SWEEP_STEPS)

        return jax.lax.map(one, (ratios, frequencies, times), batch_size=SWEEP_TOGETHER)

    return prepare(lambda: _ready(sweep, ratios, frequencies, times), SWEEP_HOW, len(forcings))


def t5(law: str) -> Prepared:
    """The fit: the estimate, in the order of `tasks.NAMES` without the start angle."""
    record, alone = reference.record(law), jnp.asarray(tasks.parameters(law))

    def estimate(start: Array, values: Array) -> Array:
        recording = ij.Recording(jnp.asarray(tasks.TIMES), values, ij.Angle())
        guess = jnp.append(start, tasks.VALUES["theta0"])
        fitted = ij.fit(
            ij.Experiment(
                model(law, guess, alone),
                recording,
                ij.InitialState(tasks.VALUES["theta0"]),
                fixed=("theta0", "theta_dot0"),
                simulation=ij.Simulation(TOLERANCE, STEPS, IMPACTS, STEP),
            ),
            optimiser=ij.LevenbergMarquardt(horizons=(1.0,)),
        )
        return jnp.stack([fitted.value(name) for name in tasks.NAMES[law][:-1]])

    return prepare(lambda: _ready(estimate, tasks.FIT_START[law], record), f"fit, {HOW}")
