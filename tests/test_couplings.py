"""Measurements of a contact and the law's parameters, against theory and closed forms."""

import math

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest

import impactjax as ij
from laws import LAWS
from tiers import mostly_thorough

TS = jnp.arange(701) / 1000
START = ij.InitialState(0.78)
LENGTH, MASS = 0.071, 0.02
WITH_FORCE = ["record, durations", "record, penetrations", "record, forces"]


def pendulum(law) -> ij.ImpactOscillator:
    oscillator = ij.Pendulum(omega_n=13.0, zeta=0.02, length=LENGTH, mass=MASS)
    return ij.ImpactOscillator(oscillator, ij.Stop(law))


def dimensionless(exponent: float) -> np.ndarray:
    """The direction in which stiffness and damping leave restitution as it is, in logarithms."""
    return np.array([1.0, exponent]) / math.hypot(1.0, exponent)


SURVIVES = {"walton": 1.0, "hertz-dashpot": 0.4}
"""Exponent e of c/k^e: restitution depends on c v/k, and on c/(k^2 m^3 v)^(1/5)."""


@pytest.mark.parametrize("name", mostly_thorough(SURVIVES, "walton"))
def test_rebound_speeds_tell_one_combination_and_more_measurements_both(name):
    found = ij.couplings(pendulum(LAWS[name].law), START, TS)
    assert found.names == ("k", "c")
    assert list(found.measurements) == [
        *("rebound speeds", "record", *WITH_FORCE, "record from two starts")
    ]
    # Along the null direction d(log c) = e d(log k).
    null = np.asarray(found.measurements["rebound speeds"].directions.exponents[1])
    expected = dimensionless(SURVIVES[name])
    assert math.degrees(math.acos(min(abs(float(null @ expected)), 1.0))) < 0.1
    assert np.all(found.bounds["rebound speeds"] > 1e6)
    assert np.isfinite(found.bounds["record"]).all()
    for better in [*WITH_FORCE, "record from two starts"]:
        assert np.all(found.bounds[better] < found.bounds["record"])


def test_rigid_law_has_neither_durations_nor_forces():
    found = ij.couplings(pendulum(ij.Restitution(0.6)), START, TS)
    assert list(found.measurements) == ["rebound speeds", "record", "record from two starts"]
    told = found.measurements["rebound speeds"]
    speeds = np.linalg.norm(np.asarray(told.sensitivities)) * 1e-3 / 0.6
    known = 1e-3 / (0.6 * speeds)
    np.testing.assert_allclose(found.bounds["rebound speeds"], [known], rtol=1e-9)
    lines = str(found).splitlines()
    assert lines[0] == "Restitution"
    assert lines[1].startswith("rebound speeds          Determined: r to ")


def test_forcing_and_figure():
    forced = ij.HarmonicMotion(0.01, 2 * math.pi * 4.2)
    found = ij.couplings(pendulum(ij.Restitution(0.6)), START, TS, forced=forced)
    assert found.bounds["record with forcing"] < found.bounds["record"]
    assert found.names == ("r",)
    two = found.measurements["record from two starts"]
    assert {"omega_n", "zeta", "theta0[0]", "theta0[1]"} <= {*two.names}
    ax = ij.plot.couplings(plt.figure().subplots(), found)
    assert [label.get_text() for label in ax.get_yticklabels()] == list(found.measurements)


def test_refused_motions():
    ball = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.6)))
    with pytest.raises(ValueError, match="no lower stop"):
        ij.couplings(ij.ImpactOscillator(ij.BouncingBall()), START, TS)
    with pytest.raises(ValueError, match="no complete impact"):
        ij.couplings(ball, ij.InitialState(100.0), TS)
    forced = ij.HarmonicMotion(0.01, 20.0)
    thrown = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.Restitution(0.6)))
    with pytest.raises(ValueError, match="cannot move"):
        ij.couplings(thrown, ij.InitialState(0.1, -1.0), TS, forced=forced)
