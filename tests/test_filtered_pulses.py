"""Pulses behind a low-pass that are shorter than a sample, against integrals of closed forms."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate

import impactjax as ij
from impactjax._problem.build_problem import build_problem
from tiers import mostly_thorough

RATE, COUNT, HIT, SPEED, MASS = 200.0, 60, 0.1013, 2.0, 0.5
TS = np.arange(COUNT) / RATE
OMEGA, GAMMA, R = 800.0, 0.2, 0.6
CUTOFF = 60.0


def response(t: np.ndarray) -> np.ndarray:
    """Impulse response of a Butterworth filter of order 2 [1/s]."""
    w = 2 * math.pi * CUTOFF / math.sqrt(2)
    return np.where(t > 0, 2 * w * np.exp(-w * t) * np.sin(w * np.maximum(t, 0)), 0.0)


def pulse(t: float) -> float:
    """Acceleration in a contact with spring and dashpot, from the approach at t = 0."""
    damped = OMEGA * math.sqrt(1 - GAMMA**2)
    x = -SPEED / damped * math.exp(-GAMMA * OMEGA * t) * math.sin(damped * t)
    v = -SPEED * math.exp(-GAMMA * OMEGA * t) * math.cos(damped * t) - GAMMA * OMEGA * x
    return -2 * GAMMA * OMEGA * v - OMEGA**2 * x


def compliant() -> np.ndarray:
    """The filtered acceleration of the mass, by quadrature over the contact."""
    duration = math.pi / (OMEGA * math.sqrt(1 - GAMMA**2))
    return np.array(
        [
            integrate.quad(lambda s, t=t: response(t - HIT - s) * pulse(s), 0, end, limit=200)[0]
            if (end := min(max(t - HIT, 0.0), duration)) > 0
            else 0.0
            for t in TS
        ]
    )


def rigid() -> np.ndarray:
    """The filtered impulse of a rigid stop."""
    return (1 + R) * SPEED * response(TS - HIT)


def shown(
    law: ij.AbstractForceLaw | ij.AbstractImpactLaw,
    quantity: ij.AbstractQuantity,
    low_pass: ij.AbstractLowPass,
) -> np.ndarray:
    """The record of a free mass that hits a stop."""
    model = ij.ImpactOscillator(ij.FreeMass(mass=MASS), ij.Stop(law))
    start = ij.InitialState(SPEED * HIT, -SPEED)
    plan = ij.Experiment(model, ij.planned(TS, quantity), start, ij.Sensor(low_pass=low_pass))
    problem = build_problem(plan)
    return np.asarray(problem.residuals(problem.start))


def measured() -> ij.ImpulseResponse:
    """The same filter by its impulse response, finely sampled."""
    interval = 1e-4
    return ij.ImpulseResponse(jnp.asarray(response(np.arange(600) * interval)), interval)


CONTACT = ij.KelvinVoigt(OMEGA, GAMMA)
CASES = {  # the position has a kink at a rigid stop, which a cubic smooths
    "acceleration": (CONTACT, ij.Acceleration(), 1.0, compliant, 2e-3),
    "proper acceleration": (CONTACT, ij.ProperAcceleration(), 1.0, compliant, 2e-3),
    "contact force": (CONTACT, ij.ContactForce(), MASS, compliant, 2e-3),
    "rigid stop": (ij.Restitution(R), ij.Acceleration(), 1.0, rigid, 2e-2),
}


@pytest.mark.parametrize("case", mostly_thorough(CASES, "rigid stop"))
def test_record_of_a_pulse_that_is_shorter_than_a_sample(case):
    law, quantity, factor, reference, error = CASES[case]
    expected = factor * reference()
    found = shown(law, quantity, ij.Butterworth(CUTOFF))
    np.testing.assert_allclose(found, expected, atol=error * np.abs(expected).max())


def test_pulse_behind_a_measured_impulse_response():
    expected = MASS * compliant()
    found = shown(ij.KelvinVoigt(OMEGA, GAMMA), ij.ContactForce(), measured())
    np.testing.assert_allclose(found, expected, atol=5e-3 * np.abs(expected).max())


def test_contact_at_the_first_sample_has_no_past():
    """The mass flew freely before it touched the stop, and the force of a stop only pushes."""
    model = ij.ImpactOscillator(ij.FreeMass(mass=MASS), ij.Stop(CONTACT))
    start, sensor = ij.InitialState(0.0, -SPEED), ij.Sensor(low_pass=ij.Butterworth(CUTOFF))
    plan = ij.Experiment(model, ij.planned(TS, ij.ContactForce()), start, sensor)
    problem = build_problem(plan)
    duration = math.pi / (OMEGA * math.sqrt(1 - GAMMA**2))
    expected = [
        MASS * integrate.quad(lambda s, t=t: response(t - s) * pulse(s), 0, min(t, duration))[0]
        for t in TS
    ]
    found = np.asarray(problem.residuals(problem.start))
    np.testing.assert_allclose(found, expected, atol=2e-2 * np.max(expected))
