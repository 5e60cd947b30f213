"""Parameters that change nothing together, and arguments that cannot act."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij

GRAVITY, SPEED, R = 9.80665, 3.0, 0.9


def bounce_times(seed: int = 5) -> np.ndarray:
    """Times of a ball's impacts with a clock error of 0.05 ms: flights last 2 v rⁿ / g."""
    flights = 2 * SPEED / GRAVITY * R ** np.arange(12)
    times = np.concatenate([[0.0], np.cumsum(flights)])
    return times + 5e-5 * np.random.default_rng(seed).standard_normal(13)


def ball(**more) -> ij.Experiment:
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(R)))
    recording, simulation = ij.ImpactTimes(bounce_times()), ij.Simulation(max_steps=128)
    start = ij.InitialState(0.0, SPEED)
    return ij.Experiment(model, recording, start, simulation=simulation, **more)


def swing(scatter: ij.AbstractScatter, x0: float = 0.0) -> ij.Experiment:
    """Half sines: the gain scales the initial speed."""
    omega, ts = 20.0, np.arange(0, 1, 0.002)
    number = np.floor(ts * omega / np.pi + 1e-12)
    x = 0.05 * 0.8**number * np.sin(omega * ts - np.pi * number)
    noise = 2e-4 * np.random.default_rng(6).standard_normal(ts.size)
    return ij.Experiment(
        ij.ImpactOscillator(ij.LinearOscillator(20.0, 0.001), ij.Stop(ij.Restitution(0.75))),
        ij.Recording(ts, x + noise, ij.Displacement()),
        ij.InitialState(x0, 1.0),
        free=["gain"],
        fixed=["zeta", "x0"],
        scatter=scatter,
        simulation=ij.Simulation(max_steps=128),
    )


@pytest.mark.parametrize("scatter", [ij.NoScatter(), None], ids=["no scatter", "scatter"])
def test_times_tell_the_speed_over_gravity_only(scatter):
    estimate = ij.fit(ball(free=["gravity"], scatter=scatter))
    for name in ("gravity", "x_dot0"):
        assert estimate.verdict(name) == ij.Verdict.NOT_IDENTIFIED
        assert np.isinf(estimate.standard_error(name))
    assert estimate.verdict("r") == ij.Verdict.IDENTIFIED
    low, high = estimate["r"].low, estimate["r"].high
    assert low < R < high
    assert high - low < 1e-3


def test_a_parameter_without_effect_is_not_identified_beside_scatter():
    estimate = ij.fit(ball(free=["mass"]))
    assert estimate.verdict("mass") == ij.Verdict.NOT_IDENTIFIED
    assert np.isinf(estimate.standard_error("mass"))
    assert estimate.verdict("r") == ij.Verdict.IDENTIFIED


@pytest.mark.parametrize("scatter", [ij.NoScatter(), ij.NormalScatter()])
def test_a_motion_tells_the_gain_times_the_speed_only(scatter):
    estimate = ij.fit(swing(scatter))
    assert estimate.verdict("gain") == ij.Verdict.NOT_IDENTIFIED
    assert estimate.verdict("x_dot0") == ij.Verdict.NOT_IDENTIFIED
    assert estimate.verdict("omega_n") == ij.Verdict.IDENTIFIED
    assert abs(float(estimate.value("omega_n")) - 20) < 4 * float(
        estimate.standard_error("omega_n")
    )


def test_scatter_in_a_record_that_begins_at_the_stop_is_fitted_without_an_error():
    experiment = dataclasses.replace(swing(ij.NormalScatter(), 1e-4), fixed=["zeta"], free=())
    estimate = ij.fit(experiment)
    assert np.all(np.isfinite(estimate.values))
    assert abs(float(estimate.value("r")) - 0.8) < 0.01


@pytest.mark.parametrize(
    "sensor", [ij.Sensor(gain=2.0), ij.Sensor(offset=0.1), ij.Sensor(low_pass=ij.Butterworth(50.0))]
)
def test_times_refuse_a_sensor_of_motion(sensor):
    with pytest.raises(ValueError, match="Times of impacts have no gain"):
        ij.fit(ball(sensor=sensor))


def test_learn_refuses_what_it_does_not_use():
    with pytest.raises(ValueError, match="leave out `priors`"):
        ij.learn(ball(priors={"r": ij.Normal(0.9, 0.01)}))
    with pytest.raises(ValueError, match="without scatter"):
        ij.learn(ball(scatter=ij.NormalScatter()))


def test_joint_estimate_names_its_assumptions_and_is_not_saved(tmp_path):
    one = ball(scatter=ij.NoScatter())
    other = dataclasses.replace(one, recording=ij.ImpactTimes(bounce_times(6)))
    joint = ij.fit_together([one, other])
    assert "given gravity" in str(joint)
    with pytest.raises(ValueError, match="of several, save one"):
        ij.io.save(tmp_path / "joint.npz", joint)  # pyright: ignore[reportArgumentType]


def test_saved_estimate_belongs_to_its_recording_and_is_tested_without_scatter(tmp_path):
    experiment = ball()
    estimate = ij.fit(experiment)
    ij.io.save(tmp_path / "one.npz", estimate)
    other = dataclasses.replace(experiment, recording=ij.ImpactTimes(bounce_times(7)))
    with pytest.raises(ValueError, match="another recording"):
        ij.io.load(tmp_path / "one.npz", other)
    np.testing.assert_array_equal(
        ij.io.load(tmp_path / "one.npz", experiment).values, jnp.asarray(estimate.values)
    )
    with pytest.raises(ValueError, match="NoScatter"):
        ij.left_out(estimate)
