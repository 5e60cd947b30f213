"""Lyapunov exponents, diagrams, and their exact identities."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from forced_systems import MODEL_V, REST, ModelV
from impactjax._response.diagram import period_of

PERIOD = 2 * np.pi / 0.81
COUNT = 1024


class Counted(ij.HybridSystem):
    """Model V, with a count of its impacts."""

    model: ModelV

    def flow(self, t, y, mode):
        return {**self.model.flow(t, y, mode), "n": jnp.zeros_like(t)}

    def transitions(self):
        def impact(t, y, mode):
            after, mode = self.model.impact(t, y, mode)
            return {**after, "n": y["n"] + 1}, mode

        return [ij.Transition(lambda t, y, mode: -y["x"], impact)]


def exponents(amplitude, settle, count=COUNT):
    system = Counted(ModelV(amplitude, jnp.array(0.81)))
    start = ij.Start(0.0, {**REST.y, "n": 0.0})
    return ij.lyapunov(system, start, PERIOD, count=count, settle=settle)


@pytest.fixture(scope="module")
def both():
    """A motion on an orbit and a chaotic one, side by side."""
    return jax.vmap(lambda amplitude: exponents(amplitude, 256))(jnp.array([0.36, 0.3465]))


def test_exponents_of_an_orbit_are_those_of_its_multipliers(both):
    """log |μ| over the period, with the zero of the count."""
    expected = np.log(np.abs(0.43378114 + 0.49731712j)) / (2 * PERIOD)
    np.testing.assert_allclose(both.values[0, 1:], [expected] * 2, atol=2e-4)
    np.testing.assert_allclose(both.values[0, 0], 0.0, atol=1e-12)


def test_chaotic_exponent_lies_within_its_error(both):
    """0.0233 ± 0.0001 by a long run of another program."""
    assert 0 < both.errors[1, 0] < 0.003
    assert abs(both.values[1, 0] - 0.0233) < 4 * both.errors[1, 0]


def test_sum_of_exponents_is_exact(both):
    """The volume changes by −b in time and by r² at each impact."""
    long, short = both.growth[1].sum(), exponents(jnp.array(0.3465), 256, COUNT // 2)
    impacts = both.final.y["n"][1] - short.final.y["n"]
    time = COUNT // 2 * PERIOD
    found = (long - short.growth.sum()) / time
    np.testing.assert_allclose(found, -0.04 + 2 * np.log(0.9) * impacts / time, atol=1e-9)
    np.testing.assert_allclose(both.values.sum(1), both.sum, atol=1e-15)


def test_diagram_with_and_without_memory():
    """From large amplitudes down, the motion with memory stays on the orbit of two periods."""
    values = np.linspace(0.38, 0.36, 5)
    shared = dict(keep=16, skip=300)

    def swept(sweep):
        return ij.diagram(
            MODEL_V, REST, ModelV.period, lambda s: s.amplitude, values, sweep=sweep, **shared
        )

    memory, fresh = swept(ij.WithMemory()), swept(ij.FreshStarts())
    np.testing.assert_array_equal(memory.period, 2)
    np.testing.assert_array_equal(fresh.period, 2)
    own, other = np.sort(memory.states["v"], axis=1), np.sort(fresh.states["v"], axis=1)
    np.testing.assert_allclose(own, other, atol=1e-6)


@pytest.mark.parametrize(
    ("states", "period"),
    [
        (np.tile([1.0, 2.0, 4.0], 5), 3),
        (np.full(8, 3.0), 1),
        (np.arange(12.0), 0),
        (np.tile([1.0, 2.0, 1.0, 2.0 + 1e-3], 4), 4),
    ],
)
def test_period_of_states(states, period):
    assert period_of(jnp.asarray(states)[:, None], 1e-6) == period
