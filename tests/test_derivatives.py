"""Derivatives through impacts: forward against reverse, closed forms, Richardson differences."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._simulate import replay
from reference import ball_impact_time, ball_position, derivative, richardson
from systems import CASES, STEPS, TIMES, Case
from tiers import mostly_thorough, thorough

FEW = TIMES[7::14]
SERIES = ij.TaylorStep(order=8)  # compiles in a third of the time of order 15

# Systems other than a pendulum on one stop, whose laws test_every_column.py goes through.
OTHERS = [
    "pendulum with dry friction, two stops",
    "linear oscillator",
    "bouncing ball",
    "free mass on Kelvin-Voigt",
]


def outputs(case: Case, tolerance: float, parameters):
    run = ij.simulate(
        case.model(parameters),
        case.initial(parameters),
        FEW,
        t0=0.0,
        step=SERIES,
        tolerance=tolerance,
        max_steps=2048,
    )
    log = run.impacts
    return run.position, run.velocity, log.time, log.approach_speed, log.separation_speed


@functools.cache
def jacobian(name: str, mode=jax.jacfwd):
    case = CASES[name]
    return jax.jit(mode(functools.partial(outputs, case, 1e-12)))(case.parameters)


# Some derivatives vanish or all but cancel (the restitution of Kelvin-Voigt does not depend on
# omega0), so differences count against the largest logarithmic sensitivity of each output.
@pytest.mark.parametrize("name", mostly_thorough(OTHERS, "bouncing ball"))
def test_forward_and_reverse_agree(name):
    size = np.maximum(np.abs(CASES[name].values), 0.1)
    for forward, reverse in zip(jacobian(name), jacobian(name, jax.jacrev), strict=True):
        assert np.all(np.isfinite(forward))
        scale = np.max(np.abs(forward * size))
        assert np.max(np.abs((forward - reverse) * size)) < 1e-12 * scale


@pytest.mark.parametrize(
    "name", mostly_thorough(OTHERS, "pendulum with dry friction, two stops", "bouncing ball")
)
def test_derivatives_match_richardson(name):
    case = CASES[name]
    exact = jacobian(name)
    values = jax.jit(functools.partial(outputs, case, 1e-14))
    for i, value in enumerate(case.values):
        h = 1e-3 * max(abs(value), 0.1)

        def along(x, i=i):
            return np.concatenate([np.ravel(out) for out in values(case.parameters.at[i].set(x))])

        estimate = richardson(along, value, h)
        column = np.concatenate([np.ravel(each[..., i]) for each in exact])
        scale = np.max(np.abs(column))
        assert np.max(np.abs(column - estimate)) < 1e-8 * scale, case.names[i]


@pytest.mark.parametrize("alone", mostly_thorough(["r", "upper gap", "position"], "r"))
def test_derivatives_with_constant_model_parts(alone):
    """Constants get no tangents; the derivative by all parameters at once knows no constants."""
    case = CASES["pendulum with dry friction, two stops"]
    i = case.names.index(alone)

    def along(value):
        return outputs(case, 1e-12, [*case.values[:i], value, *case.values[i + 1 :]])

    by_one = jax.jit(jax.jacfwd(along))(case.values[i])
    for one, full in zip(by_one, jacobian("pendulum with dry friction, two stops"), strict=True):
        column = full[..., i]
        np.testing.assert_allclose(one, column, rtol=0, atol=1e-12 * np.max(np.abs(column)))


def ball_closed_form(time: float, impacts: int):
    gravity, r, height = 9.81, 0.9, 0.2
    values = [height, gravity, r]
    position = [
        derivative(lambda h, g, r: ball_position(h, g, r, time, impacts), values, i)
        for i in range(3)
    ]
    last = [
        derivative(lambda h, g, r: ball_impact_time(h, g, r, impacts - 1), values, i)
        for i in range(3)
    ]
    return values, np.array(position), np.array(last)


def ball_derivatives(step: ij.AbstractStep | None, time: float, impacts: int):
    def run(values):
        height, gravity, r = values
        model = ij.ImpactOscillator(ij.BouncingBall(gravity), ij.Stop(ij.Restitution(r)))
        found = ij.simulate(
            model, ij.InitialState(height), jnp.array([time]), t0=0.0, step=step, tolerance=1e-12
        )
        return found.position[0], found.impacts.time[impacts - 1]

    return run


@pytest.mark.parametrize("step", mostly_thorough(STEPS, "Taylor"))
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_ball_derivatives_over_five_impacts_match_closed_form(step, mode):
    values, position, last = ball_closed_form(1.58, 5)
    found = jax.jit(mode(ball_derivatives(STEPS[step], 1.58, 5)))(jnp.array(values))
    np.testing.assert_allclose(found[0], position, rtol=1e-10)
    np.testing.assert_allclose(found[1], last, rtol=1e-10)


def test_derivative_tests_can_fail(monkeypatch):
    """Without the event times' own derivatives, the saltation is lost."""
    values, position, _ = ball_closed_form(1.58, 5)
    whole = replay._push_forward

    def without_event_times(*arguments):
        (d_t, _), *_ = arguments[-5:]
        (_, d_y), rows = whole(*arguments)
        return (d_t, d_y), rows._replace(h=jnp.zeros_like(rows.h))

    monkeypatch.setattr(replay, "_push_forward", without_event_times)
    found = jax.jacfwd(ball_derivatives(ij.TaylorStep(order=4), 1.58, 5))(jnp.array(values))
    assert np.max(np.abs(found[0] / position - 1)) > 1e-2


@thorough
@pytest.mark.parametrize(
    "name",
    ["pendulum, restitution", "pendulum, Kelvin-Voigt"],
)
def test_second_derivatives_are_exact(name):
    case = CASES[name]
    step = ij.TaylorStep(order=9)

    def last_position(parameters):
        run = ij.simulate(
            case.model(parameters),
            case.initial(parameters),
            FEW[:6],
            t0=0.0,
            step=step,
            tolerance=1e-12,
            max_steps=1024,
        )
        return run.position[-1]

    scale = case.parameters
    hessian = jax.jit(jax.jacfwd(jax.jacfwd(last_position)))(case.parameters)
    slope = jax.jit(jax.jacfwd(last_position))
    for i, value in enumerate(case.values):
        column = richardson(
            lambda x, i=i: np.asarray(slope(case.parameters.at[i].set(x))), value, 1e-3 * value
        )
        found, expected = hessian[:, i] * scale * value, column * scale * value
        assert np.max(np.abs(found - expected)) < 1e-6 * np.max(np.abs(hessian * scale * value))


@thorough
def test_slipping_mass_does_not_stick_again_by_rounding():
    # At slip speed and acceleration are zero; a rounded acceleration that points back once made
    # the mass stick and slip for ever, or move on with an infinite derivative.
    def end(friction):
        base = ij.HarmonicMotion(0.03, 9.0)
        oscillator = ij.LinearOscillator(12.0, 0.01, dry_friction=friction, base=base)
        start = ij.InitialState(0.03)
        model = ij.ImpactOscillator(oscillator)
        run = ij.simulate(model, start, jnp.array([3.0]), t0=0.0, max_steps=96)
        return run.position[0], run.result == ij.RESULTS.successful

    frictions = jnp.linspace(0.9, 1.5, 32)
    slopes, fine = jax.jit(jax.vmap(jax.jacfwd(end, has_aux=True)))(frictions)
    place = jax.jit(jax.vmap(lambda friction: end(friction)[0]))
    assert fine.all()
    differences = (place(frictions + 1e-5) - place(frictions - 1e-5)) / 2e-5
    np.testing.assert_allclose(slopes, differences, atol=1e-9)
