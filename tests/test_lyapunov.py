"""Lyapunov exponents, diagrams, and their exact identities."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from forced_systems import MODEL_V, REST, ModelV
from impactjax._response.repetition import in_units, periods_of
from tiers import mostly_thorough

PERIOD = 2 * np.pi / 0.81
COUNT = 1024
MEMORY = ij.WithMemory()


@pytest.fixture(scope="module")
def both():
    """A motion on an orbit and a chaotic one, side by side."""

    def exponents(amplitude):
        system = ModelV(amplitude, jnp.array(0.81))
        return ij.lyapunov(system, REST, PERIOD, count=COUNT, settle=256)

    return jax.vmap(exponents)(jnp.array([0.36, 0.3465]))


def test_exponents_of_an_orbit_are_those_of_its_multipliers(both):
    """log |μ| over the period."""
    expected = np.log(np.abs(0.43378114 + 0.49731712j)) / (2 * PERIOD)
    np.testing.assert_allclose(both.values[0], [expected] * 2, atol=2e-4)


def test_chaotic_exponent_lies_within_its_error(both):
    """0.0233 ± 0.0001 by a long run of another program."""
    assert 0 < both.errors[1, 0] < 0.003
    assert abs(both.values[1, 0] - 0.0233) < 4 * both.errors[1, 0]


def test_sum_of_exponents_is_exact(both):
    """The volume changes by −b in time and by r² at each impact: the rest is a whole number."""
    time = COUNT * PERIOD
    impacts = (np.asarray(both.sum) + 0.04) * time / (2 * np.log(0.9))
    assert impacts[0] == pytest.approx(COUNT / 2, abs=1e-6)
    assert impacts[1] == pytest.approx(np.round(impacts[1]), abs=1e-6)
    assert impacts[1] != impacts[0]


@pytest.mark.parametrize("sweep", mostly_thorough([MEMORY, ij.FreshStarts()], MEMORY))
def test_diagram_over_an_orbit_of_two_periods(sweep):
    """The states at the last value are those of a section there."""
    values = np.linspace(0.38, 0.36, 5)
    found = ij.diagram(
        MODEL_V,
        REST,
        ModelV.period,
        lambda system: system.amplitude,
        values,
        sweep=sweep,
        keep=16,
        skip=300,
    )
    np.testing.assert_array_equal(found.period, 2)
    later = ij.section(MODEL_V, REST, ij.Every(PERIOD), keep=2, skip=300)
    np.testing.assert_allclose(
        np.sort(found.states["v"][-1, :2]), np.sort(later.after["v"]), atol=1e-6
    )


@pytest.mark.parametrize(
    ("states", "period"),
    [
        (np.tile([1.0, 2.0, 4.0], 4), 3),
        (np.full(12, 3.0), 1),
        (np.arange(12.0), 0),
        (np.tile([1.0, 2.0, 1.0, 2.0 + 1e-3], 3), 4),
    ],
)
def test_period_of_states(states, period):
    rows = jnp.asarray(states)[None, :, None]
    assert periods_of(in_units(rows, jnp.max(jnp.abs(rows))), 1e-6) == period
