"""Gradient descent through the simulator, against laws unknown to it and against SciPy."""

import functools
import math
import operator
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
from jaxtyping import Array
from matplotlib.figure import Figure
from scipy import optimize

import impactjax as ij
from estimates import SMALL
from tiers import thorough

GRAVITY = 9.80665
COUNT, NOISE = 40, 1e-4
KNOTS = np.geomspace(0.2, 3.0, 10)
EFFORT = ij.Simulation(max_steps=128)


def softening(v):
    """Elastic below, plastic above, and between: r falls from 0.92 to 0.80 around 1.5 m/s."""
    return 0.80 + 0.12 / (1 + (v / 1.5) ** 6)


def bounces(restitution, speed=3.0, start=0.3, count=COUNT):
    """Times of a ball's impacts and its approach speeds: a flight at speed u lasts 2 u / g."""
    times, speeds = [start], []
    for _ in range(count - 1):
        times.append(times[-1] + 2 * speed / GRAVITY)
        speeds.append(speed)
        speed = float(restitution(speed)) * speed
    return np.array(times), np.array(speeds)


def heard(restitution, seed=0):
    times, _ = bounces(restitution)
    noise = NOISE * np.random.default_rng(seed).standard_normal(COUNT)
    return ij.ImpactTimes(jnp.asarray(times + noise))


NAMED = {
    "restitution": (lambda p, v: p[0], [0.88]),
    "linear": (lambda p, v: p[0] - p[1] * v, [0.94, 0.044]),
    "power": (lambda p, v: min(p[0] * v ** -p[1], 1), [0.89, 0.03]),
}


@functools.cache
def by_scipy(name, seed=0):
    """The named law that is nearest to what was heard, by another simulator and optimiser."""
    law, start = NAMED[name]
    times = np.asarray(heard(softening, seed).times)

    def residuals(p):
        return bounces(lambda v: law(p, v), p[-2], p[-1])[0] - times

    found = optimize.least_squares(
        residuals, [*start, 2.8, 0.3], x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    covariance = np.linalg.inv(found.jac.T @ found.jac) * 2 * found.cost / (COUNT - len(found.x))
    return found.x, covariance, math.sqrt(2 * found.cost / COUNT)


def ball(law):
    return ij.ImpactOscillator(ij.BouncingBall(GRAVITY), ij.Stop(law))


def weights_of(system):
    return system.model.lower.law.weights


def learned(recording, law, told=None):
    start = ij.InitialState(0.0, 2.9)
    experiment = ij.Experiment(ball(law), recording, start, simulation=EFFORT)
    return ij.learn(experiment, where=weights_of, progress=told)


@functools.cache
def of_softening():
    told = []
    r0, alpha, *_ = by_scipy("linear")[0]
    law = ij.LearnedRestitution.like(ij.LinearRestitution(r0, alpha), KNOTS)
    return learned(heard(softening), law, told.append), told


# A material between the named ones: what no law describes is found all the same.


def test_learn_recovers_unnamed_law():
    found, _ = of_softening()
    assert found.converged
    assert found.rms < 1.1 * NOISE
    least = min(by_scipy(name)[2] for name in NAMED)
    assert least > 50 * NOISE
    _, speeds = bounces(softening)
    v = np.linspace(speeds.min(), speeds.max(), 200)
    middle, _ = ij.restitution_band(found, v)
    np.testing.assert_allclose(middle, softening(v), rtol=5e-3)
    assert abs(float(found.value("x_dot0")) - 3) < 3e-3
    assert abs(float(found.value("t0")) - 0.3) < 3e-4


def test_band_is_infinite_beyond_impact_speeds():
    found, _ = of_softening()
    v = found.impacts.approach_speed[found.impacts.happened]
    _, errors = ij.restitution_band(found, np.array([v.min() / 2, 1.0, 2.0, v.max() * 1.1]))
    assert np.all(np.isinf(np.asarray(errors)) == [True, False, False, True])


def test_learn_reports_progress():
    found, told = of_softening()
    assert told[0].startswith("0 of 50 rounds, rms residual 0.0")
    assert told[-1].startswith(f"{len(told) - 1} of 50 rounds, rms residual {float(found.rms):.4g}")
    costs = np.asarray(found.costs)
    taken = int(found.iterations)
    assert np.all(np.isfinite(costs[:taken]))
    assert np.all(np.isnan(costs[taken:]))
    np.testing.assert_allclose(np.min(costs[:taken]), found.rms**2 * COUNT / 2, rtol=1e-6)
    assert found.refused == 0


@thorough
def test_restitution_band_coverage():
    truth = ij.LearnedRestitution(KNOTS, np.array([2.6, *np.linspace(0.0, 1.2, 10), 5.0]))
    start = ij.LearnedRestitution.like(ij.LinearRestitution(0.9, 0.05), KNOTS)
    curve, v = eqx.filter_jit(truth.restitution), jnp.linspace(0.3, 2.5, 12)
    inside = []
    for seed in range(8):
        recording = heard(lambda v: curve(jnp.asarray(v)), seed)
        middle, errors = ij.restitution_band(learned(recording, start), v)
        inside.append(jnp.abs(middle - curve(v)) < 1.96 * errors)
    assert np.mean(inside) > 0.85


# The first-order alternative for a law with a name, many recordings at once.


@functools.cache
def named():
    def one(times):
        return ij.learn(
            ij.Experiment(
                ball(ij.LinearRestitution(0.92, 0.035)),
                ij.ImpactTimes(times),
                ij.InitialState(0.0, 2.9),
                simulation=EFFORT,
                noise=ij.WhiteNoise(),
            ),
            optimiser=optax.adam(0.1),
            steps=40,
            rounds=10,
        )

    return jax.jit(jax.vmap(one))(jnp.stack([heard(softening, seed).times for seed in range(3)]))


@thorough
def test_learn_with_adam_agrees_with_scipy():
    many = named()
    assert many.names == ("r0", "alpha", "x_dot0", "t0")
    assert np.all(many.converged)
    for seed in range(3):
        values, covariance, rms = by_scipy("linear", seed)
        one = jax.tree.map(operator.itemgetter(seed), many)
        found = np.array([float(one.value(name)) for name in many.names])
        wrong = (found - values) / np.sqrt(np.diag(covariance))
        assert np.max(np.abs(wrong)) < 0.1
        np.testing.assert_allclose(one.rms, rms, rtol=1e-3)


def test_band_of_named_law_follows_from_covariance():
    one = jax.tree.map(lambda x: x[0], named())
    _, covariance, _ = by_scipy("linear")
    v = np.array([0.3, 1.0, 2.0])
    along = np.stack([np.ones(3), -v, np.zeros(3), np.zeros(3)], axis=1)
    expected = np.sqrt(np.sum(along @ covariance * along, axis=1))
    np.testing.assert_allclose(ij.restitution_band(one, v)[1], expected, rtol=1e-2)


def test_learned_restitution_figure():
    found, _ = of_softening()
    ax = ij.plot.learned_restitution(Figure().subplots(), found)
    impacts, curve = ax.get_lines()
    happened = np.asarray(found.impacts.happened)
    np.testing.assert_allclose(
        np.asarray(impacts.get_xdata()), found.impacts.approach_speed[happened]
    )
    speeds = np.asarray(curve.get_xdata())
    np.testing.assert_allclose(np.asarray(curve.get_ydata()), ij.restitution_band(found, speeds)[0])
    assert ax.get_xlabel() == "approach speed [m/s]"
    legend = ax.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["learned"]


class Mean(ij.AbstractImpactLaw):
    """A law of the mean of many weights, so that the gradient is that of reverse mode."""

    weights: Array = eqx.field(converter=ij.as_parameter)
    traces: ClassVar[list[int]] = []

    def restitution(self, speed):
        self.traces.append(1)
        return jnp.mean(self.weights) * jnp.ones_like(speed)


TS = np.linspace(0.0, 1.2, 61)


def heights(r, x0):
    """Heights of a ball dropped from rest."""
    speed, begin = math.sqrt(2 * GRAVITY * x0), -math.sqrt(2 * x0 / GRAVITY)
    begin, out = -begin - 2 * speed / GRAVITY, np.zeros(len(TS))
    while begin < TS[-1]:
        s = TS - begin
        flies = (s >= 0) & (s < 2 * speed / GRAVITY)
        out[flies] = (speed * s - GRAVITY * s**2 / 2)[flies]
        begin, speed = begin + 2 * speed / GRAVITY, r * speed
    return out


VALUES = heights(0.8, 0.5) + 2e-3 * np.random.default_rng(5).standard_normal(61)


def of_mean(r, x0):
    return ij.learn(
        ij.Experiment(
            ball(Mean(jnp.full(60, r))),
            ij.Recording(TS, VALUES, ij.Displacement()),
            ij.InitialState(jnp.asarray(x0)),
            fixed=("x_dot0",),
            simulation=SMALL,
        ),
        where=weights_of,
    )


@functools.cache
def of_many_weights():
    return of_mean(0.75, 0.49)


@thorough
def test_learn_with_many_weights_agrees_with_scipy():
    found = of_many_weights()
    known = optimize.least_squares(lambda p: heights(*p) - VALUES, [0.8, 0.5], jac="3-point")
    errors = np.sqrt(np.diag(np.linalg.inv(known.jac.T @ known.jac)) * 2 * known.cost / 59)
    assert found.converged
    weights = weights_of(found.system)
    np.testing.assert_allclose(weights, weights[0], rtol=1e-6)  # no reason to differ
    values = np.array([float(jnp.mean(weights)), float(found.value("x0"))])
    assert np.max(np.abs(values - known.x) / errors) < 0.1
    middle, band = ij.restitution_band(found, np.array([2.8]))
    np.testing.assert_allclose(middle, jnp.mean(weights))
    np.testing.assert_allclose(band, errors[0], rtol=0.15)  # correlation is allowed for


def test_learn_reuses_its_program():
    before = of_many_weights()
    Mean.traces.clear()
    again, other = of_mean(0.75, 0.49), of_mean(0.82, 0.51)
    assert not Mean.traces
    np.testing.assert_array_equal(again.numbers, before.numbers)
    np.testing.assert_allclose(other.rms, before.rms, rtol=1e-3)


def test_learn_from_non_finite_start_does_not_converge():
    found = of_mean(0.75, jnp.nan)
    assert not found.converged
    assert np.isinf(found.rms)
    assert found.refused == found.iterations > 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"steps": 0}, "`steps` must be at least 1"),
        ({"rounds": -1}, "`rounds` must be at least 1"),
        ({"where": lambda system: system.model.lower.law.r}, "picks the parameter `r`, which has"),
    ],
)
def test_impossible_learn_requests_are_refused(arguments, words):
    model = ball(ij.Restitution(0.9))
    experiment = ij.Experiment(model, heard(softening), ij.InitialState(0.0, 3.0))
    with pytest.raises(ValueError, match=words):
        ij.learn(experiment, **arguments)


def test_restitution_band_needs_impact_law():
    found = eqx.tree_at(lambda each: each.task.problem.system.model.lower, of_many_weights(), None)
    with pytest.raises(ValueError, match="an impact law at its lower stop"):
        ij.restitution_band(found, np.ones(1))
