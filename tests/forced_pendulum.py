"""Records of a pendulum on a moving base that hits its stop, made with SciPy."""

import functools

import numpy as np

import impactjax as ij
from reference import simulate_compliant, simulate_rigid

OMEGA_N, ZETA, LENGTH = 13.47, 0.0017, 0.071
OMEGA0, GAMMA, R = 725.0, 0.165, 0.6
AMPLITUDE, FREQUENCY, PHASE = 5.2e-3, 16 * np.pi, 0.7
SETTLE, NOISE = 12.0, np.radians(0.2)  # [s] before the record, and [rad]
BASE = ij.HarmonicMotion(AMPLITUDE, FREQUENCY, PHASE)


def _flows():
    def free(t, y):
        push = AMPLITUDE * FREQUENCY**2 / LENGTH * np.sin(FREQUENCY * t + PHASE) * np.cos(y[0])
        return np.array([y[1], push - 2 * ZETA * OMEGA_N * y[1] - OMEGA_N**2 * np.sin(y[0])])

    def contact(t, y):
        push = OMEGA0**2 * y[0] + 2 * GAMMA * OMEGA0 * y[1]
        return free(t, y) - np.array([0.0, push])

    return free, contact


@functools.cache
def angles(compliant, duration, rate):
    """Sampled angles of the steady motion, from the time 0 of the phase."""
    free, contact = _flows()
    count = round(duration * rate) + 1
    ts = np.concatenate([[-SETTLE], np.arange(count) / rate])
    if compliant:
        run = simulate_compliant(free, contact, [1.0, 0.0], ts, 5e-3, 2e-4)
    else:
        run = simulate_rigid(free, [1.0, 0.0], ts, lambda speed: R, 5e-3)
    return ts[1:], run.position[1:]


def record(compliant=False, duration=2.0, rate=1000, seed=1):
    """A record with white noise."""
    ts, places = angles(compliant, duration, rate)
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(ts))
    return ij.Recording(ts, places + noise, ij.Angle())


def on_base(base=BASE):
    """The pendulum with values that a first look replaces."""
    return ij.Pendulum(10.0, 0.01, length=LENGTH, base=base)
