"""Fits of a recording in segments, each with its own start."""

import dataclasses

import numpy as np
import pytest

import impactjax as ij
from forced_pendulum import GAMMA, LENGTH, OMEGA0, OMEGA_N, PHASE, on_base, record
from tiers import quick

STATED = {"length": LENGTH, "gain": 1.0, "offset": 0.0, "drift": 0.0}


def experiment(recording, **said):
    free = said.pop("free", ["phase"])
    prepared = ij.prepare(
        recording,
        oscillator=on_base(),
        laws=["kelvin-voigt"],
        sensor=ij.Sensor(),
        fixed=STATED,
        free=free,
    )
    return dataclasses.replace(prepared.experiments["kelvin-voigt"], **said)


def test_segments_tell_as_much_as_the_whole_of_a_steady_motion():
    own = experiment(record(True))
    whole, parts = ij.fit(own), ij.fit_in_segments(own, 4)
    assert bool(parts.converged)
    for name, truth in {
        "omega_n": OMEGA_N,
        "phase": PHASE,
        "gamma": GAMMA,
        "omega0": OMEGA0,
    }.items():
        assert abs(parts[name].value - truth) < 3.5 * parts[name].standard_error, name
        assert parts[name].standard_error < 1.6 * whole[name].standard_error, name
    states = [name for name in parts.names if "[" in name]
    assert states == [f"{name}[{i}]" for i in range(4) for name in ("theta0", "theta_dot0")]
    assert int(np.asarray(parts.problem.observations)) == int(
        np.asarray(whole.problem.observations)
    )
    third = ij.of_experiment(parts, 2)
    assert third["gamma"].value == parts["gamma"].value
    assert third.rms < 1.2 * np.radians(0.2)


@quick
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda own: (own, 1), "at least 2"),
        (lambda own: (own, 200), "too short"),
        (lambda own: (dataclasses.replace(own, scatter=ij.NormalScatter()), 4), "no scatter"),
    ],
)
def test_refusals_of_segments(change, said):
    with pytest.raises(ValueError, match=said):
        ij.fit_in_segments(*change(experiment(record(True))))


@quick
def test_segments_need_a_recorded_place():
    bounces = ij.ImpactTimes(np.cumsum(0.6 * 0.9 ** np.arange(12)))
    (own,) = ij.prepare(bounces, laws=["restitution"]).experiments.values()
    with pytest.raises(ValueError, match="position or angle"):
        ij.fit_in_segments(own, 2)
