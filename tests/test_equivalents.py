"""Single impacts by integration: against the closed forms, and against SciPy."""

import functools
import math
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fminbound

import impactjax as ij
from impactjax._model import separable
from impactjax._model.lambert import psi
from laws import FORCES, INTEGRATED, MASS, Usual, without_pull
from tiers import mostly_thorough, thorough

SPEEDS = np.array([0.05, 0.73, 3.0])
FIELDS = ("restitution", "duration", "deepest_penetration", "peak_force", "energy_lost")
W, G = FORCES["kelvin-voigt"].values
K, LAMBDA = FORCES["simon"].values
STRONG = {
    "kelvin-voigt, strong": Usual(ij.KelvinVoigt, (W, 0.7)),
    "kelvin-voigt without pull, overdamped": Usual(without_pull, (W, 1.5)),
}
CASES = FORCES | STRONG
IN_CLOSED_FORM = [name for name in CASES if name not in INTEGRATED]


def _spring_and_dashpot(d, r, s, v, omega0, gamma):
    return MASS * (omega0**2 * d + 2 * gamma * omega0 * r)


def _tuned(d, r, s, v, omega0, r0, alpha):
    return _spring_and_dashpot(d, r, s, v, omega0, _damping(r0 - alpha * v))


# Each force written out once more: of (δ, δ′, internal, approach speed) and the law's parameters.
FORMULAS: dict[str, Callable[..., float]] = {
    "kelvin-voigt": _spring_and_dashpot,
    "kelvin-voigt without pull": _spring_and_dashpot,
    "kelvin-voigt-linear-restitution": _tuned,
    "maxwell": lambda d, r, s, v, omega0, gamma: MASS * omega0**2 * (d - s),
    "walton": lambda d, r, s, v, k, c: k * d + c * d * r,
    "hertz": lambda d, r, s, v, k: k * abs(d) ** 1.5,
    "simon": lambda d, r, s, v, k, c: k * abs(d) ** 1.5 * (1 + c * r),
    "hunt-crossley": lambda d, r, s, v, k, c, n: k * abs(d) ** n * (1 + c * r),
    "pust-peterka": lambda d, r, s, v, k, alpha, q: (
        k * abs(d) ** 1.5 * (1 + alpha * math.copysign(abs(r) ** q, r))
    ),
    "hertz-dashpot": lambda d, r, s, v, k, c: k * abs(d) ** 1.5 + c * r,
    "power-law": lambda d, r, s, v, k, c, n, p, q: (
        k * abs(d) ** n + c * abs(d) ** p * math.copysign(abs(r) ** q, r)
    ),
}


def _damping(r):
    return -math.log(r) / math.hypot(math.pi, math.log(r))


@functools.cache
def by_scipy(name: str):
    """DOP853 over contact, loading until the turn for the extremes; rows by speed."""
    law, values, formula = CASES[name].law, CASES[name].values, FORMULAS[name.split(",")[0]]
    stroke = 2 * law.gamma * law.omega0 if isinstance(law, ij.Maxwell) else 0.0
    no_pull = isinstance(law.separation, ij.AtZeroForce)
    rows = []

    def force(*motion):
        return formula(*motion, *values)

    for v in SPEEDS:

        def flow(t, y, v=v):
            return [y[1], -force(y[0], y[1], y[2], v) / MASS, stroke * (y[0] - y[2])]

        def ends(t, y, v=v):
            return (force(y[0], y[1], y[2], v) / MASS if no_pull else y[0]) + (t < 1e-9)

        vars(ends).update(terminal=True, direction=-1)
        run = solve_ivp(
            flow,
            (0, 1),
            [0.0, v, 0.0],
            method="DOP853",
            rtol=1e-13,
            atol=1e-18,
            events=ends,
            dense_output=True,
            max_step=1e-4,
        )
        duration, (_, rate, _) = run.t_events[0][0], run.y_events[0][0]
        depth = _maximum(lambda t, sol=run.sol: sol(t)[0], duration)
        peak = _maximum(lambda t, sol=run.sol, v=v: force(*sol(t), v), duration)
        lost = MASS * (v**2 - rate**2) / 2
        rows.append([-rate / v, duration, depth, peak, lost])
    return dict(zip(FIELDS, np.array(rows).T, strict=True))


def _maximum(function, end):
    """Largest value on [0, end]: the best of a grid, then between its neighbours."""
    ts = np.linspace(0, end, 401)
    i = int(np.argmax([function(t) for t in ts]))
    if i == 0:
        return function(0.0)
    within = ts[i - 1], ts[i + 1]
    best = fminbound(lambda t: -function(t), *within, xtol=1e-13)
    return function(best)


single_impacts = jax.jit(lambda law, v: ij.single_impact(law, v, MASS, tolerance=1e-13))


@functools.cache
def integrated(name: str):
    return single_impacts(CASES[name].law, SPEEDS)


@pytest.mark.parametrize("name", mostly_thorough(IN_CLOSED_FORM, "hunt-crossley"))
def test_closed_forms_match_integration(name):
    closed, found = CASES[name].law.equivalents(SPEEDS, MASS), integrated(name)
    for field in FIELDS:
        expected = getattr(closed, field)
        scale = MASS * SPEEDS**2 if field == "energy_lost" else 0.0
        error = np.abs(getattr(found, field) - expected)
        assert np.all(error <= 1e-10 * np.maximum(np.abs(expected), scale)), field


@pytest.mark.parametrize("name", mostly_thorough(CASES, "hunt-crossley"))
def test_single_impact_matches_scipy(name):
    found, expected = integrated(name), by_scipy(name)
    for field in FIELDS:
        scale = MASS * SPEEDS**2 if field == "energy_lost" else 0.0
        error = np.abs(getattr(found, field) - expected[field])
        assert np.all(error <= 1e-9 * np.maximum(np.abs(expected[field]), scale)), field


@thorough
def test_hertz_dashpot_of_the_thesis():
    k = ij.Hertz.from_material(0.025426e9, 0.5, 0.0127).k
    found = single_impacts(ij.HertzDashpot(k, 23.0), np.array([0.1, 0.3, 0.73]))
    np.testing.assert_allclose(found.restitution, [0.144, 0.247, 0.329], atol=5e-4)


def test_single_impact_of_user_defined_law():
    class Hardening(ij.AbstractMemorylessLaw):
        k: jax.Array
        separation: ij.AbstractSeparation = eqx.field(init=False, default=ij.AtZeroPenetration())

        def force(self, penetration, rate, internal, mass):
            return self.k * penetration**3

    found = ij.single_impact(Hardening(jnp.asarray(1e10)), 0.7, MASS, tolerance=1e-12)
    deepest = (2 * MASS * 0.7**2 / 1e10) ** 0.25
    np.testing.assert_allclose(found.deepest_penetration, deepest, rtol=1e-10)
    np.testing.assert_allclose(found.peak_force, 1e10 * deepest**3, rtol=1e-10)
    np.testing.assert_allclose(found.restitution, 1, rtol=1e-10)
    half = math.sqrt(math.pi) * math.gamma(5 / 4) / math.gamma(3 / 4)  # ∫ (1 − x⁴)^(−1/2) dx
    np.testing.assert_allclose(found.duration, 2 * deepest / 0.7 * half, rtol=1e-10)


@thorough
def test_single_impact_without_rebound():
    for law in (ij.KelvinVoigt(W, 1.2), ij.Maxwell(W, 1.2)):
        for found in (law.equivalents(SPEEDS, MASS), single_impacts(law, SPEEDS)):
            assert np.all(found.restitution == 0)
            assert np.all(found.duration == math.inf)
            np.testing.assert_allclose(found.energy_lost, MASS * SPEEDS**2 / 2, rtol=1e-14)
    creeping = ij.Maxwell(W, 1.2).equivalents(0.7, MASS)
    np.testing.assert_allclose(creeping.deepest_penetration, 2 * 1.2 * 0.7 / W, rtol=1e-14)


@thorough
def test_derivatives_of_integrated_impact_match_closed_form():
    def of_closed(law, v):
        return law.equivalents(v, MASS)

    def of_integration(law, v):
        return ij.single_impact(law, v, MASS, tolerance=1e-13)

    law, v = ij.Simon(K, LAMBDA), jnp.asarray(0.7)
    closed = jax.jacfwd(of_closed, argnums=(0, 1))(law, v)
    found = jax.jit(jax.jacfwd(of_integration, argnums=(0, 1)))(law, v)
    for field in FIELDS:
        (by_law, by_speed), (law_form, speed_form) = getattr(found, field), getattr(closed, field)
        value = float(getattr(of_closed(law, v), field))
        value = MASS * 0.7**2 if field == "energy_lost" else value
        pairs = (
            (by_law.k, law_form.k, value / K),
            (by_law.c, law_form.c, value / LAMBDA),
            (by_speed, speed_form, value / 0.7),
        )
        for a, b, scale in pairs:
            assert abs(float(a - b)) < 1e-9 * scale, field


@thorough
def test_derivatives_with_singular_force_slope():
    """Walton's and Tsuji's laws as power laws, by k, c and speed, against closed forms."""

    def restitution(x, exponents):
        law = ij.PowerLaw(x[0], x[1], *exponents)
        return ij.single_impact(law, x[2], MASS, tolerance=1e-10).restitution

    def walton(x):
        return ij.Walton(x[0], x[1]).equivalents(x[2], MASS).restitution

    def tsuji(x):
        gamma = x[1] / jnp.sqrt(5 * MASS * x[0])
        return jnp.exp(-math.pi * gamma / jnp.sqrt(1 - gamma**2))

    slopes = jax.jit(jax.jacfwd(restitution))
    for closed, exponents, values, tolerance in (
        (walton, [1.0, 1.0, 1.0], [1e4, 1e4, 0.7], 1e-7),
        (tsuji, [1.5, 0.25, 1.0], [1e6, 150.0, 0.7], 1e-3),
    ):
        x = jnp.array(values)
        found, expected = slopes(x, jnp.array(exponents)), jax.grad(closed)(x)
        assert np.all(np.abs((found - expected) * x) < tolerance)


@pytest.mark.parametrize(
    "name",
    mostly_thorough(
        ["kelvin-voigt", "kelvin-voigt without pull", "maxwell", "simon", "hertz-dashpot"],
        "kelvin-voigt",
    ),
)
def test_three_coefficients_of_restitution_agree(name):
    found = ij.coefficients_of_restitution(CASES[name].law, 0.73, MASS)
    expected = by_scipy(name)["restitution"][1]
    for coefficient in found:
        assert abs(float(coefficient) / expected - 1) < 1e-9


def test_coefficients_without_rebound_are_nan():
    found = ij.coefficients_of_restitution(ij.KelvinVoigt(W, 1.2), 0.73, MASS)
    assert all(np.isnan(coefficient) for coefficient in found)


@pytest.mark.parametrize("name", IN_CLOSED_FORM)
def test_speed_of_an_impact_must_be_positive(name):
    law = CASES[name].law
    for speed in (-1.0, 0.0, np.array([1.0, math.nan])):
        with pytest.raises(ValueError, match="`speed` must be positive"):
            law.equivalents(speed, MASS)
    with pytest.raises(ValueError, match="`mass` must be positive"):
        law.equivalents(1.0, -MASS)


def test_closed_form_is_traced_once_for_all_speeds(monkeypatch):
    traces = []

    def counted(z):
        traces.append(z)
        return psi(z)

    monkeypatch.setattr(separable, "psi", counted)
    jax.clear_caches()
    seen = []
    for speed in (1.0, 2.0):
        ij.Hertz(K).equivalents(speed, MASS)
        seen.append(len(traces))
    assert seen[1] == seen[0] > 0


@thorough
def test_derivatives_of_an_impact_are_as_accurate_as_its_values():
    stiffnesses, speeds = np.geomspace(1e4, 1e8, 40), np.geomspace(5.0, 0.1, 40)

    def outcome(found, v):
        return jnp.array([found.restitution * v, found.duration, found.deepest_penetration])

    def integrated(k, v):
        return outcome(ij.single_impact(ij.Hertz(k), v, MASS), v)

    def exact(k, v):
        return outcome(ij.Hertz(k).equivalents(v, MASS), v)

    size = jax.vmap(exact)(stiffnesses, speeds)
    found, expected = (
        jax.vmap(jax.jacfwd(function, (0, 1)))(stiffnesses, speeds)
        for function in (integrated, exact)
    )
    for own, other, scales in zip(found, expected, (stiffnesses, speeds), strict=True):
        np.testing.assert_array_less(np.abs(own - other) / size * scales[:, None], 1e-8)
