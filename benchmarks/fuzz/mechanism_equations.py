"""Four mechanisms with contacts in NumPy, written apart from the package: their equations of motion
M(q) v̇ = f(q, v), their gaps g(q), and what is drawn for a random run of each.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

G = 9.81
LAWS = {
    "restitution": ("restitution",) * 2,
    "kelvin-voigt": ("kelvin-voigt",) * 2,
    "at-zero-force": ("at-zero-force",) * 2,
    "hunt-crossley": ("hunt-crossley",) * 2,
    "mixed": ("restitution", "kelvin-voigt"),
}
Vector = np.ndarray
Parameters = dict[str, Vector]
Draw = Callable[[np.random.Generator], tuple[Parameters, Vector, Vector]]


class Equations(NamedTuple):
    """Equations of a mechanism.

    - `matrix`, `force`: M and f of (p, q, v).
    - `gaps`, `normals`, `turning`: g, ∂g/∂q and (d/dt ∂g/∂q) v.
    - `draw`: random parameters, coordinates and rates.
    - `laws`: the names of `LAWS` that it is run with.
    - `end`: duration of a run [s].
    """

    matrix: Callable[[Parameters, Vector], Vector]
    force: Callable[[Parameters, Vector, Vector], Vector]
    gaps: Callable[[Parameters, Vector], Vector]
    normals: Callable[[Parameters, Vector], Vector]
    turning: Callable[[Parameters, Vector, Vector], Vector]
    draw: Draw
    laws: tuple[str, ...]
    end: float


def drawn_laws(rng: np.random.Generator, kinds: tuple[str, ...]) -> Vector:
    """Three parameters of the law of each contact; those that a law lacks are zero."""
    rows = []
    for kind in kinds:
        if kind == "restitution":
            rows.append([rng.uniform(0.3, 0.95), 0.0, 0.0])
        elif kind == "hunt-crossley":
            rows.append([10 ** rng.uniform(4, 6), rng.uniform(0.0, 0.5), rng.uniform(1.2, 2.5)])
        else:
            rows.append([10 ** rng.uniform(1.7, 2.7), rng.uniform(0.01, 0.6), 0.0])
    return np.array(rows)


# Two masses on damped springs, pushed towards a wall; a stop between them.


def _two_draw(rng: np.random.Generator) -> tuple[Parameters, Vector, Vector]:
    p = {
        "masses": rng.uniform(0.5, 3, 2),
        "stiffness": rng.uniform(10, 100, 2),
        "damping": rng.uniform(0, 0.5, 2),
        "push": rng.uniform(0, 10, 2),
        "gaps": rng.uniform(0.05, 0.3, 2),
    }
    first = rng.uniform(-0.04, 0.3)
    q = np.array([first, first + rng.uniform(-0.04, 0.4)])
    return p, q, rng.uniform(-2, 2, 2)


TWO_MASSES = Equations(
    matrix=lambda p, q: np.diag(p["masses"]),
    force=lambda p, q, v: -p["stiffness"] * q - p["damping"] * v - p["push"],
    gaps=lambda p, q: np.array([q[1] - q[0] + p["gaps"][0], q[0] + p["gaps"][1]]),
    normals=lambda p, q: np.array([[-1.0, 1.0], [1.0, 0.0]]),
    turning=lambda p, q, v: np.zeros(2),
    draw=_two_draw,
    laws=tuple(LAWS),
    end=2.0,
)

# A cart between walls that is pushed to one of them and carries a pendulum.


def _cart_draw(rng: np.random.Generator) -> tuple[Parameters, Vector, Vector]:
    p = {
        "masses": rng.uniform(0.5, 2, 2),
        "length": rng.uniform(0.3, 1),
        "damping": rng.uniform(0, 0.3, 2),
        "push": rng.uniform(-10, 10),
        "walls": rng.uniform(0.1, 0.4, 2),
    }
    q = np.array([rng.uniform(-0.09, 0.09), rng.uniform(-2, 2)])
    return p, q, rng.uniform(-2, 2, 2)


def _cart_matrix(p: Parameters, q: Vector) -> Vector:
    (cart, bob), length = p["masses"], p["length"]
    mixed = bob * length * np.cos(q[1])
    return np.array([[cart + bob, mixed], [mixed, bob * length**2]])


def _cart_force(p: Parameters, q: Vector, v: Vector) -> Vector:
    turn = p["masses"][1] * p["length"] * np.sin(q[1])
    return np.array([turn * v[1] ** 2 + p["push"], -G * turn]) - p["damping"] * v


CART_PENDULUM = Equations(
    matrix=_cart_matrix,
    force=_cart_force,
    gaps=lambda p, q: np.array([q[0] + p["walls"][0], p["walls"][1] - q[0]]),
    normals=lambda p, q: np.array([[1.0, 0.0], [-1.0, 0.0]]),
    turning=lambda p, q, v: np.zeros(2),
    draw=_cart_draw,
    laws=tuple(LAWS),
    end=2.0,
)

# A double pendulum whose end meets a vertical wall; both angles are measured from the vertical.


def _double_draw(rng: np.random.Generator) -> tuple[Parameters, Vector, Vector]:
    while True:
        p = {
            "masses": rng.uniform(0.5, 2, 2),
            "lengths": rng.uniform(0.3, 1, 2),
            "damping": rng.uniform(0, 0.2, 2),
            "wall": rng.uniform(-0.3, 0.3),
        }
        q = rng.uniform(-1.2, 1.2, 2)
        if _double_gap(p, q)[0] > 0.05:
            return p, q, rng.uniform(-2, 2, 2)


def _double_gap(p: Parameters, q: Vector) -> Vector:
    return np.array([p["lengths"] @ np.sin(q) + p["wall"]])


def _double_matrix(p: Parameters, q: Vector) -> Vector:
    (m1, m2), (l1, l2) = p["masses"], p["lengths"]
    mixed = m2 * l1 * l2 * np.cos(q[0] - q[1])
    return np.array([[(m1 + m2) * l1**2, mixed], [mixed, m2 * l2**2]])


def _double_force(p: Parameters, q: Vector, v: Vector) -> Vector:
    (m1, m2), (l1, l2) = p["masses"], p["lengths"]
    turn = m2 * l1 * l2 * np.sin(q[0] - q[1])
    weight = G * np.array([(m1 + m2) * l1, m2 * l2]) * np.sin(q)
    return np.array([-turn * v[1] ** 2, turn * v[0] ** 2]) - weight - p["damping"] * v


DOUBLE_PENDULUM = Equations(
    matrix=_double_matrix,
    force=_double_force,
    gaps=_double_gap,
    normals=lambda p, q: (p["lengths"] * np.cos(q))[None],
    turning=lambda p, q, v: np.array([-(p["lengths"] * np.sin(q)) @ v**2]),
    draw=_double_draw,
    laws=tuple(LAWS)[:4],
    end=2.0,
)

# Eight masses linked by damped springs that fall on a wall; a stop between the last two.


def _chain_draw(rng: np.random.Generator) -> tuple[Parameters, Vector, Vector]:
    p = {
        "masses": rng.uniform(0.5, 2, 8),
        "stiffness": rng.uniform(200, 1000, 7),
        "damping": rng.uniform(0, 2, 7),
        "gravity": rng.uniform(0, 10),
        "gaps": rng.uniform(0.02, 0.2, 2),
    }
    return p, rng.uniform(-0.01, 0.01, 8), rng.uniform(-0.3, 0.3, 8) - rng.uniform(0, 2)


def _chain_force(p: Parameters, q: Vector, v: Vector) -> Vector:
    pull = p["stiffness"] * np.diff(q) + p["damping"] * np.diff(v)
    return np.append(pull, 0.0) - np.append(0.0, pull) - p["masses"] * p["gravity"]


CHAIN = Equations(
    matrix=lambda p, q: np.diag(p["masses"]),
    force=_chain_force,
    gaps=lambda p, q: np.array([q[0] + p["gaps"][0], q[7] - q[6] + p["gaps"][1]]),
    normals=lambda p, q: np.array([[1.0] + [0.0] * 7, [0.0] * 6 + [-1.0, 1.0]]),
    turning=lambda p, q, v: np.zeros(2),
    draw=_chain_draw,
    laws=tuple(LAWS),
    end=1.0,
)

SYSTEMS = {
    "two-masses": TWO_MASSES,
    "cart-pendulum": CART_PENDULUM,
    "double-pendulum": DOUBLE_PENDULUM,
    "chain": CHAIN,
}
