"""Series of systems with arrays as state: derivatives, batches, mechanics against SciPy."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from scipy.integrate import solve_ivp

import impactjax as ij
from impactjax._series.recurrences.series import NotAnalytic
from impactjax._series.recurrences.tables import (
    AWAY_FROM_SINGULARITIES,
    BETWEEN_SWITCHES,
    EVERYWHERE,
)
from impactjax._series.taylor import solution_series
from test_recurrences import ARRAYS, ELEMENTARY, LINEAR, SWITCHES, UNIT, all_series
from tiers import thorough

ORDER, STEP = 12, 0.02
SOME = {
    name: case
    for name, case in (ELEMENTARY | SWITCHES | ARRAYS | LINEAR).items()
    if name in ("sqrt", "varying exponent", "atan2", "tanh", "abs", "max", "hypot", "softplus")
    or name in ("unit vector", "matrix product", "solve", "inverse", "Cholesky solve")
}


def lagrangian(q, v):
    """Kinetic less potential energy of a double pendulum with unequal masses and lengths."""
    x, y = jnp.cumsum(LENGTHS * jnp.sin(q)), -jnp.cumsum(LENGTHS * jnp.cos(q))
    vx, vy = jnp.cumsum(LENGTHS * jnp.cos(q) * v), jnp.cumsum(LENGTHS * jnp.sin(q) * v)
    del x
    return jnp.sum(MASSES * (vx**2 + vy**2)) / 2 - 9.81 * jnp.sum(MASSES * y)


LENGTHS, MASSES = jnp.array([0.7, 0.4]), jnp.array([1.3, 0.6])


def double_pendulum(t, q, v):
    """Lagrange's equations: M(q) a = ∂L/∂q − (∂²L/∂v ∂q) v."""
    del t
    mass = jax.hessian(lagrangian, 1)(q, v)
    mixed = jax.jacfwd(jax.grad(lagrangian, 1), 0)(q, v)
    return [v, jnp.linalg.solve(mass, jax.grad(lagrangian)(q, v) - mixed @ v)]


def gravity(t, q, v):
    """Three bodies in a plane that attract each other."""
    del t

    def potential(q):
        pairs = jnp.array([[1.0, -1.0, 0.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0]])
        return -jnp.sum(jnp.array([1.0, 2.0, 0.5]) / jnp.linalg.norm(pairs @ q, axis=-1))

    return [v, -jax.grad(potential)(q) / jnp.array([[1.0], [1.5], [0.7]])]


def double_pendulum_by_hand(t, y):
    del t
    (a, b, u, w), (l1, l2), (m1, m2) = y, np.asarray(LENGTHS), np.asarray(MASSES)
    s, c = np.sin(a - b), np.cos(a - b)
    mass = [[(m1 + m2) * l1**2, m2 * l1 * l2 * c], [m2 * l1 * l2 * c, m2 * l2**2]]
    force = [
        -m2 * l1 * l2 * s * w**2 - (m1 + m2) * 9.81 * l1 * np.sin(a),
        m2 * l1 * l2 * s * u**2 - m2 * 9.81 * l2 * np.sin(b),
    ]
    return [u, w, *np.linalg.solve(mass, force)]


def gravity_by_hand(t, y):
    del t
    q, v = y.reshape(2, 3, 2)
    force = np.zeros((3, 2))
    for i, j, strength in ((0, 1, 1.0), (0, 2, 2.0), (1, 2, 0.5)):
        apart = q[j] - q[i]
        pull = strength * apart / np.sum(apart**2) ** 1.5
        force[i] += pull
        force[j] -= pull
    return np.concatenate([v.ravel(), (force / np.array([[1.0], [1.5], [0.7]])).ravel()])


SYSTEMS = {
    "double pendulum": (
        double_pendulum,
        double_pendulum_by_hand,
        [jnp.array([0.9, -0.4]), jnp.array([0.5, 2.0])],
    ),
    "three bodies": (
        gravity,
        gravity_by_hand,
        [
            jnp.array([[0.0, 0.0], [1.0, 0.2], [-0.4, 0.8]]),
            jnp.array([[0.1, -0.2], [0.0, 0.9], [-0.8, 0.0]]),
        ],
    ),
}


def series_of(field, y, table=AWAY_FROM_SINGULARITIES, order=ORDER, unit=STEP):
    states, _ = solution_series(field, jnp.zeros(()), y, order, jnp.asarray(unit), table)
    return [jnp.stack(state) for state in states]


@pytest.mark.parametrize("name", SYSTEMS)
def test_step_of_a_mechanical_system_is_scipys(name):
    field, by_hand, y = SYSTEMS[name]
    ours = jax.jit(lambda y: [sum(state) for state in series_of(field, y)])(y)
    start = np.concatenate([np.ravel(each) for each in y])
    theirs = solve_ivp(by_hand, (0, STEP), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    ours = np.concatenate([np.ravel(each) for each in ours])
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-13)


def test_derivative_by_the_start_is_the_rate():
    """D y/d y₀ · f(y₀) = f(y): a start moved along the solution moves the end along it."""
    field, _, y = SYSTEMS["double pendulum"]

    def end(y):
        return [sum(state) for state in series_of(field, y, order=6, unit=0.002)]

    @jax.jit
    def both(y):
        final, moved = jax.jvp(end, (y,), (field(0.0, *y),))
        _, pull = jax.vjp(end, y)
        rate = field(0.0, *final)
        (back,) = pull(rate)
        forward = jax.jvp(end, (y,), (back,))[1]
        return (
            moved,
            rate,
            jax.tree.map(jnp.vdot, back, back),
            jax.tree.map(jnp.vdot, rate, forward),
        )

    moved, rate, squared, paired = both(y)
    np.testing.assert_allclose(moved, rate, rtol=1e-12)
    np.testing.assert_allclose(sum(squared), sum(paired), rtol=1e-13)


@thorough
def test_derivatives_and_batches_of_operations():
    """D cₖ/dt = (k + 1) cₖ₊₁ for any function, forward and reverse, alone and in a batch."""

    def series(t):
        return all_series(SOME, t, 4)

    @jax.jit
    def everything(ts):
        (t, *_), one = ts, jnp.ones(())
        value, forward = jax.jvp(series, (t,), (one,))
        _, pull = jax.vjp(series, t)
        (reverse,) = pull(jax.tree.map(jnp.cos, value))
        return value, forward, reverse, jax.vmap(series)(ts)

    found = everything(jnp.array([0.3, 0.31]))
    value, forward, reverse, batch = jax.tree.map(np.asarray, found)
    paired = 0.0
    for name in SOME:
        expected = np.arange(1, 5).reshape(-1, *[1] * (value[name].ndim - 1)) * value[name][1:]
        size = np.max(np.abs(expected))
        np.testing.assert_allclose(
            forward[name][:-1] * UNIT, expected, 1e-11, 1e-13 * size, err_msg=name
        )
        np.testing.assert_allclose(batch[name][0], value[name], 1e-13, 1e-15, err_msg=name)
        paired += np.vdot(np.cos(value[name]), forward[name])
    np.testing.assert_allclose(reverse, paired, rtol=1e-12)


def test_factors_are_computed_once():
    """One factorisation in a series of any order."""
    field, _, y = SYSTEMS["double pendulum"]
    text = str(jax.make_jaxpr(lambda y: series_of(field, y, EVERYWHERE, order=6))(y))
    assert text.count(" = lu ") == 1
    assert text.count(" = custom_linear_solve[") == 7


@pytest.mark.parametrize(
    ("function", "table", "word"),
    [
        (jnp.sqrt, EVERYWHERE, "`sqrt`"),
        (lambda x: x**1.5, EVERYWHERE, "`pow`"),
        (jnp.abs, AWAY_FROM_SINGULARITIES, "`abs`"),
        (lambda x: jnp.where(x > 0, x, 1.0), AWAY_FROM_SINGULARITIES, "`gt`"),
        (jnp.sort, BETWEEN_SWITCHES, "`sort`"),
        (lambda x: lax.fori_loop(0, 3, lambda _, x: x * x, x), BETWEEN_SWITCHES, "`scan`"),
        (lambda x: jnp.linalg.eigh(jnp.outer(x, x))[0], BETWEEN_SWITCHES, "`eigh`"),
        (lambda x: lax.linalg.lu(jnp.outer(x, x[:1]))[0][:, 0], BETWEEN_SWITCHES, "`lu`"),
        (
            lambda x: lax.custom_linear_solve(lambda z: z / (1 + x), x, lambda _, b: b * (1 + x)),
            BETWEEN_SWITCHES,
            "custom_linear_solve",
        ),
    ],
)
def test_operation_without_recurrence_is_named(function, table, word):
    with pytest.raises(NotAnalytic, match=word) as caught:
        series_of(lambda t, y: [function(y)], [jnp.array([0.4, 0.8])], table, order=3)
    assert "RungeKutta()" in str(caught.value)


def test_branch_at_a_switching_point():
    """The branch of larger or equal numbers is taken."""

    def field(t, x):
        del t
        return [jnp.ones(()), jnp.abs(x), jnp.maximum(x, 3 * x), jnp.where(x >= 0, x, 0.0)]

    t, unit = jnp.zeros(()), jnp.ones(())
    _, further = solution_series(field, t, [jnp.zeros(())], 2, unit, BETWEEN_SWITCHES)
    np.testing.assert_array_equal(np.array(further), [[0, 1, 0], [0, 1, 0], [0, 1, 0]])


@pytest.mark.parametrize("function", [jnp.sqrt, lambda x: x**1.5, jnp.cbrt, jnp.arcsin])
def test_series_at_a_singular_point_is_not_finite(function):
    start = [jnp.asarray(1.0 if function is jnp.arcsin else 0.0)]
    (state,) = series_of(lambda t, y: [1 + function(y)], start, order=4)
    assert not np.isfinite(state).all()


@jax.numpy_dtype_promotion("standard")
def test_taylor_solver_of_bodies_with_distances():
    field, by_hand, (q, v) = SYSTEMS["three bodies"]
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(lambda t, y, args: tuple(field(t, *y))),
        ij.Taylor(),
        0.0,
        0.5,
        0.01,
        (q, v),
        stepsize_controller=diffrax.PIDController(rtol=1e-12, atol=1e-12),
    )
    start = np.concatenate([np.ravel(q), np.ravel(v)])
    theirs = solve_ivp(by_hand, (0, 0.5), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert solution.ys is not None
    ours = np.concatenate([np.ravel(each) for each in solution.ys])
    np.testing.assert_allclose(ours, theirs, atol=1e-10)
