"""Measurements of a contact and the law's parameters, against theory and closed forms."""

import functools
import math
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest

import impactjax as ij
from laws import AS_POWER_LAWS, FORCES, LAWS, MASS
from pages import assert_same_output, programs
from tiers import mostly_thorough, quick

PAGE = Path(__file__).parent.parent / "docs" / "couplings.md"
TIMES = jnp.arange(1401) / 1000  # as on the page
START = ij.InitialState(0.78)
FORCED = ij.HarmonicMotion(0.01, 2 * math.pi * 4.2)
SIMULATION = ij.Simulation(max_steps=1024)
WITH_FORCE = ["record, durations", "record, penetrations", "record, forces"]

BY_SPEEDS = {  # determined by rebound speeds alone
    "restitution": {"r"},
    "linear-restitution": {"r0", "alpha"},
    "power-restitution": {"r0", "alpha"},
    "kelvin-voigt": {"gamma"},
    "kelvin-voigt without pull": {"gamma"},
    "kelvin-voigt-linear-restitution": {"r0", "alpha"},
    "maxwell": {"gamma"},
    "walton": set(),
    "hertz": set(),
    "simon": {"c"},
    "hunt-crossley": {"c"},
    "pust-peterka": {"alpha"},
    "hertz-dashpot": set(),
    "power-law": set(),
}
PER_STIFFNESS = [[1, 0], [1, 1]]
COEFFICIENTS = {  # d log(k, C)/d log of the law's parameters, for F = k δⁿ + C δᵖ |δ′|^q sgn δ′
    "kelvin-voigt": [[2, 0], [1, 1]],
    "walton": [[1, 0], [0, 1]],
    "simon": PER_STIFFNESS,
    "hunt-crossley": PER_STIFFNESS,
    "pust-peterka": PER_STIFFNESS,
    "hertz-dashpot": [[1, 0], [0, 1]],
    "power-law": [[1, 0], [0, 1]],
}


def pendulum(law, base=None) -> ij.ImpactOscillator:
    oscillator = ij.Pendulum(omega_n=13.0, zeta=0.02, length=0.071, mass=MASS, base=base)
    return ij.ImpactOscillator(oscillator, ij.Stop(law))


def couplings(model, **settings) -> ij.Couplings:
    return ij.couplings(model, START, TIMES, simulation=SIMULATION, **settings)


@functools.cache
def told(name: str) -> ij.Couplings:
    return couplings(pendulum(LAWS[name].law), forced=FORCED)


def rebound_speeds_leave_the_dimensionless_group(name):
    """With the length l = (m v²/k)^(1/(n+1)), restitution depends on (C/k) l^(p−n) v^q alone, and
    so on C/k^e with e = (p+1)/(n+1).
    """
    n, p = AS_POWER_LAWS[name][2:4]
    null = np.array(told(name).measurements["rebound speeds"].directions.exponents)[-1]
    stiffness, damping = np.array(COEFFICIENTS[name]) @ null
    expected = math.atan((p + 1) / (n + 1))
    assert abs(math.degrees(math.atan(damping / stiffness) - expected)) < 0.1


def null_direction_is_that_of_the_thesis(name):
    null = np.array(told(name).measurements["rebound speeds"].directions.exponents)[-1]
    direction = np.array(COEFFICIENTS[name]) @ null
    along = direction @ [1, 1] / math.sqrt(2) / np.linalg.norm(direction)
    assert math.degrees(math.acos(min(along, 1.0))) < 0.1


def measurements_determine_what_they_should(name):
    found, force = told(name), name in FORCES
    further = ["record from two starts", "record with forcing"]
    measured = ["rebound speeds", "record", *(WITH_FORCE if force else []), *further]
    assert list(found.measurements) == measured
    by_speeds = dict(zip(found.names, found.bounds["rebound speeds"], strict=True))
    assert {each for each, bound in by_speeds.items() if bound < 0.1} == BY_SPEEDS[name]
    assert all(by_speeds[each] > 1e4 for each in {*found.names} - BY_SPEEDS[name])
    assert np.all(found.bounds["record"] < 0.1)
    for better in measured[2:-1]:
        assert np.all(found.bounds[better] < found.bounds["record"] * (1 + 1e-9)), better
    if force:  # what stiffness is determined by
        first = [found.bounds[each][0] for each in ["record", *WITH_FORCE]]
        assert max(first[1:]) < 0.75 * first[0]


def forcing_tells_the_group_best(name):
    n, p = AS_POWER_LAWS[name][2:4]
    group = np.array([-(p + 1) / (n + 1), 1.0]) @ np.array(COEFFICIENTS[name])
    found = told(name).measurements
    errors = {each: float(info.directions.error(group)) for each, info in found.items()}
    assert min(errors, key=lambda each: errors[each]) == "record with forcing"


def best(bounds, parameter):
    return min(bounds, key=lambda each: bounds[each][parameter])


def least(bounds, parameter):
    """The smallest bound by a record and a measurement of contacts."""
    return min(bounds[each][parameter] for each in WITH_FORCE)


CLAIMS = {  # of the sentences on the page, about `bounds` of the law
    "restitution": lambda bounds: best(bounds, 0) == "record with forcing",
    "linear-restitution": lambda bounds: bounds["record"][1] < bounds["rebound speeds"][1] / 2,
    "power-restitution": lambda bounds: (
        best(bounds, 0) == "record with forcing"
        and bounds["record with forcing"][1] > bounds["record"][1]
    ),
    "kelvin-voigt": lambda bounds: (
        max(bounds[each][0] for each in WITH_FORCE) < bounds["record"][0] / 2
    ),
    "kelvin-voigt-linear-restitution": lambda bounds: np.allclose(
        bounds["rebound speeds"][1:], told("linear-restitution").bounds["rebound speeds"], rtol=1e-3
    ),
    "maxwell": lambda bounds: (
        best(bounds, 0) == "record, penetrations"
        and np.isclose(
            bounds["rebound speeds"][1], told("kelvin-voigt").bounds["rebound speeds"][1], rtol=1e-3
        )
    ),
    "walton": lambda bounds: (
        max(bounds[each][0] for each in WITH_FORCE[1:]) < bounds["record"][0] / 2
    ),
    "hertz": lambda bounds: best(bounds, 0) == "record, forces",
    "simon": lambda bounds: (
        best(bounds, 0) == "record, forces" and best(bounds, 1) == "record with forcing"
    ),
    "hunt-crossley": lambda bounds: all(
        np.isclose(bounds[each][1], told("simon").bounds[each][1], rtol=0.02)
        and not np.isclose(bounds[each][0], told("simon").bounds[each][0], rtol=0.1)
        for each in bounds
        if each != "rebound speeds"
    ),
    "pust-peterka": lambda bounds: (
        best(bounds, 0) == "record, forces" and best(bounds, 1) == "record with forcing"
    ),
    "hertz-dashpot": lambda bounds: bounds["record with forcing"][1] < least(bounds, 1),
    "power-law": lambda bounds: np.all(bounds["record, forces"] < bounds["record"] / 4),
}


def power_law_is_told_by_one_combination():
    found = told("power-law")
    error = float(found.measurements["record"].directions.error(np.array([-0.8, 1.0])))
    assert np.all(found.bounds["record"] > 9 * error)


def stiffness_without_effect_costs_nothing(name):
    speeds = told(name).measurements["rebound speeds"]
    alone = 1 / np.linalg.norm(np.asarray(speeds.sensitivities)[:, 1])
    expected = np.array([np.inf, alone])
    np.testing.assert_allclose(told(name).bounds["rebound speeds"], expected, rtol=1e-9)


def page_prints_what_it_says(name):
    """The table of the law on the page, and for one law the page's own function."""
    (definitions, _), *blocks = programs(PAGE.read_text())
    laws: list[Any] = []
    tables = {}
    for block, promised in blocks:
        exec(block.text, {"ij": ij, "told": laws.append})
        tables[repr(laws[-1])] = promised
    assert_same_output(str(told(name)), tables[repr(LAWS[name].law)])
    if name == "walton":
        namespace: dict[str, Any] = {}
        exec(definitions.text, namespace)
        assert str(namespace["told"](LAWS[name].law)) == str(told(name))


@pytest.mark.parametrize("name", mostly_thorough(LAWS, "restitution", "walton"))
def test_all_that_is_known_of_a_law(name):
    """In one test, since the couplings of a law take long."""
    measurements_determine_what_they_should(name)
    if name in CLAIMS:
        assert CLAIMS[name](told(name).bounds)
        page_prints_what_it_says(name)
    if name in COEFFICIENTS:
        rebound_speeds_leave_the_dimensionless_group(name)
        forcing_tells_the_group_best(name)
    if name in ("walton", "simon"):
        null_direction_is_that_of_the_thesis(name)
    if name in ("simon", "pust-peterka"):
        stiffness_without_effect_costs_nothing(name)
    if name == "power-law":
        power_law_is_told_by_one_combination()


def test_restitution_of_hertz_with_dashpot_depends_on_one_group():
    @jax.jit
    def restitution(k, c, v, m):
        return ij.single_impact(ij.HertzDashpot(k, c), v, m).restitution

    usual = restitution(1e6, 2.0, 0.5, MASS)
    assert 0.1 < usual < 0.9
    for factors in [(32, 4, 1, 1), (1, 2, 32, 1), (1, 8, 1, 32)]:  # of k, c, v and m
        same = restitution(*np.multiply(factors, (1e6, 2.0, 0.5, MASS)))
        np.testing.assert_allclose(same, usual, rtol=1e-6)
    assert abs(restitution(32e6, 2.0, 0.5, MASS) - usual) > 0.1


def test_bound_of_a_restitution_and_table():
    found = told("restitution")
    speeds = found.measurements["rebound speeds"]
    approach = np.asarray(speeds.sensitivities)[:, 0] * 1e-3 / 0.6
    known = 1e-3 / (0.6 * np.linalg.norm(approach))
    np.testing.assert_allclose(found.bounds["rebound speeds"], [known], rtol=1e-9)
    header, first, *_ = str(found).splitlines()
    assert header.split() == ["Restitution", "r"]
    assert first.split() == ["rebound", "speeds", f"{100 * known:.2f}", "%"]


def test_table_tells_combinations():
    header, *rows = (line.split("  ") for line in str(told("walton")).splitlines())
    assert [cell.strip() for cell in header if cell] == ["Walton", "k", "c", "combinations"]
    cells = [[cell.strip() for cell in row if cell] for row in rows]
    assert cells[0][:3] == ["rebound speeds", "-", "-"]
    assert cells[0][3].startswith("c/k to ")
    assert cells[0][3].endswith("; not k at fixed c/k")
    assert len(cells[2]) == 3  # durations determine both parameters as well as any combination


def test_base_at_rest_is_no_base():
    rigid = pendulum(ij.Restitution(0.6))
    alone = couplings(rigid)
    for name, bounds in alone.bounds.items():
        np.testing.assert_allclose(bounds, told("restitution").bounds[name], rtol=1e-5)


def test_model_on_a_moving_base_keeps_it():
    moving = couplings(pendulum(ij.Restitution(0.6), base=FORCED), forced=FORCED)
    for name in ("record", "record with forcing"):
        expected = told("restitution").bounds["record with forcing"]
        np.testing.assert_allclose(moving.bounds[name], expected, rtol=1e-9)


def test_two_starts_share_the_model_only():
    two = told("restitution").measurements["record from two starts"]
    assert {"omega_n", "zeta", "theta0[0]", "theta0[1]"} <= {*two.names}


def test_figure():
    found = told("walton")
    ax = ij.plot.couplings(plt.figure().subplots(), found)
    assert [label.get_text() for label in ax.get_yticklabels()] == list(found.measurements)
    assert ax.texts[0].get_text() == "c/k"
    legend = ax.get_legend()
    assert legend is not None
    assert ax.get_title(loc="left") == "Walton"
    assert [text.get_text() for text in legend.get_texts()] == ["k", "c"]
    points, arrows = (
        [line for line in ax.lines if line.get_marker() == marker] for marker in ("o", ">")
    )
    assert [np.isfinite(np.asarray(line.get_xdata())).sum() for line in points] == [6, 6]
    assert [np.isfinite(np.asarray(line.get_xdata())).sum() for line in arrows] == [1, 1]


def test_refused_motions():
    ball = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.6)))
    with pytest.raises(ValueError, match="no lower stop"):
        couplings(ij.ImpactOscillator(ij.BouncingBall()))
    with pytest.raises(ValueError, match="no complete impact"):
        ij.couplings(ball, ij.InitialState(100.0), TIMES)
    forced = ij.HarmonicMotion(0.01, 20.0)
    thrown = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.Restitution(0.6)))
    with pytest.raises(ValueError, match="cannot move"):
        ij.couplings(thrown, ij.InitialState(0.1, -1.0), TIMES, forced=forced)


@quick
def test_refused_accuracy():
    with pytest.raises(ValueError, match="accuracy of a duration must be positive, and is 0"):
        couplings(pendulum(ij.Restitution(0.6)), accuracy=ij.Accuracy(duration=0.0))
