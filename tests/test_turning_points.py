"""Nearest miss, deepest penetration and peak force, against closed forms and SciPy."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fminbound

import impactjax as ij
from reference import richardson
from tiers import thorough
from turns import SERIES, both_ways, check

# Decaying oscillators between stops that they do not reach.

GAPS = 3.0, 3.02


def missed(parameters):
    omega, zeta, x, v = parameters
    oscillator = ij.LinearOscillator(omega, zeta)
    stops = [ij.Stop(ij.Restitution(0.8), gap) for gap in GAPS]
    run = ij.simulate(
        ij.ImpactOscillator(oscillator, *stops),
        ij.InitialState(x, v),
        jnp.array([3.0]),
        t0=0.0,
        step=SERIES,
        tolerance=1e-10,
        max_steps=128,
        max_impacts=1,
    )
    return run.nearest_miss


def first_turns(parameters):
    """Without a base's motion the first turn before each stop is the closest one."""
    omega, zeta, x, v = parameters
    rate = omega * jnp.sqrt(1 - zeta**2)
    upper = jnp.arctan2(v, (omega * x + zeta * v) * omega / rate)  # phase, where the velocity is 0

    def position(phase):
        along = (v + zeta * omega * x) / rate * jnp.sin(phase)
        return jnp.exp(-zeta * omega * phase / rate) * (x * jnp.cos(phase) + along)

    low, high = position((upper + jnp.pi) % (2 * jnp.pi)), position(upper % (2 * jnp.pi))
    return jnp.minimum(GAPS[0] + low, GAPS[1] - high)


@thorough
def test_nearest_miss_of_decaying_oscillators():
    draw = np.random.default_rng(3).uniform
    x, v = draw(-1.5, 1.5, 48), draw(-6.0, 6.0, 48)
    lanes = jnp.stack([draw(5.0, 12.0, 48), draw(0.0, 0.1, 48), x, v], axis=1)
    expected = jax.vmap(first_turns)(lanes), jax.vmap(jax.jacfwd(first_turns))(lanes)
    check(both_ways(missed)(lanes), *expected, rtol=1e-8)


# With dry friction or drag a turn is an event at which a step ends.

FRICTION = 0.3
LOWER, UPPER = (200.0, 0.1), (300.0, 0.1)  # omega0 and gamma of Kelvin-Voigt, of Maxwell
TOP = 0.1


def rubbed(speed):
    oscillator = ij.LinearOscillator(10.0, 0.01, dry_friction=FRICTION)
    stops = ij.Stop(ij.KelvinVoigt(*LOWER)), ij.Stop(ij.Maxwell(*UPPER), TOP)
    run = ij.simulate(
        ij.ImpactOscillator(oscillator, *stops),
        ij.InitialState(0.05, -speed),
        jnp.array([0.12]),
        t0=0.0,
        step=SERIES,
        tolerance=1e-11,
        max_steps=96,
        max_impacts=4,
    )
    return jnp.concatenate([run.deepest_penetration[:2], run.peak_force[:2]])


def until(flow, reached, y, direction):
    """The motion until something falls or rises through zero."""
    vars(reached).update(terminal=True, direction=direction)
    run = solve_ivp(
        flow, (0.0, 1.0), y, "DOP853", rtol=1e-12, atol=1e-15, events=reached, dense_output=True
    )
    assert run.status == 1
    return run, run.y_events[0][0]


def peak(force, run):
    """The largest force of a motion."""
    at = fminbound(lambda t: -force(run.sol(t)), 0.0, run.t[-1], xtol=1e-10)
    return max(force(run.sol(at)), force(run.y[:, 0]), force(run.y[:, -1]))


def rubbed_reference(speed):
    """The same by SciPy: down into the lower stop, back, up into the upper one until it turns."""

    def free(y):
        return -0.2 * y[1] - 100 * y[0]

    def lower(y):
        omega0, gamma = LOWER
        return -omega0 * (omega0 * y[0] + 2 * gamma * y[1])

    def upper(y):
        return UPPER[0] ** 2 * (y[0] - TOP - y[2])

    def place(t, y):
        return y[0]

    def rate(t, y):
        return y[1]

    _, y = until(lambda t, y: [y[1], free(y) + FRICTION], place, [0.05, -speed], -1)
    down, y = until(lambda t, y: [y[1], free(y) + lower(y) + FRICTION], rate, y, 1)
    deepest = -y[0]
    up, y = until(lambda t, y: [y[1], free(y) + lower(y) - FRICTION], place, y, 1)
    force = max(peak(lower, down), peak(lower, up))
    _, y = until(lambda t, y: [y[1], free(y) - FRICTION], lambda t, y: y[0] - TOP, y, 1)

    def pressed(t, y):
        stroke = 2 * UPPER[1] * UPPER[0] * (y[0] - TOP - y[2])
        return [y[1], free(y) - upper(y) - FRICTION, stroke]

    into, y = until(pressed, rate, [*y, 0.0], -1)
    return np.array([deepest, y[0] - TOP, force, peak(upper, into)])


@thorough
def test_extremes_with_dry_friction():
    speeds = np.linspace(3.0, 5.0, 12)
    value, forward, reverse = both_ways(rubbed)(jnp.asarray(speeds))
    np.testing.assert_allclose(value, [rubbed_reference(speed) for speed in speeds], rtol=1e-8)
    np.testing.assert_allclose(forward, reverse, rtol=1e-9)
    slope = richardson(rubbed_reference, speeds[3], 0.1)
    np.testing.assert_allclose(forward[3], slope, rtol=1e-6)


@thorough
def test_nearest_miss_by_dry_friction():
    """Friction moves the centre of the swing by its share of the stiffness."""

    def miss(release):
        oscillator = ij.LinearOscillator(10.0, dry_friction=2.0)
        model = ij.ImpactOscillator(oscillator, ij.Stop(ij.Restitution(0.5), 1.0))
        run = ij.simulate(
            model,
            ij.InitialState(release),
            jnp.array([0.4]),
            t0=0.0,
            step=SERIES,
            tolerance=1e-10,
            max_steps=64,
            max_impacts=1,
        )
        return run.nearest_miss

    releases = jnp.linspace(0.1, 0.9, 32)
    found = both_ways(miss)(releases)
    check([x[:, None] for x in found], 1.04 - releases[:, None], -jnp.ones((32, 1)), rtol=1e-9)


def first_contact(oscillator, law, initial):
    """Deepest penetration and peak force of the first impact, by a Runge-Kutta step."""
    run = ij.simulate(
        ij.ImpactOscillator(oscillator, ij.Stop(law)),
        initial,
        jnp.array([0.5]),
        t0=0.0,
        step=ij.RungeKutta(diffrax.Tsit5()),
        tolerance=1e-9,
        max_steps=256,
        max_impacts=4,
    )
    return jnp.stack([run.deepest_penetration[0], run.peak_force[0]])


@thorough
def test_extremes_with_drag_on_hertz_spring():
    """A ball of 1 kg; its speed at the floor is √(g (1 − e^(−2 c h))/c)."""
    drag, gravity, k = 0.1, 9.81, 1e4

    def told(height):
        ball = ij.BouncingBall(gravity, drag=drag)
        return first_contact(ball, ij.Hertz(k), ij.InitialState(height))

    def reference(height):
        speed = np.sqrt(gravity * (1 - np.exp(-2 * drag * height)) / drag)

        def flow(t, y):
            return [y[1], gravity - drag * y[1] ** 2 - k * max(y[0], 0.0) ** 1.5]

        _, y = until(flow, lambda t, y: y[1], [0.0, speed], -1)
        return np.array([y[0], k * y[0] ** 1.5])

    heights = np.linspace(0.2, 0.5, 12)
    value, forward, reverse = both_ways(told)(jnp.asarray(heights))
    np.testing.assert_allclose(value, [reference(h) for h in heights], rtol=1e-7)
    slope = richardson(reference, heights[5], 1e-2)
    for found in (forward, reverse):
        np.testing.assert_allclose(found[5], slope, rtol=1e-6)


@thorough
def test_extremes_with_infinite_damping_slope_at_touch():
    """Tsuji's law: depth and force scale with speed v and stiffness k as v^(4/5), v^(6/5), at the
    same c/√k; their derivatives by c are those of SciPy's solution.
    """
    mass, start = 1.0, jnp.array([1e4, 60.0, 0.8])

    def told(parameters):
        k, c, speed = parameters
        law = ij.PowerLaw(k, c, 1.5, 0.25, 1.0)
        return first_contact(ij.FreeMass(mass), law, ij.InitialState(0.0, -speed))

    def reference(c):
        k, _, speed = np.asarray(start)

        def force(y):
            depth = max(y[0], 0.0)
            return k * depth**1.5 + c * depth**0.25 * y[1]

        run, y = until(lambda t, y: [y[1], -force(y) / mass], lambda t, y: y[1], [0.0, speed], -1)
        return np.array([y[0], peak(force, run)])

    value, *slopes = both_ways(told)(start[None])
    np.testing.assert_allclose(value[0], reference(60.0), rtol=1e-7)
    by_c = richardson(reference, 60.0, 4.0) * 60.0 / value[0]
    by_k = np.array([-2 / 5, 2 / 5]) - by_c / 2
    expected = np.stack([by_k, by_c, np.array([4 / 5, 6 / 5])], axis=1)
    for slope in slopes:
        logarithmic = slope[0] * start / value[0][:, None]
        np.testing.assert_allclose(logarithmic, expected, atol=1e-4)


@thorough
def test_depth_of_creeping_mass():
    """A Maxwell stop that damps so much that the mass stays in it: 2 γ v/ω0.

    At γ = 1 the mass stops as exp(−ω0 t), until rounding decides whether it leaves at 1e-18 of its
    speed.
    """
    gammas, speed = jnp.array([1.0, 1.01, 1.5, 2.0]), 0.7
    found = jax.jit(
        jax.vmap(lambda gamma: ij.single_impact(ij.Maxwell(300.0, gamma), speed, 0.02))
    )(gammas)
    np.testing.assert_allclose(found.deepest_penetration, 2 * gammas * speed / 300, rtol=1e-7)
    assert np.all(found.restitution < 1e-16)
    assert np.all(found.restitution[1:] == 0)


@thorough
@pytest.mark.parametrize("step", [ij.TaylorStep(order=4), ij.RungeKutta(diffrax.Bosh3())])
def test_end_of_run_before_stop_is_near_miss(step):
    def miss(parameters):
        height, end = parameters
        model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(ij.Restitution(0.5)))
        run = ij.simulate(
            model, ij.InitialState(height), end[None], t0=0.0, step=step, max_steps=32
        )
        return run.nearest_miss

    lanes = np.random.default_rng(1).uniform([0.2, 0.05], [0.4, 0.2], (64, 2))
    height, end = lanes.T
    slopes = np.stack([np.ones(64), -9.81 * end], axis=1)
    check(both_ways(miss)(jnp.asarray(lanes)), height - 9.81 * end**2 / 2, slopes, rtol=1e-10)
