"""Several recordings in one estimate, against linear regression in closed form."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy import stats

import impactjax as ij
from impactjax._problem.joint_problem import JointProblem
from impactjax._report.document import document
from tiers import thorough

QUICK = ij.Simulation(max_steps=16, max_impacts=2, step=ij.TaylorStep(order=4))
LINE = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.Restitution(0.5), gap=9.0))  # never reached
SIGMAS = (0.05, 0.02)
TIMES = (np.linspace(0.0, 2.0, 31), np.linspace(0.0, 1.0, 21))
LEVELS, SLOPE = (0.3, -0.4), 0.7


def values(seed: int = 1) -> list[np.ndarray]:
    random = np.random.default_rng(seed)
    return [
        level + SLOPE * ts + sigma * random.standard_normal(ts.shape)
        for level, ts, sigma in zip(LEVELS, TIMES, SIGMAS, strict=True)
    ]


def experiments(known: bool, seed: int = 1) -> list[ij.Experiment]:
    """Two straight lines of one slope, with levels of their own."""
    return [
        ij.Experiment(
            LINE,
            ij.Recording(jnp.asarray(ts), jnp.asarray(own), ij.Displacement()),
            ij.InitialState(0.1, 0.5),
            ij.Sensor(sigma=sigma) if known else None,
            fixed=("r",),
            simulation=QUICK,
        )
        for ts, own, sigma in zip(TIMES, values(seed), SIGMAS, strict=True)
    ]


@functools.cache
def found(known: bool) -> ij.Estimate[JointProblem]:
    return ij.fit_together(experiments(known), shared=("x_dot0",))


def regression(sigmas, prior: tuple[float, float] | None = None):
    """Values and covariance of (level 0, slope, level 1) by weighted linear regression."""
    rows, right = [], []
    for i, (ts, own, sigma) in enumerate(zip(TIMES, values(), sigmas, strict=True)):
        block = np.zeros((len(ts), 3))
        block[:, 2 * i], block[:, 1] = 1.0, ts
        rows.append(block / sigma)
        right.append(own / sigma)
    if prior is not None:
        rows.append(np.array([[0.0, 1.0, 0.0]]) / prior[1])
        right.append(np.array([prior[0] / prior[1]]))
    matrix, target = np.concatenate(rows), np.concatenate(right)
    covariance = np.linalg.inv(matrix.T @ matrix)
    return covariance @ matrix.T @ target, covariance


def test_joint_names_of_shared_and_own_parameters():
    assert found(True).names == ("x0[0]", "x_dot0", "x0[1]")
    assert found(True).units == ("m", "m/s", "m")


def test_joint_fit_is_weighted_regression():
    expected, covariance = regression(SIGMAS)
    np.testing.assert_allclose(found(True).values, expected, rtol=1e-9)
    np.testing.assert_allclose(found(True).covariance, covariance, rtol=1e-9)


def test_joint_fit_estimates_noise_variances():
    """Regression and the sizes that it leaves, in turn until both rest."""
    sigmas, n = np.array(SIGMAS), sum(map(len, TIMES))
    expected, covariance, left = np.zeros(3), np.eye(3), []
    for _ in range(20):
        expected, covariance = regression(sigmas)
        left = [
            own - expected[2 * i] - expected[1] * ts
            for i, (ts, own) in enumerate(zip(TIMES, values(), strict=True))
        ]
        sigmas = np.array([np.sqrt(np.mean(e**2) / (1 - 3 / n)) for e in left])
    joint = found(False)
    np.testing.assert_allclose([float(size) for size in joint.problem.sizes], sigmas, rtol=1e-3)
    errors = np.sqrt(np.diag(covariance))
    assert np.max(np.abs(np.asarray(joint.values) - expected) / errors) < 1e-3
    np.testing.assert_allclose(joint.standard_errors, errors, rtol=2e-3)
    likelihood = -sum(
        len(ts) * np.log(np.sqrt(2 * np.pi) * sigma)
        for ts, sigma in zip(TIMES, sigmas, strict=True)
    )
    squares = sum(np.sum((e / sigma) ** 2) for e, sigma in zip(left, sigmas, strict=True))
    np.testing.assert_allclose(joint.aic, 2 * (3 + 2) - 2 * (likelihood - squares / 2), atol=0.1)


def test_prior_counts_as_an_observation():
    prior = ij.Normal(0.72, 0.01)
    first, second = experiments(True)
    first = dataclasses.replace(first, priors={"x_dot0": prior})
    joint = ij.fit_together([first, second], shared=("x_dot0",))
    expected, covariance = regression(SIGMAS, (0.72, 0.01))
    np.testing.assert_allclose(joint.values, expected, rtol=1e-9)
    np.testing.assert_allclose(joint.covariance, covariance, rtol=1e-9)


def test_of_experiment_gives_single_estimate():
    joint = found(False)
    for i, own in enumerate(values()):
        each = ij.of_experiment(joint, i)
        assert each.names == ("x0", "x_dot0")
        level, slope = float(each.value("x0")), float(each.value("x_dot0"))
        line = level + slope * TIMES[i]
        np.testing.assert_allclose(each.residuals[: len(own)], line - own, atol=1e-12)
        np.testing.assert_allclose(each.jacobian[: len(own), 1], TIMES[i], atol=1e-9)
        assert each.standard_error("x_dot0") == joint.standard_error("x_dot0")
        assert float(each.system.initial.velocity) == slope


def test_profile_of_joint_linear_problem_is_its_interval():
    profile = ij.profiled(found(True))
    np.testing.assert_allclose(profile.low, found(True).low, rtol=1e-6)
    np.testing.assert_allclose(profile.high, found(True).high, rtol=1e-6)
    assert ij.identifiability(profile).names == profile.names


@pytest.mark.parametrize(
    "use",
    [
        ij.residual_diagnostics,
        lambda joint: joint.system,
        lambda joint: document([ij.Comparison("two", (ij.Fitted("free flight", joint, 1.0),))]),
        lambda joint: ij.plot.fit(plt.figure().add_subplot(), joint),
        lambda joint: ij.plot.starts(plt.figure().add_subplot(), joint),
    ],
)
def test_joint_estimate_refuses_single_recording_functions(use):
    with pytest.raises(ValueError, match="several recordings: take that of one"):
        use(found(known=True))


@thorough
def test_joint_fits_under_vmap():
    def slope(first, second):
        posed = [
            dataclasses.replace(
                each, recording=ij.Recording(jnp.asarray(ts), own, ij.Displacement())
            )
            for each, ts, own in zip(experiments(True), TIMES, (first, second), strict=True)
        ]
        return ij.fit_together(posed, shared=("x_dot0",)).value("x_dot0")

    both = [jnp.stack(own) for own in zip(*(values(seed) for seed in (1, 2)), strict=True)]
    slopes = jax.vmap(slope)(*both)
    np.testing.assert_allclose(slopes[0], found(True).value("x_dot0"), rtol=1e-9)
    assert slopes[0] != slopes[1]


def test_tied_parameter_follows():
    """A mass that starts so fast that it is at twice its first place after a second."""
    recording = experiments(True)[0].recording
    estimate = ij.fit(
        ij.Experiment(
            LINE,
            recording,
            ij.InitialState(0.1),
            fixed=("r",),
            ties={"x_dot0": lambda at: 2 * at["x0"]},
            simulation=QUICK,
        )
    )
    shape = 1 + 2 * TIMES[0]
    assert estimate.names == ("x0",)
    expected = np.sum(shape * values()[0]) / np.sum(shape**2)
    np.testing.assert_allclose(estimate.value("x0"), expected, rtol=1e-9)
    np.testing.assert_allclose(estimate.system.initial.velocity, 2 * expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"shared": ("speed",)}, "no experiment fits a parameter `speed`"),
        ({"shared": ("x0",), "own": ("x0",)}, "both shared and"),
    ],
)
def test_joint_fit_refuses_wrong_names(wrong, sentence):
    with pytest.raises(ValueError, match=f"(?i){sentence}"):
        ij.fit_together(experiments(True), **wrong)


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (("x9", None), "no parameter `x9`"),
        (("r", None), "`priors` speak of `r`, which is not fitted"),
        (("x_dot0", "x_dot0"), "Two experiments have a prior of `x_dot0`, which they share"),
    ],
)
def test_joint_fit_refuses_priors_of_nothing_and_twice(names, sentence):
    known = ij.Normal(0.7, 0.01)
    both = [
        dataclasses.replace(each, priors={} if name is None else {name: known})
        for each, name in zip(experiments(True), names, strict=True)
    ]
    with pytest.raises(ValueError, match=sentence):
        ij.fit_together(both, shared=("x_dot0",))


@thorough
def test_log_density_of_a_joint_problem_weighs_the_prior():
    """The difference of two points, by SciPy's normal densities."""
    known = ij.Normal(0.5, 0.01)
    first = dataclasses.replace(experiments(False)[0], priors={"x0": known})
    joint = ij.fit_together([first]).problem
    size, ts, right = float(joint.sizes[0]), TIMES[0], values()[0]

    def density(level, slope):
        line = stats.norm.logpdf(level + slope * ts - right, scale=size)
        return np.sum(line) + stats.norm.logpdf(level, 0.5, 0.01)

    one, other = (0.48, 0.7), (0.52, 0.65)
    found = [float(joint.log_density(jnp.array(at))) for at in (one, other)]
    np.testing.assert_allclose(found[0] - found[1], density(*one) - density(*other), rtol=1e-8)


def test_prior_of_a_single_experiment_counts():
    sigma = 0.01
    first = dataclasses.replace(experiments(True)[0], priors={"x0": ij.Normal(0.5, sigma)})
    joint = ij.fit_together([first])
    assert joint.names == ("x0", "x_dot0")
    ts, right = TIMES[0], values()[0]
    rows = np.stack([np.ones_like(ts), ts], axis=1) / SIGMAS[0]
    design = np.vstack([rows, [1 / sigma, 0.0]])
    expected, *_ = np.linalg.lstsq(design, np.append(right / SIGMAS[0], 0.5 / sigma))
    np.testing.assert_allclose(joint.values, expected, rtol=1e-8)


def test_joint_fit_refuses_empty_and_wrong_priors():
    with pytest.raises(ValueError, match="no experiment"):
        ij.fit_together([])
    with pytest.raises(ValueError, match="`sigma` must be finite and greater than 0"):
        ij.Normal(0.0, 0.0)
