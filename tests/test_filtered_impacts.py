"""Motions with impacts behind a low-pass, against closed forms: the impact is between samples.

A free mass flies at constant speed, so that its place is a sum of ramps, its velocity one of steps,
its acceleration one of impulses. The response to each is a sum of exponentials, by SciPy's partial
fractions.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

import impactjax as ij

RATE, CUTOFF = 500.0, 290.0  # the cutoff is beyond half the sampling rate
R, SPEED = 0.6, 2.0
TS = np.arange(60) / RATE
QUANTITIES = (ij.Displacement(), ij.Velocity(), ij.Acceleration())
HITS = (0.0401, 0.041, 0.04199, 0.042)  # early, midway, late between two samples, and at one


def denominator(order: int) -> np.ndarray:
    """Coefficients of the filter's denominator; its numerator is the last of them."""
    angles = math.pi * (2 * np.arange(order) + order + 1) / (2 * order)
    return np.real(np.poly(2 * math.pi * CUTOFF * np.exp(1j * angles)))


def response(order: int, integrals: int, t: np.ndarray) -> np.ndarray:
    """The response of a Butterworth filter at times t to an impulse, integrated so many times; once
    differentiated for -1.
    """
    bottom = denominator(order)
    top = bottom[-1] * np.array([1.0, 0.0] if integrals < 0 else [1.0])
    integrated = np.append(bottom, np.zeros(max(integrals, 0)))
    residues, poles, _ = signal.residue(top, integrated, tol=1e-6)
    late, power = np.maximum(t, 0.0), 0
    total = np.zeros(len(t), complex)
    for number, (residue, pole) in enumerate(zip(residues, poles, strict=True)):
        again = number > 0 and abs(pole - poles[number - 1]) < 1e-6
        power = power + 1 if again else 0
        total += residue * late**power / math.factorial(power) * np.exp(pole * late)
    return np.where(t > 0, np.real(total), 0.0)


def bounce(low_pass: ij.AbstractLowPass, quantity: ij.AbstractQuantity, hit: float) -> np.ndarray:
    """The record of a free mass that hits a rigid stop at a time."""
    model = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.Restitution(R)))
    sensor = ij.Sensor(low_pass=low_pass)
    ts = sensor.sampled(jnp.asarray(TS), quantity)
    run = ij.simulate(model, ij.InitialState(SPEED * hit, -SPEED), ts)
    return np.asarray(sensor.shown(model, run, quantity))


def expected(order: int, derivative: int, hit: float) -> np.ndarray:
    """The filtered quantity: what comes in flies from minus infinity on."""
    bottom = denominator(order)
    delay = bottom[-2] / bottom[-1]
    before = (SPEED * (hit - TS + delay), np.full(len(TS), -SPEED), np.zeros(len(TS)))
    return before[derivative] + (1 + R) * SPEED * response(order, 2 - derivative, TS - hit)


@pytest.mark.parametrize("hit", HITS)
@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize("order", [2, 3])
def test_record_of_rigid_impact(order, derivative, hit):
    found = bounce(ij.Butterworth(CUTOFF, order=order), QUANTITIES[derivative], hit)
    known = expected(order, derivative, hit)
    scale = (2 * math.pi * CUTOFF) ** (derivative - 1)
    np.testing.assert_allclose(found, known, atol=1e-9 * scale)


@pytest.mark.parametrize("hit", HITS)
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_measured_impulse_response_of_rigid_impact(quantity, hit):
    """A filter of one pole by its impulse response, and by its pole."""
    pole, interval = 2 * math.pi * 40.0, 1e-4
    lags = np.arange(0, 0.06, interval)
    measured = ij.ImpulseResponse(jnp.asarray(pole * np.exp(-pole * lags)), interval)
    found = bounce(measured, quantity, hit)
    known = bounce(ij.Butterworth(40.0, order=1), quantity, hit)
    late = TS > 0.025  # the place before the first sample fades
    size = np.ptp(known)
    np.testing.assert_allclose(found[late], known[late], atol=2e-4 * size)


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_derivatives_of_filtered_impact(derivative):
    """Along the height of the start, against the derivative of the closed form by the time of the
    impact: one integral less.
    """
    low_pass, hit = ij.Butterworth(CUTOFF), 0.0401
    model = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.Restitution(R)))
    sensor, quantity = ij.Sensor(low_pass=low_pass), QUANTITIES[derivative]
    ts = sensor.sampled(jnp.asarray(TS), quantity)

    def shown(height):
        run = ij.simulate(model, ij.InitialState(height, -SPEED), ts)
        return sensor.shown(model, run, quantity)

    found = jax.jit(jax.jacfwd(shown))(SPEED * hit) * SPEED
    before = (SPEED, 0.0, 0.0)[derivative]
    known = before - (1 + R) * SPEED * response(2, 1 - derivative, TS - hit)
    scale = (2 * math.pi * CUTOFF) ** derivative
    np.testing.assert_allclose(found, known, atol=1e-9 * scale)
