"""Dry friction that nobody stated, in records with impacts made with SciPy."""

import numpy as np
import pytest

import impactjax as ij
from reference import simulate_rigid

OMEGA_N, ZETA, R = 13.47, 0.0017, 0.6
TIMES = np.linspace(0.0, 1.4, 701)
NOISE = np.radians(0.2)
STATED = {"length": 0.054, "mass": 1.0, "gain": 1.0}


def record(friction):
    def flow(t, y):
        rubbed = friction * np.sign(y[1])
        return np.array([y[1], -2 * ZETA * OMEGA_N * y[1] - OMEGA_N**2 * np.sin(y[0]) - rubbed])

    angles = simulate_rigid(flow, [np.pi / 4, 0.0], TIMES, lambda speed: R, max_step=5e-4).position
    noise = NOISE * np.random.default_rng(2).standard_normal(TIMES.size)
    return ij.Recording(TIMES, angles + noise, ij.Angle())


def compared(friction, said=STATED):
    begun: list[str] = []
    prepared = ij.prepare(record(friction), laws=["restitution"], fixed=said)
    return ij.compare(prepared, starts=ij.Starts(4), progress=begun.append), begun


def test_dry_friction_beside_impacts_is_found():
    comparison, _ = compared(1.0)
    estimate = comparison.best.estimate
    for name, truth in {"omega_n": OMEGA_N, "r": R, "dry_friction": 1.0}.items():
        own = estimate[name]
        assert own.verdict is ij.Verdict.IDENTIFIED
        assert abs(own.value - truth) < 3 * own.standard_error, name
    assert estimate["zeta"].low <= ZETA <= estimate["zeta"].high
    assert any("asks for `dry_friction`" in note for note in comparison.notes)


def test_record_without_friction_is_not_fitted_with_it():
    comparison, begun = compared(0.0)
    assert "dry_friction" not in comparison.best.estimate.names
    assert begun == ["restitution"]


@pytest.mark.parametrize("said", [{"dry_friction": 0.5}, {"dry_friction": None}])
def test_stated_friction_is_not_tried(said):
    prepared = ij.prepare(record(0.0), laws=["restitution"], fixed=said)
    assert prepared.may_rub == frozenset()
