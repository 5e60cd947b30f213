"""Dry friction that nobody stated, in records with impacts made with SciPy."""

from pathlib import Path

import numpy as np
import pytest

import impactjax as ij
from reference import pendulum, simulate_rigid
from tiers import thorough

OMEGA_N, ZETA, R = 13.47, 0.0017, 0.6
TIMES = np.linspace(0.0, 1.4, 701)
NOISE = np.radians(0.2)


def record(friction, drift=0.0):
    flow = pendulum(OMEGA_N, ZETA, friction)
    angles = simulate_rigid(flow, [np.pi / 4, 0.0], TIMES, lambda speed: R, max_step=5e-4).position
    noise = NOISE * np.random.default_rng(2).standard_normal(TIMES.size)
    return ij.Recording(TIMES, angles + drift * TIMES + noise, ij.Angle())


def compared(recording):
    prepared = ij.prepare(recording, laws=["restitution"], fixed={"gain": 1.0})
    return ij.compare(prepared, starts=ij.Starts(4))


@thorough
def test_dry_friction_beside_impacts_is_found():
    comparison = compared(record(1.0))
    estimate = comparison.best.estimate
    for name, truth in {"omega_n": OMEGA_N, "r": R, "dry_friction": 1.0}.items():
        own = estimate[name]
        assert own.verdict is ij.Verdict.IDENTIFIED
        assert abs(own.value - truth) < 3 * own.standard_error, name
    assert estimate["zeta"].low <= ZETA <= estimate["zeta"].high
    assert any("asks for `dry_friction`" in note for note in comparison.notes)


@thorough
def test_friction_that_is_not_decided_is_given_beside_none(tmp_path):
    """The damping ratio then covers both models; so do a held-out part and the report."""
    prepared = ij.prepare(record(0.15), laws=["restitution"], fixed={"gain": 1.0})
    comparison = ij.compare(prepared, starts=ij.Starts(4), holdout=0.1)
    assert {fit.name for fit in comparison} == {"restitution", "restitution with dry friction"}
    assert any("dry friction is not decided" in note for note in comparison.notes)
    assert all(fit.prediction is not None for fit in comparison)
    whole = ij.across([fit.estimate for fit in comparison])
    best = comparison.best.estimate
    low = whole["zeta"].low if "zeta" in whole else best["zeta"].low
    assert low <= ZETA
    ij.io.write_report(tmp_path, comparison)
    assert "with dry friction" in (tmp_path / "report.html").read_text(encoding="utf-8")


@thorough
def test_drift_does_not_pass_for_friction():
    comparison = compared(record(0.0, drift=np.radians(0.5)))
    estimate = comparison.best.estimate
    assert "drift" in estimate.names
    assert "dry_friction" not in estimate.names


@pytest.mark.parametrize("said", [{"dry_friction": 0.5}, {"dry_friction": None}])
def test_stated_friction_is_not_tried(said):
    prepared = ij.prepare(record(0.0), laws=["restitution"], fixed=said)
    assert prepared.may_rub == frozenset()


def test_friction_that_a_sidecar_denies_is_not_tried():
    data = Path(__file__).parent.parent / "data" / "restitution.csv"
    assert ij.prepare(data, laws=["restitution"]).may_rub == frozenset()
