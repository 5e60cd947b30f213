"""Values of parameters, of the start and of the times never cause a retrace."""

import jax.numpy as jnp
import numpy as np

import impactjax as ij

TRACED = []


class Decay(ij.HybridSystem):
    """A decay that is doubled at a level; its rate is a plain number."""

    rate: float
    level: float

    def flow(self, t, y, mode):
        TRACED.append(1)
        return -self.rate * y

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: y - self.level, lambda t, y, mode: (2 * y, mode))]


def count(call):
    before = len(TRACED)
    call()
    return len(TRACED) - before


def test_values_cause_no_retrace():
    def run(rate, first, last):
        return ij.solve(Decay(rate, 0.7), ij.Start(0.0, first), [0.5, last], max_events=4)

    assert count(lambda: run(1.0, 1.0, 1.0)) > 0
    assert count(lambda: run(1.5, 1.2, 2.0)) == 0
    np.testing.assert_allclose(run(0.5, 1.0, 0.6).ys, np.exp([-0.25, -0.3]), rtol=1e-9)


def test_values_cause_no_retrace_of_a_section():
    def run(rate, period):
        system, start = Decay(rate, 0.7), ij.Start(0.0, jnp.array(1.0))
        return ij.section(system, start, ij.Every(period), keep=2, skip=1)

    assert count(lambda: run(1.0, 0.3)) > 0
    assert count(lambda: run(0.9, 0.25)) == 0
