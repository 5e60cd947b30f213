"""Closed forms of single impacts against mpmath, their derivatives and their inverses."""

import math

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

import impactjax as ij
from impactjax._model.lambert import z_over_s
from impactjax._model.linear_contact import arc_ratio
from impactjax._model.separable import restitution_damping, separable_restitution
from tiers import mostly_thorough, thorough

MASS = 0.02
SPEEDS = np.array([0.05, 0.73, 3.0])
FIELDS = ("restitution", "duration", "deepest_penetration", "peak_force", "energy_lost")
W, K = 727.5, 1e6


def test_out_of_range_restitution_has_no_equivalents():
    found = ij.KelvinVoigtLinearRestitution(W, 0.6, 1.0).equivalents(np.array([0.1, 0.7]), MASS)
    for field in FIELDS:
        assert np.isfinite(getattr(found, field)[0])
        assert np.isnan(getattr(found, field)[1])


def walton_restitution(z):
    """The root of Z − ln(1 + Z) = −r Z − ln(1 − r Z), an mpmath number."""
    with mpmath.workdps(40):
        z = mpmath.mpf(z)
        w = mpmath.lambertw(-mpmath.exp(-1 - z + mpmath.log1p(z)), 0)
        return (1 + mpmath.re(w)) / z


def test_restitution_against_reference_values():
    known = {
        0.01: 0.9933774543988525,
        0.1: 0.9374755799498943,
        0.5: 0.7484349315974339,
        1: 0.5936242600400401,
        2: 0.4107196860610394,
        5: 0.19698024528051888,
        10: 0.09998162475294389,
    }
    k, speed = 1e4, 0.7
    for z, r in known.items():
        for law in (ij.Walton(k, k * z / speed), ij.Simon(k, z / speed)):
            found = float(law.equivalents(speed, MASS).restitution)
            assert abs(found / r - 1) < 1e-12


@thorough
def test_restitution_and_derivative_to_rounding():
    zs = np.concatenate([np.logspace(-10, 2, 49), [300.0]])
    found = jax.vmap(separable_restitution)(jnp.asarray(zs))
    np.testing.assert_allclose(found, [float(walton_restitution(z)) for z in zs], rtol=1e-14)
    r = np.asarray(found)
    slopes = jax.vmap(jax.grad(separable_restitution))(zs)
    q = (1 - r) / zs
    expected = -(1 + r) * (r - q) / (r * (1 + zs))
    large = zs > 1e-3
    np.testing.assert_allclose(slopes[large], expected[large], rtol=1e-11)
    np.testing.assert_allclose(slopes[~large], -2 / 3 + 8 / 9 * zs[~large], atol=1e-5)
    at_zero = [float(separable_restitution(jnp.zeros(())))]
    function = separable_restitution
    for _ in range(2):
        function = jax.grad(function)
        at_zero.append(float(function(jnp.zeros(()))))
    np.testing.assert_allclose(at_zero, [1, -2 / 3, 8 / 9], rtol=1e-14)


def test_lambert_function_on_both_branches():
    s = np.concatenate([-np.logspace(-9, 1, 21), np.logspace(-9, 1, 21)])
    with mpmath.workdps(60):
        z = [
            -1 - mpmath.re(mpmath.lambertw(-mpmath.exp(-1 - mpmath.mpf(x) ** 2 / 2), branch))
            for x, branch in zip(s, [0] * 21 + [-1] * 21, strict=True)
        ]
        expected = [float(y / mpmath.mpf(x)) for x, y in zip(s, z, strict=True)]
    np.testing.assert_allclose(z_over_s(jnp.asarray(s)), expected, rtol=1e-14)


def test_damping_from_restitution_is_inverse():
    r = np.concatenate([[0.01, 0.05], np.linspace(0.1, 0.99, 10), [1 - 1e-6, 1.0]])
    speed = 0.7
    for law in (
        ij.Walton.from_restitution(1e4, r, speed),
        ij.Simon.from_restitution(1e6, r, speed),
        ij.HuntCrossley.from_restitution(1e6, r, speed, 1.3),
        ij.KelvinVoigt.from_restitution(W, r),
        ij.KelvinVoigt.from_restitution(W, r, separation=ij.AtZeroForce()),
        ij.Maxwell.from_restitution(W, r),
    ):
        np.testing.assert_allclose(law.equivalents(speed, MASS).restitution, r, rtol=1e-13)
    slope = jax.vmap(jax.grad(lambda r: restitution_damping(r, speed) * speed))(r[:-1])
    z = restitution_damping(r[:-1], speed) * speed
    by_inverse = 1 / jax.vmap(jax.grad(separable_restitution))(z)
    np.testing.assert_allclose(slope, by_inverse, rtol=1e-12)


def test_zero_force_separation_of_schwager_and_poeschel():
    for gamma in (0.05, 0.3, 0.69, 0.72, 0.95, 0.999999, 1.000001, 1.04, 1.3, 4.0):
        with mpmath.workdps(40):
            beta = mpmath.mpf(gamma)
            root = mpmath.sqrt(abs(1 - beta**2))
            if gamma < 1 / math.sqrt(2):
                time = (mpmath.pi - mpmath.atan(2 * beta * root / (root**2 - beta**2))) / root
            elif gamma < 1:
                time = mpmath.atan(-2 * beta * root / (root**2 - beta**2)) / root
            else:
                time = mpmath.log((beta + root) / (beta - root)) / root
            r, time = float(mpmath.exp(-beta * time)), float(time)
        law = ij.KelvinVoigt(W, gamma, separation=ij.AtZeroForce())
        found = law.equivalents(0.7, MASS)
        np.testing.assert_allclose(found.restitution, r, rtol=1e-14)
        np.testing.assert_allclose(found.duration, time / W, rtol=1e-14)
    at_one = ij.KelvinVoigt(W, 1.0, separation=ij.AtZeroForce()).equivalents(0.7, MASS)
    np.testing.assert_allclose(at_one.restitution, math.exp(-2), rtol=1e-14)


def test_arc_ratio_is_smooth():
    """(1 − γ²) A′ = γ A − 1, on both sides of 1."""
    gammas = jnp.array([0.0, 0.5, 0.9, 0.948, 0.949, 1.0, 1.048, 1.0489, 1.1, 3.0])
    a = arc_ratio(gammas)
    slope = jax.vmap(jax.grad(arc_ratio))(gammas)
    np.testing.assert_allclose((1 - gammas**2) * slope, gammas * a - 1, atol=1e-14)
    assert abs(float(slope[5]) + 1 / 3) < 1e-14


def test_hertz_textbook_formulas():
    found = ij.Hertz(K).equivalents(SPEEDS, MASS)
    deepest = (5 * MASS * SPEEDS**2 / (4 * K)) ** 0.4
    ratio = 2 * math.sqrt(math.pi) * math.gamma(7 / 5) / math.gamma(9 / 10)
    np.testing.assert_allclose(found.restitution, 1, rtol=1e-15)
    np.testing.assert_allclose(found.deepest_penetration, deepest, rtol=1e-14)
    np.testing.assert_allclose(found.duration, ratio * deepest / SPEEDS, rtol=1e-14)
    np.testing.assert_allclose(found.peak_force, K * deepest**1.5, rtol=1e-14)
    np.testing.assert_array_equal(found.energy_lost, 0)


@pytest.mark.parametrize("c", [1e-7, 0.5, 20.0, 60.0])
def test_walton_by_quadrature(c):
    """Time and force over l = ln(1 + c v), in which m dl = −c k δ dt; by Gauss's rule."""
    k, speed = 1e4, 0.7
    with mpmath.workdps(40):
        lam, m = mpmath.mpf(c), mpmath.mpf(MASS)
        z = lam * mpmath.mpf(speed)
        first, last = mpmath.log1p(z), mpmath.log(1 - z * walton_restitution(z))

        def depth(log):
            lost = (z - first) - (mpmath.expm1(log) - log)
            return mpmath.sqrt(2 * m * abs(lost) / k) / lam

        def passage(angle):
            half = (first - last) / 2
            log = (first + last) / 2 + half * mpmath.sin(angle)
            return m * half * mpmath.cos(angle) / (k * lam * depth(log))

        edges = [mpmath.pi / 2 * x for x in (-1, -0.5, 0, 0.5, 1)]
        duration = mpmath.quad(passage, edges, method="gauss-legendre")

        def uphill(log):  # the force's own derivative, up to a positive factor
            return k * (lam * depth(log)) ** 2 - m * mpmath.expm1(log)

        top = mpmath.findroot(uphill, (0, first), solver="anderson")
        peak, deepest = k * depth(top) * mpmath.exp(top), depth(mpmath.mpf(0))
    found = ij.Walton(k, k * c).equivalents(speed, MASS)
    np.testing.assert_allclose(found.duration, float(mpmath.re(duration)), rtol=1e-12)
    np.testing.assert_allclose(found.peak_force, float(peak), rtol=1e-13)
    np.testing.assert_allclose(found.deepest_penetration, float(deepest), rtol=1e-13)


def test_walton_without_damping():
    found = ij.Walton(1e4, 0.0).equivalents(SPEEDS, MASS)
    w = math.sqrt(1e4 / MASS)
    np.testing.assert_allclose(found.duration, math.pi / w, rtol=1e-14)
    np.testing.assert_allclose(found.deepest_penetration, SPEEDS / w, rtol=1e-14)
    np.testing.assert_allclose(found.peak_force, MASS * SPEEDS * w, rtol=1e-14)


DERIVED = {
    "KelvinVoigt": lambda p: ij.KelvinVoigt(W, p),
    "KelvinVoigt without pull": lambda p: ij.KelvinVoigt(W, p, separation=ij.AtZeroForce()),
    "Maxwell": lambda p: ij.Maxwell(W, p),
    "Walton": lambda p: ij.Walton(1e4, 1e4 * p),
    "HuntCrossley, exponent": lambda p: ij.HuntCrossley(K, 0.4, 1 + p),
}


@pytest.mark.parametrize("name", mostly_thorough(DERIVED, "KelvinVoigt", "Walton"))
def test_derivatives_of_closed_forms(name):
    """By the damping (or the exponent) and by the speed, against differences of high order."""

    @jax.jit
    def outputs(x):
        found = DERIVED[name](x[0]).equivalents(x[1], MASS)
        return jnp.stack([getattr(found, field) for field in FIELDS])

    at = jnp.array([0.3, 0.7])
    exact = jax.jacfwd(outputs)(at)
    np.testing.assert_allclose(jax.jacrev(outputs)(at), exact, rtol=1e-12, atol=1e-15)
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    for i in range(2):
        h = 0.02 * float(at[i])
        estimate = sum(
            w * (outputs(at.at[i].add(j * h)) - outputs(at.at[i].add(-j * h))) / h
            for j, w in weights.items()
        )
        size = np.abs(outputs(at)) / float(at[i])
        assert np.all(np.abs(estimate - exact[:, i]) < 1e-9 * size)
