"""Series from the vector field's own program against mpmath's of closed forms."""

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

import impactjax as ij
from impactjax._series.recurrences.series import NotAnalytic
from impactjax._series.taylor import solution_series
from systems import Own

ORDER, START, UNIT = 12, 0.3, 0.5


def series(field, y=()):
    """Coefficients of the solution and of further functions, in units of time."""

    @jax.jit
    def all_series(t, y):
        return solution_series(field, t, y, ORDER, jnp.asarray(UNIT))

    states, further = all_series(jnp.asarray(START), [jnp.asarray(value) for value in y])
    return np.array(states), np.array(further)


def expected(function):
    with mpmath.workdps(40):
        coefficients = mpmath.taylor(function, mpmath.mpf(START), ORDER)
        return np.array([float(a * UNIT**k) for k, a in enumerate(coefficients)])


def assert_same(found, closed_form):
    known = expected(closed_form)
    np.testing.assert_allclose(found, known, rtol=1e-12, atol=1e-14 * np.max(np.abs(known)))


FUNCTIONS = {
    "line": (lambda t: 3.0 * t - 2.0, lambda t: 3 * t - 2),
    "from a constant": (lambda t: 2.0 - t, lambda t: 2 - t),
    "negative": (lambda t: -(t * t), lambda t: -(t**2)),
    "cube": (lambda t: t**3, lambda t: t**3),
    "power 7": (lambda t: (1.0 + t) ** 7, lambda t: (1 + t) ** 7),
    "power 1": (lambda t: (2.0 * t) ** 1, lambda t: 2 * t),
    "power 0": (lambda t: t**0, lambda t: mpmath.mpf(1)),
    "power -3": (lambda t: t**-3, lambda t: t**-3),
    "jnp.square": (lambda t: jnp.square(1.0 + t), lambda t: (1 + t) ** 2),
    "product": (lambda t: (t + 1.0) * jnp.sin(t), lambda t: (t + 1) * mpmath.sin(t)),
    "quotient": (lambda t: jnp.sin(t) / (1.0 + t * t), lambda t: mpmath.sin(t) / (1 + t**2)),
    "reciprocal": (lambda t: 1.0 / t, lambda t: 1 / t),
    "by a constant": (lambda t: jnp.cos(t) / 7.0, lambda t: mpmath.cos(t) / 7),
    "sine": (jnp.sin, mpmath.sin),
    "cosine": (jnp.cos, mpmath.cos),
    "exponential": (jnp.exp, mpmath.exp),
    "sine of a square": (lambda t: jnp.sin(t**2), lambda t: mpmath.sin(t**2)),
    "cosine of a quotient": (lambda t: jnp.cos(1.0 / t), lambda t: mpmath.cos(1 / t)),
    "exponential of a sine": (
        lambda t: jnp.exp(-jnp.sin(3.0 * t)),
        lambda t: mpmath.exp(-mpmath.sin(3 * t)),
    ),
    "power of an exponential": (lambda t: jnp.exp(t) ** 5, lambda t: mpmath.exp(5 * t)),
    "identity of squares": (
        lambda t: jnp.sin(t) ** 2 + jnp.cos(t) ** 2,
        lambda t: mpmath.mpf(1),
    ),
    "inside jit": (jax.jit(lambda t: t * jnp.exp(t)), lambda t: t * mpmath.exp(t)),
    "a choice that time does not change": (
        lambda t: jnp.where(jnp.asarray(2.0) > 1.0, jnp.sin(t), t),
        mpmath.sin,
    ),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_taylor_series_of_functions_of_time(name):
    function, closed_form = FUNCTIONS[name]
    _, (found,) = series(lambda t: [function(t)])
    assert_same(found, closed_form)


SOLUTIONS = {
    "growth": (lambda t, y: [y], (1.0,), [lambda t: mpmath.exp(t - START)]),
    "blow-up": (lambda t, y: [y**2], (1.0,), [lambda t: 1 / (1 - (t - START))]),
    "forced": (
        lambda t, y: [jnp.cos(t) - y],
        (0.0,),
        [
            lambda t: (
                (mpmath.sin(t) + mpmath.cos(t)) / 2
                - mpmath.exp(START - t) * (mpmath.sin(START) + mpmath.cos(START)) / 2
            )
        ],
    ),
    "oscillator": (
        lambda t, x, v: [v, -9.0 * x],
        (1.0, 0.0),
        [lambda t: mpmath.cos(3 * (t - START)), lambda t: -3 * mpmath.sin(3 * (t - START))],
    ),
    "pendulum on its separatrix": (
        lambda t, x, v: [v, -jnp.sin(x)],
        (0.0, 2.0),
        [
            lambda t: 4 * mpmath.atan(mpmath.tanh((t - START) / 2)),
            lambda t: 2 * mpmath.sech(t - START),
        ],
    ),
}


@pytest.mark.parametrize("name", SOLUTIONS)
def test_taylor_series_of_ode_solutions(name):
    field, y, closed_forms = SOLUTIONS[name]
    found, _ = series(field, y)
    for own, closed_form in zip(found, closed_forms, strict=True):
        assert_same(own, closed_form)


def test_taylor_series_of_functions_of_the_solution():
    """The energy of an oscillator is constant to all orders."""
    _, (energy,) = series(lambda t, x, v: [v, -9.0 * x, v**2 / 2 + 9 * x**2 / 2], (1.0, 0.5))
    np.testing.assert_allclose(energy, [4.625, *np.zeros(ORDER)], atol=1e-14)


@pytest.mark.parametrize(
    ("function", "word"),
    [
        (jnp.abs, "abs"),
        (jnp.sign, "sign"),
        (jnp.floor, "floor"),
        (lambda x: jnp.maximum(x, 0.5), "max"),
        (lambda x: jnp.where(x > 0, x, 0.0), "RungeKutta"),
    ],
)
def test_non_analytic_operation_is_named_in_error(function, word):
    with pytest.raises(NotAnalytic, match=word) as caught:
        series(lambda t, y: [function(y)], (1.0,))
    assert "RungeKutta()" in str(caught.value)


def test_non_analytic_model_takes_runge_kutta_step():
    model = ij.ImpactOscillator(Own(law=lambda t, x, v: -jnp.abs(x)))
    ts = jnp.linspace(0.0, 1.0, 5)
    run = ij.simulate(model, ij.InitialState(1.0), ts)
    np.testing.assert_allclose(run.position, np.cos(ts), atol=1e-7)
    with pytest.raises(NotAnalytic, match="`abs`"):
        ij.simulate(model, ij.InitialState(1.0), ts, step=ij.TaylorStep())
