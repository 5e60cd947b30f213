"""The independent simulator of `benchmarks/fuzz` against closed forms, the package beside it."""

import math

import numpy as np
import pytest
from benchmarks.fuzz import physics as ph
from benchmarks.fuzz import reference, simulator
from benchmarks.fuzz.campaign import campaign

from tiers import thorough

G = 9.81


def _run(kinds, values, times, direction=()):
    p, along = np.zeros(ph.SIZE), np.zeros(ph.SIZE)
    for place, value in values.items():
        p[place] = value
    for place in direction:
        along[place] = 1.0
    return reference.simulate(np.array(kinds), p, along, np.array(times))


@thorough
def test_ball_chatter_and_rest():
    r, fall = 0.5, math.sqrt(2 * 0.2 / G)
    run = _run(
        [ph.BALL, 0, 0, ph.RESTITUTION, ph.ABSENT, 0, 0],
        {ph.GRAVITY: G, ph.MASS: 1.0, ph.STOPS + 1: r, ph.POSITION: 0.2},
        [0.3, 2.0],
        [ph.STOPS + 1],
    )
    begin = run.rests["rests.begin"][0]
    assert begin.real == pytest.approx(fall * (1 + r) / (1 - r), rel=1e-12)
    assert begin.imag == pytest.approx(fall * 2 / (1 - r) ** 2, rel=1e-9)
    assert run.impacts["time"][1].real == pytest.approx(fall * (1 + 2 * r), rel=1e-12)
    since = 0.3 - fall
    assert run.position[0].real == pytest.approx(r * G * fall * since - G * since**2 / 2, rel=1e-11)
    assert run.position[0].imag == pytest.approx(G * fall * since, rel=1e-10)


def test_kelvin_voigt_contact_of_a_free_mass():
    omega, gamma, v, m = 300.0, 0.2, 0.7, 0.3
    run = _run(
        [ph.BALL, 0, 0, ph.KELVIN_VOIGT, ph.ABSENT, 0, 0],
        {ph.MASS: m, ph.STOPS + 1: omega, ph.STOPS + 2: gamma, ph.POSITION: 0.1, ph.VELOCITY: -v},
        [0.5],
        [ph.STOPS + 2],
    )
    root = math.sqrt(1 - gamma**2)
    log = run.impacts
    assert log["duration"][0].real == pytest.approx(math.pi / (omega * root), rel=1e-11)
    assert log["duration"][0].imag == pytest.approx(math.pi * gamma / (omega * root**3), rel=1e-9)
    assert log["restitution"][0].real == pytest.approx(math.exp(-math.pi * gamma / root), rel=1e-11)
    deepest = v / omega * math.exp(-gamma / root * math.acos(gamma))
    assert log["deepest_penetration"][0].real == pytest.approx(deepest, rel=1e-11)
    peak = m * v * omega * math.exp(-gamma / root * (3 * math.acos(gamma) - math.pi))
    assert log["peak_force"][0].real == pytest.approx(peak, rel=1e-9)


def test_dry_friction_turns_once_and_holds():
    omega, dry, x0 = 10.0, 20.0, 0.9  # each half-swing loses 2 dry/omega²
    run = _run(
        [ph.LINEAR, 0, 1, ph.ABSENT, ph.ABSENT, 0, 0],
        {ph.OMEGA: omega, ph.MASS: 1.0, ph.DRY: dry, ph.POSITION: x0},
        [math.pi / omega, 1.0],
        [ph.DRY],
    )
    assert run.position.real == pytest.approx([-x0 + 0.4, x0 - 0.8], rel=1e-11)
    assert run.position.imag == pytest.approx([2 / omega**2, -4 / omega**2], rel=1e-9)
    assert run.velocity[1] == 0


def test_rest_on_a_shaking_floor_ends_where_the_push_does():
    a, omega, phase = 0.02, 30.0, 3.0
    run = _run(
        [ph.BALL, 1, 0, ph.RESTITUTION, ph.ABSENT, 0, 0],
        {
            ph.GRAVITY: G,
            ph.MASS: 1.0,
            ph.AMPLITUDE: a,
            ph.FREQUENCY: omega,
            ph.PHASE: phase,
            ph.STOPS + 1: 0.3,
        },
        [0.2],
        [ph.GRAVITY],
    )
    ratio = G / (a * omega**2)
    release = (2 * math.pi + math.asin(ratio) - phase) / omega
    end = run.rests["rests.end"][0]
    assert end.real == pytest.approx(release, rel=1e-12)
    assert end.imag == pytest.approx(1 / (a * omega**3 * math.sqrt(1 - ratio**2)), rel=1e-9)
    assert run.code == simulator.FINE


def test_mass_turns_twice_within_a_tenth_of_a_millisecond():
    values = {
        ph.OMEGA: 12.27936760679801,
        ph.MASS: 1.0,
        ph.DRY: 1.3026006522697877,
        ph.AMPLITUDE: 0.4572586289969219,
        ph.FREQUENCY: 5.906116444253393,
        ph.PHASE: 2.658343268825823,
        ph.STOPS: 0.088110510954861,
        ph.STOPS + 1: 0.7024028678421368,
        ph.POSITION: 0.2391374884788217,
        ph.VELOCITY: 0.40624026538663965,
    }
    run = _run([ph.LINEAR, 1, 1, ph.RESTITUTION, ph.ABSENT, 0, 0], values, [1.63, 2.0])
    # Runge-Kutta's method of order four in steps of 1e-7 s: held from 1.62365 s, after turns at
    # 1.62349 s and there, until 1.65204 s
    assert run.velocity[0] == 0
    assert run.position.real == pytest.approx([-0.0245415, 0.1785825], abs=1e-6)


@thorough
def test_package_beside_the_reference():
    runs = campaign("linear, rigid, pressed", 6, 3, 1e-8, values_only=True)
    found = [verdict for _, verdict in runs]
    assert [verdict.wrong for verdict in found if verdict.kind == "wrong"] == []
    assert sum(verdict.kind == "right" for verdict in found) > 3
