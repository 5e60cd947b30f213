"""The first passage of a polynomial through zero, against numpy's roots and known ones."""

import math

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import impactjax as ij
from impactjax._series.crossing import first_crossing

DEGREE = 8
GOLDEN = (1 + math.sqrt(5)) / 2  # so that no interval ends exactly on a root


@jax.jit
def crossing(coefficients, settle):
    return first_crossing(list(coefficients), settle)


def look(polynomial: np.polynomial.Polynomial, settle=False) -> tuple[float, bool]:
    """Place of the first passage on [0, 1], and the flag for an unclear one."""
    coefficients = np.zeros(DEGREE + 1)
    coefficients[: len(polynomial.coef)] = polynomial.coef
    found = crossing(jnp.asarray(coefficients), jnp.asarray(settle))
    return float(found.fraction), bool(found.unclear)


def search(polynomial: np.polynomial.Polynomial) -> float:
    """The first passage on [0, 1] as a step finds it: a doubtful interval is made shorter."""
    start, h = 0.0, 1.0
    while start < 1:
        piece = polynomial(np.polynomial.Polynomial([start, h]))
        fraction, unclear = look(piece, settle=h < 1e-9)
        if unclear:
            h = h / GOLDEN
        elif fraction <= 1:
            return start + fraction * h
        else:
            start, h = start + h, 1 - start - h
    return math.inf


def first_fall(roots: list[float], sign: int) -> float:
    """First falling root in (0, 1] of a polynomial with simple roots and this sign at −∞."""
    inside = sorted(root for root in roots if 0 < root <= 1)
    sign = sign * (-1) ** sum(root <= 0 for root in roots)
    falling = inside[0 if sign > 0 else 1 :]
    return falling[0] if falling else math.inf


def apart(roots: list[float]) -> bool:
    marks = sorted([0.0, 1.0, *roots])
    return bool(np.min(np.diff(marks)) > 1e-3)


ROOTS = st.lists(st.floats(-1.0, 2.0), min_size=1, max_size=DEGREE).filter(apart)


@settings(max_examples=200, deadline=None)
@given(roots=ROOTS, sign=st.sampled_from([-1, 1]))
def test_first_crossing_of_known_roots(roots, sign):
    before = sign * (-1) ** len(roots)
    polynomial = before * np.polynomial.Polynomial.fromroots(roots)
    assume(polynomial(0.0) > 0)  # below zero is no side to start from
    expected = first_fall(roots, sign)
    assert search(polynomial) == pytest.approx(expected, abs=1e-9)


@settings(max_examples=200, deadline=None)
@given(
    thousandths=st.lists(st.integers(-1000, 1000), min_size=DEGREE, max_size=DEGREE),
    start=st.floats(1e-3, 1),
)
def test_first_crossing_agrees_with_numpy_roots(thousandths, start):
    polynomial = np.polynomial.Polynomial([start, *np.divide(thousandths, 1000)])
    roots = polynomial.roots() if np.any(polynomial.coef[1:]) else np.zeros(0)
    assume(np.all(np.abs(polynomial.deriv()(roots)) > 1e-4))  # no grazing: numpy is blind there
    real = [float(root.real) for root in roots if abs(root.imag) < 1e-12]
    assume(all(abs(root - 1) > 1e-6 for root in real))
    inside = sorted(root for root in real if 0 < root < 1)
    expected = inside[0] if inside else math.inf
    fraction, unclear = look(polynomial)
    if not unclear:
        assert fraction == pytest.approx(expected, abs=1e-8)
    assert search(polynomial) == pytest.approx(expected, abs=1e-8)


@settings(max_examples=100, deadline=None)
@given(middle=st.floats(0.05, 0.95), log_width=st.floats(-5, -1.5), far=st.floats(1.5, 5))
def test_two_crossings_in_one_step_are_detected(middle, log_width, far):
    """There and back within the interval: a look at its ends alone sees nothing."""
    half = 10**log_width / 2
    polynomial = np.polynomial.Polynomial.fromroots([middle - half, middle + half, far, -far]) * -1
    assert polynomial(0.0) > 0
    assert polynomial(1.0) > 0
    fraction, unclear = look(polynomial)
    assert unclear or fraction == pytest.approx(middle - half, abs=1e-7)
    assert search(polynomial) == pytest.approx(middle - half, abs=1e-5 * half + 1e-8)


@pytest.mark.parametrize(
    ("coefficients", "expected"),
    [
        ([0.0, 1.0], math.inf),  # leaves the surface
        ([0.0, 1.0, -4.0], 0.25),  # leaves it and comes back
        ([0.0, -1.0], 0.0),  # falls through it at once
        ([-1e-9, -1.0], 0.0),  # is through already and goes on
        ([-1e-9, 1.0], math.inf),  # is through and returns
        ([1.0, -1.0], math.inf),  # reaches it at the end: the next step falls through it at once
        ([1.0], math.inf),
        ([0.0], math.inf),  # lies on it
    ],
)
def test_first_crossing_from_surface(coefficients, expected):
    fraction, unclear = look(np.polynomial.Polynomial(coefficients))
    assert not unclear
    assert fraction == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("step", [ij.TaylorStep(), ij.RungeKutta(diffrax.Dopri8())])
def test_brief_penetration_within_a_step_is_an_impact(step):
    """x = cos 5 t just reaches a stop at -gap: the depth is 1 - gap, the time arccos(-gap) / 5."""
    omega, depths = 5.0, [-1e-12, 1e-12, 1e-9, 1e-6, 1e-3]

    @jax.jit
    def graze(gap):
        stop = ij.Stop(ij.Restitution(0.5), gap)
        model = ij.ImpactOscillator(ij.LinearOscillator(omega), stop)
        ts = jnp.array([0.0, 1.0])
        return ij.simulate(model, ij.InitialState(1.0), ts, step=step, tolerance=1e-13).impacts

    for depth in depths:
        log = graze(1 - depth)
        assert int(log.count) == int(depth > 0)
        if depth > 0:
            speed = omega * math.sqrt(depth * (2 - depth))
            assert float(log.time[0]) == pytest.approx(
                math.acos(-(1 - depth)) / omega, abs=1e-13 + 1e-14 / math.sqrt(depth)
            )
            assert float(log.approach_speed[0]) == pytest.approx(speed, rel=1e-3, abs=1e-6)
