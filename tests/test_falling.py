"""Masses that fall with one acceleration, and oscillators that do not, by SciPy."""

import numpy as np
import pytest

import impactjax as ij
from reference import ball, simulate_rigid
from tiers import quick

pytestmark = quick


def noisy(values, size):
    return values + size * np.random.default_rng(0).standard_normal(len(values))


@pytest.mark.parametrize("slope", [2.5, 4.0])
def test_mass_on_an_incline_falls_with_a_fitted_acceleration(slope):
    ts = np.arange(1400) / 500
    falls = simulate_rigid(ball(slope), [0.3, 0.0], ts, lambda v: 0.8)
    records = [
        ij.Recording(ts, noisy(falls.position, 1e-3), ij.Displacement()),
        ij.Recording(ts, noisy(falls.velocity, 1e-2), ij.Velocity()),
    ]
    for record in records:
        prepared = ij.prepare(record, laws=["restitution"])
        assert "gravity" in prepared.experiment.free
        assert prepared.experiment.model.oscillator.weight() == pytest.approx(slope, rel=0.02)
        assert any("the mass is on an incline" in note for note in prepared.notes)
        stated = ij.prepare(record, laws=["restitution"], oscillator=ij.LinearOscillator(3.0))
        assert stated.experiment.model.oscillator.weight() is None


@pytest.mark.parametrize("equilibrium", [0.0, 0.05, -0.05, -1.5])
def test_oscillator_that_bounces_is_no_falling_mass(equilibrium):
    """Its equilibrium is at the stop, or off it. Far beyond it, all flights have 38 m/s², too much
    for an incline.
    """
    ts = np.arange(500 if equilibrium < -1 else 1400) / 500

    def flow(t, y):
        return np.array([y[1], -25.0 * (y[0] - equilibrium)])

    found = simulate_rigid(flow, [0.2, 0.0], ts, lambda v: 0.9)
    prepared = ij.prepare(
        ij.Recording(ts, noisy(found.position, 1e-3), ij.Displacement()), laws=["restitution"]
    )
    assert prepared.experiment.model.oscillator.weight() is None
