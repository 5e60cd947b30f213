"""Estimates as objects that people use: items, tables, files, and what they look like in print."""

import dataclasses
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import impactjax as ij
from estimates import SMALL, TS, line
from tiers import quick

pytestmark = quick

LINE = ij.ImpactOscillator(ij.FreeMass())


def experiment(**more) -> ij.Experiment:
    recording = ij.Recording(TS, line()[0], ij.Displacement())
    return ij.Experiment(LINE, recording, ij.InitialState(0.0), simulation=SMALL, **more)


def test_item_of_an_estimate_is_the_parameter():
    values, estimate = line()
    slope = estimate["x_dot0"]
    assert slope.value == pytest.approx(np.polyfit(TS, values, 1)[0], rel=1e-6)
    assert slope.unit == "m/s"
    assert slope.low < slope.value < slope.high
    assert slope.verdict is ij.Verdict.IDENTIFIED
    assert str(slope) == f"x_dot0 = {slope.quoted} m/s (identified)"
    with pytest.raises(ValueError, match="`gamma` was not fitted; x0, x_dot0 were"):
        estimate["gamma"]


def test_dataframe_has_a_row_a_parameter():
    _, estimate = line()
    frame = estimate.to_dataframe()
    assert list(frame.index) == ["x0", "x_dot0"]
    assert frame.loc["x0", "value"] == float(estimate.values[0])
    assert frame.loc["x_dot0", "verdict"] == "identified"
    assert frame.loc["x_dot0", "unit"] == "m/s"


def test_dataset_has_names_and_the_axes_of_many_fits():
    _, estimate = line()
    dataset = estimate.to_xarray()
    assert float(dataset["values"].sel(parameter="x0")) == float(estimate.values[0])
    many = jax.tree.map(lambda x: jnp.stack([x, x, x]), estimate)
    assert dict(many.to_xarray()["covariance"].sizes) == {
        "fit_0": 3,
        "parameter": 2,
        "other_parameter": 2,
    }


def test_notebooks_show_a_table():
    _, estimate = line()
    text = estimate._repr_html_()
    assert re.sub("<[^>]*>", " ", text).count("identified") == 2
    many = jax.tree.map(lambda x: jnp.stack([x, x]), estimate)
    assert many._repr_html_().startswith("<p>2 fits of x0, x_dot0")


def test_comparison_shows_each_fit_and_what_it_costs():
    _, estimate = line()
    worse = dataclasses.replace(estimate, aic=estimate.aic + 2.5)
    fits = ij.Fitted("line", estimate, 0.1), ij.Fitted("other", worse, 0.1)
    comparison = ij.Comparison("a.csv", fits, notes=("One sample was left out.",))
    first, *_, last = str(comparison).splitlines()
    assert (first, last) == ("line, AIC +0.0:", "One sample was left out.")
    assert "other, AIC +2.5:\n  x0 = " in str(comparison)
    assert repr(comparison) == "Comparison('a.csv', line, other)"


def test_saved_estimate_is_loaded_bit_by_bit(tmp_path):
    _, estimate = line()
    ij.io.save(tmp_path / "line.npz", estimate)
    again = ij.io.load(str(tmp_path / "line.npz"), experiment())
    for one, other in zip(jax.tree.leaves(again), jax.tree.leaves(estimate), strict=True):
        np.testing.assert_array_equal(one, other)
    assert again["x0"] == estimate["x0"]


def test_saved_estimate_of_other_parameters_is_refused(tmp_path):
    ij.io.save(tmp_path / "line.npz", line()[1])
    with pytest.raises(ValueError, match="holds x0, x_dot0, but the experiment fits x0"):
        ij.io.load(tmp_path / "line.npz", experiment(fixed=("x_dot0",)))
    shorter = ij.Recording(TS[1:], line()[0][1:], ij.Displacement())
    with pytest.raises(ValueError, match="is of another recording"):
        ij.io.load(tmp_path / "line.npz", dataclasses.replace(experiment(), recording=shorter))


def test_bounds_limit_a_parameter():
    bounded = ij.fit(experiment(bounds={"x_dot0": (-1.0, 0.5)}))
    values, free = line()
    assert float(free.value("x_dot0")) > 0.6
    assert float(bounded.value("x_dot0")) == pytest.approx(0.5, abs=1e-4)
    mean = np.mean(values - 0.5 * (TS - TS[0]))
    assert float(bounded.value("x0")) == pytest.approx(mean, abs=1e-3)


def test_scattered_starts_lie_inside_the_bounds():
    begun = dataclasses.replace(experiment(), initial=ij.InitialState(1.0))
    problem = ij.build_problem(dataclasses.replace(begun, bounds={"x0": (0.99, 1.005)}))
    slopes = np.array([problem.slopes(lane)[0] for lane in ij.Starts(16).lanes(problem)])
    assert np.all(slopes > 1e-4)  # at the very end of a range a parameter has no effect


@pytest.mark.parametrize("sigma", [None, 0.05])
def test_log_density_is_the_normal_one(sigma):
    values, _ = line()
    problem = ij.build_problem(experiment(sensor=ij.Sensor(sigma=sigma)))
    at = jnp.array([0.31, 0.68])
    left = 0.31 + 0.68 * (TS - TS[0]) - values
    np.testing.assert_allclose(problem.residuals(at), left, atol=1e-12)
    size = np.sqrt(np.mean(left**2)) if sigma is None else sigma
    expected = np.sum(stats.norm.logpdf(left, scale=size))
    assert float(problem.log_density(at)) == pytest.approx(expected, rel=1e-9)
    assert float(jax.jit(lambda at: problem.log_density(at))(at)) == pytest.approx(
        expected, rel=1e-9
    )


def test_log_density_outside_the_range_is_minus_infinity():
    problem = ij.build_problem(experiment(bounds={"x_dot0": (-1.0, 0.5)}))
    assert float(problem.log_density(jnp.array([0.3, 0.6]))) == -np.inf


def test_log_density_counts_prior_knowledge():
    plain = ij.build_problem(experiment())
    known = ij.build_problem(experiment(priors={"x0": ij.Normal(0.4, 0.02)}))
    at = jnp.array([0.31, 0.68])
    added = float(known.log_density(at)) - float(plain.log_density(at))
    assert added == pytest.approx(-((0.31 - 0.4) ** 2) / (2 * 0.02**2), rel=1e-9)
    with pytest.raises(ValueError, match="`priors` speak of `x0`, which is not fitted"):
        ij.build_problem(experiment(priors={"x0": ij.Normal(0.4, 0.02)}, fixed=("x0",)))


@pytest.mark.parametrize(
    ("made", "text"),
    [
        (
            ij.Pendulum(13.0, 0.002, length=0.071),
            "Pendulum(omega_n=13.0, zeta=0.002, length=0.071)",
        ),
        (ij.Stop(ij.Walton(1e4, 20.0)), "Stop(law=Walton(k=10000.0, c=20.0))"),
        (
            ij.KelvinVoigt(700.0, 0.2, separation=ij.AtZeroForce()),
            "KelvinVoigt(omega0=700.0, gamma=0.2, separation=AtZeroForce())",
        ),
        (ij.Sensor(low_pass=ij.Butterworth(50.0)), "Sensor(low_pass=Butterworth(cutoff=50.0))"),
        (
            ij.Recording(np.arange(3.0), np.array([0.1, np.nan, 0.2]), ij.Angle()),
            "Recording(2 of 3 samples of angle, 0 to 2 s)",
        ),
        (ij.ImpactTimes(np.array([0.5, 0.8])), "ImpactTimes(2 impacts, 0.5 to 0.8 s)"),
    ],
)
def test_objects_show_their_numbers(made, text):
    assert repr(made) == text


def test_trajectory_repr_shows_result():
    run = ij.simulate(LINE, ij.InitialState(0.0, 1.0), TS, max_steps=32, max_impacts=8)
    assert repr(run) == "Trajectory(31 samples, 0 impacts, 0 rests: successful)"


def test_traced_objects_have_a_repr():
    seen = []
    jax.jit(lambda x: seen.append(repr(ij.Restitution(x))))(0.5)
    assert seen[0].startswith("Restitution(r=")
