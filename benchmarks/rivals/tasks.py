"""The tasks that are compared: constants, parameter draws, sample times, forcing, noisy records.

Free flight of the pendulum:  θ̈ = −2 ζ ωn θ̇ − ωn² sin θ + f
Kelvin-Voigt contact:         θ̈ = −2 γ ω0 θ̇ − ω0² θ + f
with f = (A/L) Ω² sin(Ωt) cos θ in task T4 and f = 0 elsewhere. The stop is at θ = 0, the free side
θ > 0; contact ends when θ is back at 0. Restitution replaces contact by θ̇⁺ = −r θ̇⁻. Gravity and
flight damping do not act in contact. Every trajectory starts at rest.
"""

from typing import NamedTuple

import numpy as np

RESTITUTION = "restitution"
KELVIN_VOIGT = "kelvin-voigt"
LAWS = (RESTITUTION, KELVIN_VOIGT)

NAMES = {
    RESTITUTION: ("omega_n", "zeta", "r", "theta0"),
    KELVIN_VOIGT: ("omega_n", "zeta", "gamma", "omega0", "theta0"),
}
VALUES = {
    "omega_n": 13.47,
    "zeta": 0.0017,
    "r": 0.577,
    "gamma": 0.18,
    "omega0": 727.5,
    "theta0": np.pi / 4,
}
DRAWN = ("omega_n", "r", "gamma", "omega0")
LANES = 1000

RATE = 1000.0
DURATION = 1.4
TIMES = np.arange(1401) / RATE

NOISE = np.deg2rad(0.2)
FIT_START = {
    RESTITUTION: np.array([13.0, 0.003, 0.55]),
    KELVIN_VOIGT: np.array([13.0, 0.003, 0.15, 700.0]),
}

RECORD_DURATION = 22.0
RECORD_TIMES = np.arange(22001) / RATE
SWEEP_FREQUENCIES = np.linspace(3.0, 15.0, 200)
SWEEP_PERIODS = 150
SWEEP_KEPT = 50
LENGTH = 0.071


class Forcing(NamedTuple):
    """A harmonic motion of the base: `ratio` is A/L [-], `frequency` is Ω [rad/s]."""

    ratio: float
    frequency: float


NO_FORCING = Forcing(0.0, 1.0)
RECORD_FORCING = Forcing(0.0046 / LENGTH, 26.4)


def parameters(law: str) -> np.ndarray:
    """The nominal parameters of a law, in the order of `NAMES`."""
    return np.array([VALUES[name] for name in NAMES[law]])


def drawn_parameters(law: str, lanes: int = LANES) -> np.ndarray:
    """The first `lanes` of the 1000 parameter vectors of T2, each a row in the order of `NAMES`."""
    rows = np.tile(parameters(law), (LANES, 1))
    columns = [i for i, name in enumerate(NAMES[law]) if name in DRAWN]
    factors = np.random.default_rng(0).uniform(0.9, 1.1, (LANES, len(columns)))
    rows[:, columns] *= factors
    return rows[:lanes]


def sweep_forcing(hertz: float) -> Forcing:
    """The forcing of the sweep at one frequency [Hz]; its amplitude falls with the frequency."""
    log_amplitude = -0.0004963 * hertz**3 + 0.019409 * hertz**2 - 0.33884 * hertz - 0.6252
    return Forcing(10.0**log_amplitude / LENGTH, 2 * np.pi * hertz)


def sweep_times(forcing: Forcing) -> np.ndarray:
    """The times of the Poincaré samples: the starts of the last `SWEEP_KEPT` periods."""
    periods = np.arange(SWEEP_PERIODS - SWEEP_KEPT + 1, SWEEP_PERIODS + 1)
    return periods * (2 * np.pi / forcing.frequency)


def noise() -> np.ndarray:
    """The noise of the record that T5 fits [rad]."""
    return np.random.default_rng(1).normal(0.0, NOISE, TIMES.size)


def with_start_angle(fitted: np.ndarray) -> np.ndarray:
    """The full parameter vector for the fitted ones: T5 knows the start angle."""
    return np.append(fitted, VALUES["theta0"])
