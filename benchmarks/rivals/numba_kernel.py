"""Assembles the steps of `dop853` into a simulation with samples, compiled by Numba."""
# pyright: reportMissingImports=false

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import njit

from . import dop853, tasks
from .dop853 import CONTACT, FLIGHT, Plan, horner, horner_slope, indented

# A step with a stage further than this from its start leaves the polynomials' range and is retaken.
REACH = 0.8
Array = np.ndarray
EXACT = {"contract", "nsz", "arcp"}


def _even_polynomial(function: Callable[[Array], Array], reach: float, count: int) -> str:
    """The source of a polynomial in u = y² for an even function of y on |y| ≤ reach."""
    nodes = reach**2 * (0.5 - 0.5 * np.cos(np.pi * (np.arange(60) + 0.5) / 60))
    values = function(np.sqrt(nodes))
    fit = np.polynomial.Chebyshev.fit(nodes, values, count - 1, domain=[0, reach**2])
    return _estrin(fit.convert(kind=np.polynomial.Polynomial).coef.tolist(), "u")


def _estrin(coefficients: list[float], u: str) -> str:
    """A polynomial in pairs: half the latency of Horner's rule."""
    if len(coefficients) == 1:
        return repr(coefficients[0])
    pairs = [coefficients[i : i + 2] for i in range(0, len(coefficients), 2)]
    terms = [f"({p[0]!r} + {p[1]!r}*{u})" if len(p) == 2 else repr(p[0]) for p in pairs]
    text = terms[-1]
    for term in reversed(terms[:-1]):
        text = f"({term} + ({text})*u2)"
    return text


def _compile(
    source: str, name: str, names: dict[str, Any], fast: bool | set[str]
) -> Callable[..., Any]:
    space = dict(names)
    exec(source, space)
    return njit(fastmath=fast, error_model="numpy", boundscheck=False)(space[name])


def _sines() -> dict[str, Any]:
    """sine of any x, and of u = d² ≤ REACH²: sine_near = sin(d)/d, cosine_near = cos(d)."""
    sine_ratio = _even_polynomial(lambda y: np.sinc(y / np.pi), np.pi / 2 + 1e-3, 10)
    near = [
        ("sine_near", _even_polynomial(lambda y: np.sinc(y / np.pi), REACH, 6)),
        ("cosine_near", _even_polynomial(np.cos, REACH, 7)),
    ]
    sine = f"""
def sine(x):
    n = math.floor(x*{1 / math.pi!r} + 0.5)
    y = (x - n*{math.pi!r}) - n*1.2246467991473532e-16
    u = y*y
    u2 = u*u
    s = y*({sine_ratio})
    return s if (int(n) & 1) == 0 else -s
"""
    compiled: dict[str, Any] = {"math": math}
    compiled["sine"] = _compile(sine, "sine", compiled, EXACT)
    for name, text in near:
        source = f"def {name}(u):\n    u2 = u*u\n    return {text}\n"
        compiled[name] = _compile(source, name, compiled, EXACT)
    return compiled


def _start(plan: Plan) -> list[str]:
    """Everything before the loop."""
    contact = [
        "contact_omega = p[3]",
        "contact_zeta = p[2]",
        "contact_damping = 2.0*p[2]*p[3]",
        "contact_stiffness = p[3]*p[3]",
        # an angle error in contact comes out as a velocity error, ω0/ωn times larger
        "inverse_scale_contact = p[3]/(p[0]*tolerance)",
        "h_contact = 0.7/p[3]",
        "x = p[4]",
    ]
    lines = [
        "n = out.size",
        "flight_omega = p[0]",
        "flight_zeta = p[1]",
        "flight_damping = 2.0*p[0]*p[1]",
        "flight_stiffness = p[0]*p[0]",
        "inverse_scale_flight = 1.0/tolerance",
        "inverse_scale_v = 1.0/(tolerance*p[0])",
        "h_flight = 0.25/p[0]",
        *(contact if plan.law == tasks.KELVIN_VOIGT else ["r = p[2]", "x = p[3]"]),
        "v = 0.0",
        "t = 0.0",
        "i = 0",
        "contact = False",
        "rate = 1.0/spacing",
        "push = ratio*frequency*frequency",
        "sin0 = sine(x)",
        f"cos0 = sine(x + {0.5 * math.pi!r})",
        "a = -flight_stiffness*sin0",
    ]
    return lines + (_start_tangents(plan) if plan.tangents else [])


def _start_tangents(plan: Plan) -> list[str]:
    names = ("X", "V", *(row for row, _ in dop853.parameter_rows(plan)))
    lines = plan.loop(*(f"{plan.row(name)} = 0.0" for name in names))
    ones = [("X", plan.tangents - 1), *dop853.parameter_rows(plan)]
    return lines + [plan.row(row).replace("q", str(q)) + " = 1.0" for row, q in ones]


def _control(mode: str, plan: Plan) -> list[str]:
    """Accepts or rejects the step and sets the mode's next step length."""
    near = [f"abs(d{i})" for i in range(2, 14)]
    reach = [f"if max({', '.join(near)}) > {REACH}:", "    error = 2.0", "    factor = 0.5"]
    return [
        "e5 = E5x*E5x + E5v*E5v",
        "e3 = E3x*E3x + E3v*E3v",
        "error = e5*e5/(2.0*(e5 + 0.01*e3) + 1e-300)",
        "factor = 0.9/math.sqrt(math.sqrt(math.sqrt(math.sqrt(error + 1e-16))))",
        "factor = min(max(factor, 0.2), 6.0)",
        *(reach if mode == FLIGHT or plan.forced else []),
        f"h_{mode} = h*factor",
        "if error > 1.0:",
        "    continue",
    ]


def _root(mode: str) -> list[str]:
    """s where the angle leaves the mode's side, by Newton's method kept inside a bracket."""
    inside = "value > 0.0" if mode == FLIGHT else "value < 0.0"
    return [
        "s = x/(x - x13) if x != 0.0 else p1/(p1 - x13)",
        "low = 0.0",
        "high = 1.0",
        "for _ in range(60):",
        f"    value = {horner('p', 's')}",
        f"    if {inside}:",
        "        low = s",
        "    else:",
        "        high = s",
        f"    change = value/({horner_slope('p', 's')})",
        "    if low <= s - change <= high:",
        "        s -= change",
        # the next change would be of the order of this one's square
        "        if abs(change) < 1e-6:",
        "            break",
        "    else:",
        "        s = 0.5*(low + high)",
    ]


def _event(plan: Plan, mode: str) -> list[str]:
    """Ends the step on the stop and applies the law."""
    lines = [*_root(mode), "end = s*h", *dop853.velocity_polynomial(plan)]
    lines += [f"v13 = {horner('q', 's')}", "x13 = 0.0"]
    lines += ["j = min(n, int(math.floor((t + end - first)*rate)) + 1)"]
    force = "push*sine(frequency*(t + end))" if plan.forced else "0.0"
    if plan.law == tasks.RESTITUTION:
        lines += ["before = v13", "v13 = -r*v13"]
        after, change = FLIGHT, f"dv = -r*(vs - flight_damping*before*dt) - before*{plan.row('E2')}"
    else:
        after = CONTACT if mode == FLIGHT else FLIGHT
        lines += [f"contact = {mode == FLIGHT}", "before = v13"]
        change = f"dv = vs - {mode}_damping*before*dt"
    lines += [f"a = {force} - {after}_damping*v13", "g13 = h*a"]
    lines += plan.loop(*_saltation(plan, change, after))
    if plan.forced and after == FLIGHT:
        # a short hop must not pass unseen inside one step
        lines += ["if a < 0.0:", "    h_flight = min(h_flight, -1.5*v13/a)"]
    return lines


def _saltation(plan: Plan, change: str, after: str) -> list[str]:
    """The tangents after an event whose time depends on the parameters."""
    x = _row_horner(plan, "P")
    return [
        f"dt = -({x})/before",
        f"vs = {_row_horner(plan, 'Q')}",
        change,
        f"{plan.row('X13')} = -v13*dt",
        f"{plan.row('V13')} = dv + {after}_damping*v13*dt",
    ]


def _row_horner(plan: Plan, name: str) -> str:
    text = plan.row(f"{name}7")
    for k in range(6, -1, -1):
        text = f"({text})*s + {plan.row(f'{name}{k}')}"
    return text


def _samples(plan: Plan) -> list[str]:
    lines = [
        "base = (first - t)/h",
        "gap = spacing/h",
        "for k in range(i, j):",
        "    s = base + k*gap",
        f"    out[k] = {horner('p', 's')}",
    ]
    if plan.tangents:
        load = [f"c{k} = {plan.row(f'P{k}')}" for k in range(8)]
        inner = ["for k in range(i, j):", "    s = base + k*gap"]
        inner += [f"    derivatives[q, k] = {horner('c', 's')}"]
        lines += [f"for q in range({plan.tangents}):", *indented([*load, *inner])]
    return [*lines, "i = max(i, j)"]


def _dip(plan: Plan, mode: str) -> list[str]:
    """In forced flight: a step that dips below the stop and returns is retaken, to its dip only."""
    if not plan.forced or mode == CONTACT:
        return []
    return [
        "if v < 0.0 and v13 > 0.0 and not hit:",
        *indented(["low = v/(v - v13)", f"if {horner('p', 'low')} < 0.0:"]),
        *indented(indented(["h_flight = low*h", "continue"])),
    ]


def _pass(plan: Plan, mode: str) -> list[str]:
    """One pass of the loop in a mode."""
    beyond = "x13 < 0.0" if mode == FLIGHT else "x13 > 0.0"
    dense = [*dop853.dense_stages(plan, mode), *dop853.angle_polynomial(plan), *_dip(plan, mode)]
    dense += ["end = h", "if hit:", *indented(_event(plan, mode)), *_samples(plan), "t += end"]
    anchor = ["sin0 = sine(x)", f"cos0 = sine(x + {0.5 * math.pi!r})"]
    return [
        f"h = h_{mode}",
        f"inverse_scale_x = inverse_scale_{mode}",
        *dop853.step(plan, mode),
        *_control(mode, plan),
        f"hit = {beyond}",
        "j = min(n, int(math.floor((t + h - first)*rate)) + 1)",
        "if hit or j > i" + (" or (v < 0.0 and v13 > 0.0):" if plan.forced else ":"),
        *indented(dense),
        "else:",
        "    t += h",
        *("x = x13", "v = v13", "a = g13/h"),
        *(anchor if mode == FLIGHT or plan.forced else ["sin0 = 0.0", "cos0 = 1.0"]),
        *plan.loop(*(f"{plan.row(n)} = {plan.row(n + '13')}" for n in ("X", "V"))),
    ]


def source(plan: Plan) -> str:
    """The whole simulation as Python source."""
    body = [*_start(plan), "while i < n:"]
    if plan.law == tasks.RESTITUTION:
        body += indented(_pass(plan, FLIGHT))
    else:
        lines = ["if not contact:", *indented(_pass(plan, FLIGHT)), "else:"]
        body += indented([*lines, *indented(_pass(plan, CONTACT))])
    head = "def simulate(p, ratio, frequency, first, spacing, tolerance, out, derivatives, rows):"
    return "\n".join([head, *indented(body)]) + "\n"


@cache
def kernel(plan: Plan) -> Callable[..., Any]:
    """The compiled simulation: fills `out` and, with tangents, `derivatives`."""
    return _compile(source(plan), "simulate", _sines(), True)


@cache
def batch_kernel(plan: Plan) -> Callable[..., Any]:
    """The compiled loop over lanes, on one core."""
    simulate = kernel(plan)

    @njit
    def run(
        lanes: Array,
        first: float,
        spacing: float,
        tolerance: float,
        out: Array,
        derivatives: Array,
        rows: Array,
    ) -> None:
        for lane in range(lanes.shape[0]):
            simulate(
                *(lanes[lane], 0.0, 1.0, first, spacing, tolerance),
                *(out[lane], derivatives[lane], rows),
            )

    return run


def workspace(plan: Plan) -> Array:
    """The rows in which the tangents live."""
    return np.zeros(max(1, len(dop853.ROWS) * plan.width))
