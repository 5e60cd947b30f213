"""Recurrences of operations on arrays against mpmath's series of the same functions."""

import functools

import jax
import jax.numpy as jnp
import jax.scipy as jsp
import mpmath
import numpy as np
import pytest
from jax import lax

from impactjax._series.recurrences.tables import BETWEEN_SWITCHES
from impactjax._series.taylor import solution_series
from tiers import thorough

pytestmark = thorough

ORDER, START, UNIT = 12, 0.3, 0.25
MATRIX = np.array([[0.1, 2.0, -0.5], [1.5, 0.3, 0.4], [-0.2, 0.7, 1.1]])
WHICH = np.array([True, False, True])
PLACES = np.array([2, 0])


def each(function):
    """The function of each element of an array of mpmath's numbers."""
    return np.vectorize(function, otypes=[object])


def elements(t):
    """Three functions of time between 0 and 1."""
    return [0.4 + 0.5 * t * t, 0.9 - 0.3 * t, 0.2 + t / (1 + t)]


def general(x, concatenate):
    """A matrix that needs other rows as pivots."""
    return MATRIX + concatenate([x[:, None] * 0.1, x[:, None] * 0.2, -x[:, None] * x[0]], 1)


def definite(x):
    """A positive definite matrix."""
    return 2 * np.eye(3) + x[:, None] * x[None, :]


def solved(matrix, right):
    return np.array(list(mpmath.lu_solve(mpmath.matrix(matrix), mpmath.matrix(right))), object)


def inverse(matrix):
    return np.array(mpmath.inverse(mpmath.matrix(matrix)).tolist(), object)


def factor(matrix):
    return np.array(mpmath.cholesky(mpmath.matrix(matrix)).tolist(), object)


def norm(x):
    return mpmath.sqrt(sum(x * x))


def pair(function):
    """The same function for both arithmetics, with the functions that concatenate."""
    return (
        functools.partial(function, concatenate=jnp.concatenate),
        functools.partial(function, concatenate=np.concatenate),
    )


ELEMENTARY = {
    "sqrt": (jnp.sqrt, each(mpmath.sqrt)),
    "rsqrt": (lax.rsqrt, each(lambda x: 1 / mpmath.sqrt(x))),
    "cbrt": (jnp.cbrt, each(mpmath.cbrt)),
    "log": (jnp.log, each(mpmath.log)),
    "log1p": (jnp.log1p, each(lambda x: mpmath.log(1 + x))),
    "exp": (jnp.exp, each(mpmath.exp)),
    "exp2": (jnp.exp2, each(lambda x: 2**x)),
    "expm1": (jnp.expm1, each(mpmath.expm1)),
    "sin": (jnp.sin, each(mpmath.sin)),
    "cos": (jnp.cos, each(mpmath.cos)),
    "tan": (jnp.tan, each(mpmath.tan)),
    "asin": (jnp.arcsin, each(mpmath.asin)),
    "acos": (jnp.arccos, each(mpmath.acos)),
    "atan": (jnp.arctan, each(mpmath.atan)),
    "sinh": (jnp.sinh, each(mpmath.sinh)),
    "cosh": (jnp.cosh, each(mpmath.cosh)),
    "tanh": (jnp.tanh, each(mpmath.tanh)),
    "asinh": (jnp.arcsinh, each(mpmath.asinh)),
    "acosh": (lambda x: jnp.arccosh(1 + x), each(lambda x: mpmath.acosh(1 + x))),
    "atanh": (jnp.arctanh, each(mpmath.atanh)),
    "logistic": (jax.nn.sigmoid, each(lambda x: 1 / (1 + mpmath.exp(-x)))),
    "erf": (jsp.special.erf, each(mpmath.erf)),
    "erfc": (jsp.special.erfc, each(mpmath.erfc)),
    "square": (jnp.square, np.square),
    "integer_pow": (lambda x: x**-3, lambda x: x**-3),
    "broken power": (lambda x: x**1.5, each(lambda x: x ** mpmath.mpf(1.5))),
    "broken power of a negative base": (lambda x: (-x) ** 3.0, lambda x: -(x**3)),
    "power by an array": (lambda x: x ** jnp.array([0.5, 2, -1.5]), lambda x: x ** [0.5, 2, -1.5]),
    "power by a whole number": (lambda x: lax.pow(x, jnp.asarray(3)), lambda x: x**3),
    "varying exponent": (lambda x: x ** x[::-1], lambda x: x ** x[::-1]),
    "varying exponent of a number": (lambda x: 1.7**x, each(lambda x: mpmath.mpf(1.7) ** x)),
    "atan2": (lambda x: jnp.arctan2(x, x[0] - 2), lambda x: each(mpmath.atan2)(x, x[0] - 2)),
    "atan2 of a number": (
        lambda x: jnp.arctan2(-0.5, x) + jnp.arctan2(x, 0.5),
        each(lambda x: mpmath.atan2(-0.5, x) + mpmath.atan2(x, 0.5)),
    ),
}
SWITCHES = {
    "abs": (lambda x: jnp.abs(x - 0.5), lambda x: abs(x - 0.5)),
    "sign": (lambda x: jnp.sign(x - 0.5) * x, each(lambda x: mpmath.sign(x - 0.5) * x)),
    "max": (lambda x: jnp.maximum(x, 1 - x), lambda x: np.maximum(x, 1 - x)),
    "min": (
        lambda x: jnp.minimum(x * x, 0.3),
        lambda x: np.minimum(x * x, np.array(mpmath.mpf(0.3), object)),
    ),
    "select by the state": (
        lambda x: jnp.where(x > 0.5, x**2, 1.0),
        each(lambda x: x**2 if x > 0.5 else mpmath.mpf(1)),
    ),
    "select between numbers": (
        lambda x: x * jnp.where(x > 0.5, 2.0, 1.0),
        each(lambda x: 2 * x if x > 0.5 else x),
    ),
    "condition as a number": (
        lambda x: x * jnp.astype(jnp.logical_not(x > 0.5), float) * jnp.floor(3 * x),
        each(lambda x: mpmath.mpf(0) if x > 0.5 else x * mpmath.floor(3 * x)),
    ),
    "hypot": (lambda x: jnp.hypot(x, x[0] - 1), lambda x: each(mpmath.hypot)(x, x[0] - 1)),
    "softplus": (jax.nn.softplus, each(lambda x: mpmath.log(1 + mpmath.exp(x)))),
}
ARRAYS = {
    "outer product": (lambda x: jnp.outer(x, x[:2]), lambda x: np.outer(x, x[:2])),
    "matrix product": (
        lambda x: definite(x) @ definite(x * x),
        lambda x: definite(x) @ definite(x * x),
    ),
    "product with a number's matrix": (
        lambda x: MATRIX @ x + x @ MATRIX,
        lambda x: MATRIX @ x + x @ MATRIX,
    ),
    "einsum": (lambda x: jnp.einsum("i,j,j->i", x, x, x), lambda x: x * sum(x * x)),
    "concatenate": pair(lambda x, concatenate: concatenate([x * x, np.ones(2), x])),
    "stack": (lambda x: jnp.stack([x, np.ones(3)]), lambda x: np.stack([x, np.ones(3)])),
    "pad": (
        lambda x: jnp.pad(x, 1, constant_values=2.0) ** 2,
        lambda x: np.concatenate([[4], x * x, [4]]),
    ),
    "slice": (lambda x: x[1:] * x[::-1][:2], lambda x: x[1:] * x[::-1][:2]),
    "dynamic slice": (
        lambda x: lax.dynamic_slice(x * x, (jnp.asarray(1),), (2,)),
        lambda x: x[1:] ** 2,
    ),
    "dynamic update": (
        lambda x: lax.dynamic_update_slice(x * x, x[:1], (jnp.asarray(1),)),
        lambda x: np.array([x[0] ** 2, x[0], x[2] ** 2]),
    ),
    "gather": (lambda x: (x * x)[PLACES], lambda x: x[PLACES] ** 2),
    "gather outside": (
        lambda x: (x * x).at[jnp.array([1, 7])].get(mode="fill", fill_value=3.0),
        lambda x: np.array([x[1] ** 2, mpmath.mpf(3)]),
    ),
    "scatter": (
        lambda x: (x * x).at[PLACES].set(x[:2]),
        lambda x: np.array([x[1], x[1] ** 2, x[0]]),
    ),
    "scatter-add": (
        lambda x: jnp.ones(3).at[np.array([0, 0])].add(x[:2]),
        lambda x: np.array([1 + x[0] + x[1], mpmath.mpf(1), mpmath.mpf(1)]),
    ),
    "select": (lambda x: jnp.where(WHICH, x * x, 1.0), lambda x: np.where(WHICH, x * x, 1)),
    "sums": (lambda x: jnp.sum(x) * jnp.cumsum(x), lambda x: np.sum(x) * np.cumsum(x)),
    "transpose and reshape": (
        lambda x: jnp.outer(x, x * x).T.reshape(9),
        lambda x: np.outer(x, x * x).T.reshape(9),
    ),
    "split": (
        lambda x: jnp.concatenate(jnp.split(x * x, [1])[::-1]),
        lambda x: np.concatenate([x[1:], x[:1]]) ** 2,
    ),
    "unit vector": (lambda x: x / jnp.linalg.norm(x), lambda x: x / norm(x)),
    "gradient of a distance": (
        lambda x: jax.grad(lambda x: jnp.linalg.norm(x) ** 3)(x),
        lambda x: 3 * norm(x) * x,
    ),
}
LINEAR = {
    "solve": (
        lambda x: jnp.linalg.solve(general(x, jnp.concatenate), x * x),
        lambda x: solved(general(x, np.concatenate), x * x),
    ),
    "solve with a number's matrix": (
        lambda x: jnp.linalg.solve(jnp.asarray(MATRIX), x * x),
        lambda x: solved(MATRIX, x * x),
    ),
    "solve for numbers": (
        lambda x: jnp.linalg.solve(general(x, jnp.concatenate), jnp.ones(3)),
        lambda x: solved(general(x, np.concatenate), np.ones(3)),
    ),
    "solve a batch": (
        lambda x: jax.vmap(jnp.linalg.solve)(
            jnp.stack([general(x, jnp.concatenate), definite(x)]), jnp.stack([x, x * x])
        ),
        lambda x: np.stack([solved(general(x, np.concatenate), x), solved(definite(x), x * x)]),
    ),
    "inverse": (
        lambda x: jnp.linalg.inv(general(x, jnp.concatenate)),
        lambda x: inverse(general(x, np.concatenate)),
    ),
    "solve positive definite": (
        lambda x: jsp.linalg.solve(definite(x), x, assume_a="pos"),
        lambda x: solved(definite(x), x),
    ),
    "factor and solve": (
        lambda x: jsp.linalg.lu_solve(jsp.linalg.lu_factor(general(x, jnp.concatenate)), x),
        lambda x: solved(general(x, np.concatenate), x),
    ),
    "Cholesky": (lambda x: jnp.linalg.cholesky(definite(x)), lambda x: factor(definite(x))),
    "Cholesky solve": (
        lambda x: jsp.linalg.cho_solve(jsp.linalg.cho_factor(definite(x)), x),
        lambda x: solved(definite(x), x),
    ),
    "determinant": (
        lambda x: jnp.linalg.det(jnp.pad(general(x, jnp.concatenate), (0, 1)) + np.eye(4)),
        lambda x: mpmath.det(mpmath.matrix(general(x, np.concatenate) + np.eye(3))),
    ),
    "triangular from the right": (
        lambda x: lax.linalg.triangular_solve(
            definite(x), jnp.outer(x[:2], x), lower=False, transpose_a=True
        ),
        lambda x: np.outer(x[:2], x) @ inverse(np.triu(definite(x))).T,
    ),
    "triangular with a unit diagonal": (
        lambda x: lax.linalg.triangular_solve(
            definite(x), x[:, None], left_side=True, lower=True, unit_diagonal=True
        ),
        lambda x: solved(np.tril(definite(x), -1) + np.eye(3), x)[:, None],
    ),
}


SCATTERS = {name: ARRAYS.pop(name) for name in ("scatter", "scatter-add")}
PROGRAMS = [ELEMENTARY, SWITCHES, ARRAYS, LINEAR]
CASES = SCATTERS | ELEMENTARY | SWITCHES | ARRAYS | LINEAR


def all_series(cases, t, order=ORDER):
    """Coefficients of several cases at a time, by name."""

    def field(t):
        return [function(jnp.stack(elements(t))) for function, _ in cases.values()]

    _, found = solution_series(field, t, [], order, jnp.asarray(UNIT), BETWEEN_SWITCHES)
    return dict(zip(cases, map(jnp.stack, found), strict=True))


def compiled_series(t, order=ORDER):
    """All cases; the tests' compiler options abort on scatters, which run one by one."""
    found = all_series(SCATTERS, t, order)
    for cases in PROGRAMS:
        found |= jax.jit(functools.partial(all_series, cases, order=order))(t)
    return found


@pytest.fixture(scope="module")
def found():
    return compiled_series(jnp.asarray(START))


@pytest.mark.parametrize("name", CASES)
def test_series_of_an_array_is_mpmaths(name, found):
    def value(index, t):
        return np.asarray(CASES[name][1](np.array(elements(t), object)))[index]

    with mpmath.workdps(30):
        for index in np.ndindex(found[name].shape[1:]):
            known = mpmath.taylor(functools.partial(value, index), mpmath.mpf(START), ORDER)
            known = np.array([float(a * UNIT**k) for k, a in enumerate(known)])
            scale = np.max(np.abs(known))
            np.testing.assert_allclose(
                found[name][:, *index], known, rtol=1e-12, atol=1e-14 * scale
            )
