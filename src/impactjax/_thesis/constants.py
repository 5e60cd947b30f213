"""Numbers that the thesis prints, in SI units and radians.

Source: R. E. Carter, Contact modeling for a nonlinear impact oscillator, M.S. thesis, University of
Florida, 2005.
"""

import math
from typing import NamedTuple

OMEGA_N = 13.47  # natural frequency of the pendulum [rad/s]
ZETA = 0.0017  # damping ratio in free flight [1]
LENGTH = 0.071  # effective length [m]
MASS = 0.020  # [kg]
RADIUS = 0.0127  # of the indenter [m]
GRAVITY = 9.80665  # [m/s²]
RELEASE = math.radians(45)  # angle at the beginning of the transients of chapter 3 [rad]

CUTOFF = 50.0  # of the anti-aliasing filter [Hz]
SAMPLING = 1000.0  # [Hz]
RECORD = 15.0  # duration of the records behind the spectra [s]

R = 0.577  # mean measured coefficient of restitution [1]
OMEGA0 = 727.5  # natural frequency during contact [rad/s]
GAMMA = 0.18  # damping ratio during contact [1]
CONTACT = 0.0044  # duration of a contact [s]
OMEGA_IMPACTING = 13.25  # "natural frequency" of the impacting pendulum [rad/s]

WALTON_K, WALTON_C = 1.0e4, 1000.0  # Figure 3.6, with λ = c/k = 0.1
HERTZ_E, HERTZ_C = 25.426e6, 23.0  # Figure 3.7 [Pa], [N s/m]
POISSON = 0.5  # of polyurethane, which the thesis does not print

SWEEP = (-0.0004963, 0.019409, -0.33884, -0.6252)
"""Coefficients of log10 A over the frequency in Hz, for the sweep of Figures 4.8 to 4.10."""


class Case(NamedTuple):
    """A forced motion of chapter 4.

    - `amplitude`, `omega`: motion of the base, A cos Ωt [m], [rad/s].
    - `rigid`: r0 and α of the restitution, r = r0 − α v [1], [s/m].
    - `soft`: ω0, r0 and α of the Kelvin-Voigt contact [rad/s], [1], [s/m].
    - `peak`: printed frequency of the largest line of the spectrum [Hz].
    """

    amplitude: float
    omega: float
    rigid: tuple[float, float]
    soft: tuple[float, float, float]
    peak: float


def restitution_of(gamma: float) -> float:
    """Coefficient of restitution of a Kelvin-Voigt contact, equation 3.21."""
    return math.exp(-math.pi * gamma / math.sqrt(1 - gamma**2))


def damping_of(r: float) -> float:
    """Damping ratio of a Kelvin-Voigt contact, equation 3.43 as it should be."""
    return -math.log(r) / math.sqrt(math.pi**2 + math.log(r) ** 2)


_LINEAR = {"rigid": (0.6, 0.05), "soft": (725.0, 0.65, 0.05)}

AT_4_HZ = Case(4.6e-3, 26.4, (0.6, 0.0), (723.0, restitution_of(0.14), 0.0), 4.2)
AT_8_HZ = Case(5.2e-3, 50.26, (0.6, 0.0), (725.0, restitution_of(0.165), 0.0), 4.0)
AT_15_HZ = Case(1.0e-3, 94.25, **_LINEAR, peak=3.7333)
AT_1_HZ = Case(3.32e-3, 6.28, **_LINEAR, peak=1.0)
AT_10_HZ = Case(3.1e-3, 62.8, **_LINEAR, peak=3.3333)
