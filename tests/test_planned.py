"""Information in experiments before any data, and synthetic recordings, against closed forms."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest

import impactjax as ij
from estimates import SMALL, TS

SIGMA = 0.05
LINE = ij.ImpactOscillator(ij.FreeMass())
BALL = ij.ImpactOscillator(ij.BouncingBall(10.0), ij.Stop(ij.Restitution(0.8)))
COUNT, SPEED, CLOCK = 7, 2.0, 1e-3


def line(sigma: float | None = SIGMA, **more) -> ij.Experiment:
    """A planned recording of a free mass."""
    recording, sensor = ij.planned(TS, ij.Displacement()), ij.Sensor(sigma=sigma)
    start = ij.InitialState(0.3, 0.7)
    return ij.Experiment(LINE, recording, start, sensor, simulation=SMALL, **more)


def regression(prior: float | None = None) -> np.ndarray:
    """Standard errors of level and slope by linear regression."""
    design = np.stack([np.ones(31), TS - TS[0]], axis=1) / SIGMA
    matrix = design.T @ design
    if prior is not None:
        matrix[1, 1] += 1 / prior**2
    return np.sqrt(np.diag(np.linalg.inv(matrix)))


def times(r: float, speed: float, logs: np.ndarray) -> np.ndarray:
    """Impact times of a ball by the closed form, with the logarithms of the impacts' factors."""
    speeds = speed * np.exp(np.concatenate([[0.0], np.cumsum(np.log(r) + logs)]))
    return np.concatenate([[0.0], np.cumsum(2 * speeds / 10.0)])


def ball(clock: float = CLOCK) -> ij.Experiment:
    """Planned impact times of a bouncing ball."""
    recording = ij.ImpactTimes(times(0.8, SPEED, np.zeros(COUNT - 2)))
    start = ij.InitialState(0.0, SPEED)
    return ij.Experiment(BALL, recording, start, ij.Sensor(sigma=clock), simulation=SMALL)


def short() -> ij.Experiment:
    """A plan whose times are far too short for its impacts."""
    return dataclasses.replace(ball(), recording=ij.ImpactTimes(1e-3 * np.arange(COUNT)))


def test_bounds_of_a_straight_line_are_those_of_regression():
    told = ij.information(line())
    assert told.names == ("x0", "x_dot0")
    np.testing.assert_allclose(told.bounds, regression(), rtol=1e-9)
    assert told.of_model == (False, False)


def test_prior_knowledge_is_an_observation():
    told = ij.information(line(priors={"x_dot0": ij.Normal(0.5, 0.03)}))
    np.testing.assert_allclose(told.bounds, regression(0.03), rtol=1e-9)


def test_recorded_values_do_not_matter():
    plan = line()
    drawn = ij.synthetic(plan, jax.random.key(1))
    np.testing.assert_allclose(ij.information(drawn).matrix, ij.information(plan).matrix)


def test_information_around_an_estimate_is_its_identifiability():
    found = ij.fit(ij.synthetic(line(), jax.random.key(2)))
    system = found.system
    there = dataclasses.replace(line(), initial=system.initial)
    told = ij.identifiability(found)
    np.testing.assert_allclose(ij.information(there).matrix, told.matrix, rtol=1e-6)


@pytest.mark.parametrize("scatter", [0.0, 0.003, 0.1])
def test_bounds_with_scatter_are_those_of_generalised_least_squares(scatter):
    told = ij.information(ball(), scatter=scatter)
    assert told.names == ("r", "x_dot0", "t0")
    nothing, step = np.zeros(COUNT - 2), 1e-6

    def slope(along) -> np.ndarray:
        return (along(step) - along(-step)) / (2 * step)

    columns = [
        slope(lambda h: times(0.8 + h, SPEED, nothing)),
        slope(lambda h: times(0.8, SPEED + h, nothing)),
        np.ones(COUNT),
    ]
    effects = [slope(lambda h, one=one: times(0.8, SPEED, h * one)) for one in np.eye(COUNT - 2)]
    jacobian, effects = np.stack(columns, axis=1), np.stack(effects, axis=1)
    covariance = CLOCK**2 * np.eye(COUNT) + scatter**2 * effects @ effects.T
    matrix = jacobian.T @ np.linalg.solve(covariance, jacobian)
    known = np.sqrt(np.diag(np.linalg.inv(matrix)))
    np.testing.assert_allclose(told.bounds, known, rtol=1e-5)


def test_information_under_jit_and_vmap():
    def bounds(speed):
        start = ij.InitialState(0.0, speed)
        return ij.information(dataclasses.replace(ball(), initial=start), scatter=0.01).bounds

    speeds = jnp.array([SPEED, 2.1])
    each = [bounds(speed) for speed in speeds]
    np.testing.assert_allclose(jax.jit(jax.vmap(bounds))(speeds), each, rtol=1e-9)


@pytest.mark.parametrize("scatter", [0.0, 0.01])
def test_second_clock_halves_the_noise_but_not_the_scatter(scatter):
    """Two clocks hear one motion: they count as one with the noise divided by √2."""
    both = ij.information([ball(), ball()], scatter=scatter)
    better = ij.information(ball(CLOCK / math.sqrt(2)), scatter=scatter)
    np.testing.assert_allclose(both.bounds, better.bounds, rtol=1e-9)


def test_bounds_as_a_function_of_the_scatter():
    def bound(scatter):
        return ij.information(ball(), scatter=scatter).bounds[0]

    sizes = jnp.array([1e-3, 2e-3])
    each = [bound(float(size)) for size in sizes]
    np.testing.assert_allclose(jax.vmap(bound)(sizes), each, rtol=1e-9)
    step = 1e-6
    slope = (bound(1e-3 + step) - bound(1e-3 - step)) / (2 * step)
    np.testing.assert_allclose(jax.grad(bound)(1e-3), slope, rtol=1e-5)


def test_parameter_without_effect_has_an_infinite_bound():
    """The motion starts at the first sample, so that a delay changes nothing but rounding."""
    model = ij.ImpactOscillator(ij.LinearOscillator(12.0, 0.02), ij.Stop(ij.Restitution(0.7)))
    plan = ij.Experiment(
        model,
        ij.planned(jnp.linspace(0.0, 1.0, 101), ij.Displacement()),
        ij.InitialState(0.1),
        ij.Sensor(sigma=1e-3),
        free=("delay", "mass"),
        simulation=ij.Simulation(max_steps=64, max_impacts=16),
    )
    told = ij.information(plan)
    infinite = {name: bool(np.isinf(x)) for name, x in zip(told.names, told.bounds, strict=True)}
    assert infinite == {name: name in ("delay", "mass") for name in told.names}


def test_impossible_motion_is_said_and_is_nan_under_vmap():
    model = ij.ImpactOscillator(ij.Pendulum(omega_n=30.0))
    plan = ij.Experiment(
        model,
        ij.planned(jnp.linspace(0.0, 50.0, 21), ij.Angle()),
        ij.InitialState(1.0),
        ij.Sensor(sigma=0.01),
        simulation=ij.Simulation(max_steps=4),
    )
    with pytest.raises(ValueError, match="cannot be simulated: The run needs more steps"):
        ij.information(plan)

    @jax.jit
    def bounds(angle):
        return ij.information(dataclasses.replace(plan, initial=ij.InitialState(angle))).bounds

    assert np.all(np.isnan(bounds(1.0)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda: ij.information(line(None)), "state `sigma`"),
        (lambda: ij.synthetic(line(None), jax.random.key(0)), "state `sigma`"),
        (lambda: ij.information(line(), scatter=0.1), "needs a stop"),
        (lambda: ij.information(ball(), scatter=-0.1), "must be a number from 0 on"),
        (lambda: ij.synthetic(ball(), jax.random.key(0), scatter=-1), "must be a number from 0 on"),
        (lambda: ij.information(ball(), scatter=math.nan), "must be a number from 0 on"),
        (lambda: ij.information(ball(), scatter=math.inf), "must be a number from 0 on"),
        (lambda: ij.information(ball(), scatter=np.ones(2)), "must be a number from 0 on"),
        (lambda: ij.synthetic(line(), jax.random.key(0), scatter=0.1), "needs a stop"),
        (lambda: ij.information(short()), "fewer impacts than recorded"),
        (lambda: ij.synthetic(short(), jax.random.key(0)), "fewer impacts than recorded"),
        (
            lambda: ij.information(line(fixed=("x0",), priors={"x0": ij.Normal(0.0, 1.0)})),
            "which is not fitted",
        ),
    ],
)
def test_refused_arguments(change, words):
    with pytest.raises(ValueError, match=words):
        change()


def test_experiments_together_have_the_sum_of_their_information():
    slow, fast = (dataclasses.replace(ball(), initial=ij.InitialState(0.0, v)) for v in (2.0, 2.2))
    parts = [ij.information(each) for each in (slow, fast)]
    told = ij.joint_information(parts)
    assert told.names == ("r", "x_dot0[0]", "t0[0]", "x_dot0[1]", "t0[1]")
    blocks = [np.asarray(each.sensitivities) / np.asarray(each.scale) for each in parts]
    whole = np.zeros((2 * COUNT, 5))
    whole[:COUNT, :3], whole[COUNT:, 0], whole[COUNT:, 3:] = (
        blocks[0],
        blocks[1][:, 0],
        blocks[1][:, 1:],
    )
    known = np.sqrt(np.diag(np.linalg.inv(whole.T @ whole)))
    np.testing.assert_allclose(told.bounds, known, rtol=1e-7)
    assert ij.joint_information(parts[:1]) is parts[0]


def test_experiments_with_other_values_are_refused():
    other = ij.ImpactOscillator(ij.BouncingBall(10.0), ij.Stop(ij.Restitution(0.7)))
    parts = [ij.information(each) for each in (ball(), dataclasses.replace(ball(), model=other))]
    with pytest.raises(ValueError, match="`r` has different values"):
        ij.joint_information(parts)
    stiff = [
        ij.information_in(lambda law: jnp.array([law.k, law.c]), law, 1.0)
        for law in (ij.Walton(1e4, 1.0), ij.Simon(1e4, 1.0))
    ]
    with pytest.raises(ValueError, match="different units"):
        ij.joint_information(stiff)
    with pytest.raises(ValueError, match="no information to join"):
        ij.joint_information([])


def test_collinearity_is_that_of_two_columns_at_an_angle():
    told = ij.information(line())
    design = np.stack([np.ones(31), TS - TS[0]], axis=1)
    cosine = design[:, 0] @ design[:, 1] / np.prod(np.linalg.norm(design, axis=0))
    known = 1 / math.sqrt(1 - cosine)
    np.testing.assert_allclose(told.collinearity(["x0", "x_dot0"]), known, rtol=1e-9)
    np.testing.assert_allclose(told.collinearity(["x0"]), 1.0)
    with pytest.raises(ValueError, match="no parameter `r`"):
        told.collinearity(["r"])
    with pytest.raises(ValueError, match="list of at least one name"):
        told.collinearity([])


@pytest.mark.parametrize(("factor", "index"), [(1.0, np.inf), (np.nan, np.nan)])
def test_collinearity_of_parameters_that_one_datum_tells(factor, index):
    told = ij.information_in(
        lambda law: factor * jnp.array([law.r0 - law.alpha]), ij.LinearRestitution(0.8, 0.1), 1e-3
    )
    np.testing.assert_equal(float(told.collinearity(["r0", "alpha"])), index)


def test_synthetic_recording_is_the_motion_with_noise():
    drawn = ij.synthetic(line(), jax.random.key(3)).recording
    assert isinstance(drawn, ij.Recording)
    noise = np.asarray(drawn.values) - (0.3 + 0.7 * (TS - TS[0]))
    assert 0.7 * SIGMA < np.std(noise) < 1.3 * SIGMA
    other = ij.synthetic(line(), jax.random.key(4)).recording
    assert isinstance(other, ij.Recording)
    assert np.any(np.asarray(other.values) != np.asarray(drawn.values))


def test_synthetic_impacts_scatter():
    keys = jax.random.split(jax.random.key(5), 400)

    def flights(key) -> jax.Array:
        recording = ij.synthetic(ball(1e-9), key, scatter=0.02).recording
        assert isinstance(recording, ij.ImpactTimes)
        return jnp.diff(recording.times)

    many = np.asarray(jax.jit(jax.vmap(flights))(keys))
    logs = np.diff(np.log(many), axis=1) - math.log(0.8)
    np.testing.assert_allclose(np.std(logs), 0.02, rtol=0.1)
    np.testing.assert_allclose(np.mean(logs), 0.0, atol=0.002)
    np.testing.assert_allclose(flights(keys[0]), many[0], rtol=1e-6)


def test_figure_of_the_sensitivities_of_a_plan():
    plan = line(priors={"x_dot0": ij.Normal(0.5, 0.03)})
    ax = ij.plot.sensitivities(plt.figure().subplots(), ij.information(plan), plan.recording)
    both = ij.joint_information([ij.information(plan)] * 2)
    with pytest.raises(ValueError, match="not about this recording alone"):
        ij.plot.sensitivities(ax, both, plan.recording)
    np.testing.assert_allclose(np.asarray(ax.lines[0].get_ydata()), 0.01 * 0.3 / SIGMA)
