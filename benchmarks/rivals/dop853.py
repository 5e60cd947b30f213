"""Writes the source of one unrolled DOP853 step for the pendulum at a stop, for Numba to compile.

Unrolled means: one line a stage, zero coefficients left out, the state in scalars, a code path a
mode. In stage i the angle is x + d{i}, the velocity v{i}, w{i} = h v{i}, and g{i} is h times the
acceleration; `sin0` and `cos0` belong to x, and the sine of a stage comes from the addition
theorem, which needs no range reduction and so has half the latency. The tangents (derivatives by
parameters) lie in rows of a workspace, so that the compiler takes a row as a vector.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from . import tasks

FLIGHT, CONTACT = "flight", "contact"
STAGES = 16
W = [f"w{i}" for i in range(1, STAGES + 1)]
G = [f"g{i}" for i in range(1, STAGES + 1)]


class Plan(NamedTuple):
    """What a kernel is to do: its law, with a moving base or not, with so many tangents or none."""

    law: str
    forced: bool = False
    tangents: int = 0

    @property
    def width(self) -> int:
        """The length of a row of tangents: a whole number of vectors of four."""
        return -(-self.tangents // 4) * 4

    def row(self, name: str) -> str:
        """Element q of a named row of the workspace."""
        return f"rows[{ROWS.index(name) * self.width} + q]"

    def loop(self, *lines: str) -> list[str]:
        """The lines for each tangent."""
        return [f"for q in range({self.width}):", *indented(lines)] if self.tangents else []


ROWS = [
    *("X", "V", "X13", "V13", "E0", "E1", "E2", "E3"),
    *(f"{name}{i}" for name in ("W", "G") for i in range(1, STAGES + 1)),
    *(f"{name}{i}" for name in ("P", "Q") for i in range(8)),
]


def indented(lines: Iterable[str]) -> list[str]:
    return ["    " + line for line in lines]


def combination(weights: Sequence[float] | np.ndarray, names: Iterable[str]) -> str:
    """A sum of weighted names without its zero terms."""
    terms = zip(weights, names, strict=False)
    return " + ".join(f"{float(w)!r}*{name}" for w, name in terms if w) or "0.0"


def horner(name: str, s: str, top: int = 7) -> str:
    """The value of a polynomial with coefficients `{name}0` ... `{name}{top}`."""
    text = f"{name}{top}"
    for k in range(top - 1, -1, -1):
        text = f"({text})*{s} + {name}{k}"
    return text


def horner_slope(name: str, s: str) -> str:
    """The derivative by s of a polynomial of degree 7."""
    text = f"7.0*{name}7"
    for k in range(6, 0, -1):
        text = f"({text})*{s} + {float(k)}*{name}{k}"
    return text


def _rate(plan: Plan, mode: str, i: int, c: float) -> list[str]:
    """g{i}, and with tangents the coefficients of their equation."""
    lines = []
    if mode == FLIGHT or plan.forced:
        lines += [
            f"u{i} = d{i}*d{i}",
            f"sn{i} = d{i}*sine_near(u{i})",
            f"cn{i} = cosine_near(u{i})",
            f"sx{i} = sin0*cn{i} + cos0*sn{i}",
            f"cx{i} = cos0*cn{i} - sin0*sn{i}",
        ]
    pull = f"sx{i}" if mode == FLIGHT else f"(x + d{i})"
    lines += [f"g{i} = hd*v{i} + hk*{pull}"]
    if plan.forced:
        lines[-1] += f" + h*push*sine(frequency*(t + {float(c)!r}*h))*cx{i}"
    return lines + (_tangent_terms(mode, i, pull) if plan.tangents else [])


def _tangent_terms(mode: str, i: int, pull: str) -> list[str]:
    """h times the acceleration's derivatives by the angle and by the mode's own parameters."""
    if mode == FLIGHT:
        first, second, slope = f"h2z*v{i} + h2n*{pull}", f"h2n*v{i}", f"hk*cx{i}"
    else:
        first, second, slope = f"h2n*v{i}", f"h2z*v{i} + h2n*{pull}", "hk"
    return [f"slope{i} = {slope}", f"first{i} = {first}", f"second{i} = {second}"]


def _tangent_stage(plan: Plan, mode: str, i: int, weights: np.ndarray) -> list[str]:
    own = ("E0", "E1") if mode == FLIGHT else ("E2", "E3")
    w = [plan.row(f"W{j}") for j in range(1, STAGES + 1)]
    g = [plan.row(f"G{j}") for j in range(1, STAGES + 1)]
    kept = [f"{plan.row('X13')} = xs", f"{plan.row('V13')} = vs"] if i == 13 else []
    return plan.loop(
        f"xs = {plan.row('X')} + {combination(weights, w)}",
        f"vs = {plan.row('V')} + {combination(weights, g)}",
        f"{plan.row(f'W{i}')} = h*vs",
        f"{plan.row(f'G{i}')} = hd*vs + slope{i}*xs"
        f" + first{i}*{plan.row(own[0])} + second{i}*{plan.row(own[1])}",
        *kept,
    )


def _stage(plan: Plan, mode: str, i: int, weights: np.ndarray, c: float) -> list[str]:
    lines = [
        f"d{i} = {combination(weights, W)}",
        f"v{i} = v + {combination(weights, G)}",
        f"w{i} = h*v{i}",
    ]
    return lines + _rate(plan, mode, i, c) + _tangent_stage(plan, mode, i, weights)


def step(plan: Plan, mode: str) -> list[str]:
    """The twelve stages, the new state (x13, v13, h a13 = g13) and the two error estimates."""
    lines = [f"hd = -h*{mode}_damping", f"hk = -h*{mode}_stiffness"]
    if plan.tangents:
        lines += [f"h2n = -2.0*h*{mode}_omega", f"h2z = -2.0*h*{mode}_zeta"]
        lines += [*_stage(plan, mode, 1, np.zeros(0), 0.0)]
    else:
        lines += ["w1 = h*v", "g1 = h*a"]
    for i in range(2, 13):
        lines += _stage(plan, mode, i, DOP853.A[i - 1], DOP853.C[i - 1])
    lines += [*_stage(plan, mode, 13, DOP853.B, 1.0), "x13 = x + d13"]
    for name in ("E3", "E5"):
        weights = getattr(DOP853, name)
        lines += [
            f"{name}x = ({combination(weights, W)})*inverse_scale_x",
            f"{name}v = ({combination(weights, G)})*inverse_scale_v",
        ]
    return lines


def dense_stages(plan: Plan, mode: str) -> list[str]:
    """The three more stages of the dense output."""
    lines = []
    for i, weights, c in zip(range(14, 17), DOP853.A_EXTRA, DOP853.C_EXTRA, strict=True):
        lines += _stage(plan, mode, i, weights, c)
    return lines


def _monomials() -> np.ndarray:
    """Powers of s (columns) of the seven basis functions of DOP853's dense output (rows)."""
    rows, basis = np.zeros((7, 8)), np.polynomial.Polynomial([1.0])
    for i in range(7):
        basis = basis * np.polynomial.Polynomial([0.0, 1.0] if i % 2 == 0 else [1.0, -1.0])
        rows[i, : basis.coef.size] = basis.coef
    return rows


def _polynomial(start: str, change: str, rates: list[str], targets: list[str]) -> list[str]:
    f = [f"f{i}" for i in range(7)]
    lines = [
        f"f0 = {change}",
        f"f1 = {rates[0]} - f0",
        f"f2 = 2.0*f0 - ({rates[12]} + {rates[0]})",
        *(f"f{3 + i} = {combination(DOP853.D[i], rates)}" for i in range(4)),
        f"{targets[0]} = {start}",
    ]
    powers = _monomials()
    return lines + [f"{targets[k]} = {combination(powers[:, k], f)}" for k in range(1, 8)]


def angle_polynomial(plan: Plan) -> list[str]:
    """p0 ... p7: the angle as a polynomial in s = (time - t)/h; rows P0 ... P7: its tangents."""
    lines = _polynomial("x", "d13", W, [f"p{k}" for k in range(8)])
    rates, targets = _rows(plan, "W"), [plan.row(f"P{k}") for k in range(8)]
    x, x13 = plan.row("X"), plan.row("X13")
    return lines + plan.loop(*_polynomial(x, f"{x13} - {x}", rates, targets))


def velocity_polynomial(plan: Plan) -> list[str]:
    """q0 ... q7 and rows Q0 ... Q7: the same of the velocity."""
    lines = _polynomial("v", "v13 - v", G, [f"q{k}" for k in range(8)])
    rates, targets = _rows(plan, "G"), [plan.row(f"Q{k}") for k in range(8)]
    v, v13 = plan.row("V"), plan.row("V13")
    return lines + plan.loop(*_polynomial(v, f"{v13} - {v}", rates, targets))


def _rows(plan: Plan, name: str) -> list[str]:
    return [plan.row(f"{name}{i}") for i in range(1, STAGES + 1)]


def parameter_rows(plan: Plan) -> list[tuple[str, int]]:
    """Rows with a single one, at the tangent by ωn, ζ and the law's own parameters."""
    pairs = [("E0", 0), ("E1", 1), ("E2", 2)]
    return pairs + ([("E3", 3)] if plan.law == tasks.KELVIN_VOIGT else [])
