"""Information in data about parameters: null directions, textbook regression, words."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import TS, line, swing
from laws import LAWS, MASS
from tiers import quick

SPEEDS = jnp.array([0.1, 0.3, 0.73])


def rebounds(law) -> jax.Array:
    """Separation speeds at the three approach speeds."""
    return SPEEDS * law.equivalents(SPEEDS, MASS).restitution


def angle_to(direction: np.ndarray, expected: tuple[float, float]) -> float:
    """Between two lines, in degrees."""
    unit = np.array(expected) / np.linalg.norm(expected)
    return math.degrees(math.acos(min(abs(float(direction @ unit)), 1.0)))


def simon_by_coefficients(law: ij.PowerLaw) -> jax.Array:
    """Simon's law F = k δ^1.5 + c δ^1.5 δ′; its own `c` is this one over k."""
    return rebounds(ij.Simon(law.k, law.c / law.k))


@pytest.mark.parametrize(
    ("data", "law"),
    [
        (rebounds, ij.Walton(1e4, 1e3)),
        (simon_by_coefficients, ij.PowerLaw(1e6, 4e5, 1.5, 1.5, 1.0)),
    ],
    ids=["walton", "simon"],
)
def test_speeds_determine_only_damping_over_stiffness(data, law):
    fixed = ("n", "p", "q") if isinstance(law, ij.PowerLaw) else ()
    told = ij.information_in(data, law, 1e-3, fixed=fixed)
    assert told.names == ("k", "c")
    stiff, sloppy = np.asarray(told.directions.exponents)
    assert angle_to(sloppy, (1, 1)) < 0.1
    assert angle_to(stiff, (-1, 1)) < 0.1
    assert told.directions.errors[1] > 1e4 * told.directions.errors[0]
    assert ij.coupling(told).startswith("Determined: c/k to ")
    assert "not determined: k at fixed c/k" in ij.coupling(told)


def test_simon_damping_per_stiffness_is_determined_by_speeds():
    told = ij.information_in(rebounds, ij.Simon(1e6, 0.4), 1e-3)
    assert angle_to(np.asarray(told.directions.exponents[1]), (1, 0)) < 0.1
    assert not np.isfinite(told.bounds[0])


@pytest.mark.parametrize("name", ["kelvin-voigt", "maxwell"])
def test_speeds_do_not_determine_contact_frequency(name):
    told = ij.information_in(rebounds, LAWS[name].law, 1e-3)
    assert told.names == ("omega0", "gamma")
    assert told.matrix[0, 0] == 0
    assert np.isinf(told.bounds[0])
    np.testing.assert_array_equal(told.correlation, np.eye(2))
    assert ij.coupling(told).endswith("not determined: omega0.")
    _, gamma = LAWS[name].values
    root = math.sqrt(1 - gamma**2)
    slope = math.pi / root**3 * math.exp(-math.pi * gamma / root)
    known = 1e-3 / (slope * float(jnp.linalg.norm(SPEEDS)))
    np.testing.assert_allclose(told.bounds[1], known, rtol=1e-9)


def test_contact_duration_determines_stiffness_and_damping():
    def both(law):
        return jnp.append(rebounds(law) / 1e-3, law.equivalents(0.73, MASS).duration / 1e-4)

    told = ij.information_in(both, ij.Walton(1e4, 1e3), 1.0)
    assert np.all(np.asarray(told.directions.errors) < 0.1)
    assert "not determined" not in ij.coupling(told)


def test_information_of_straight_line_gives_regression_errors():
    _, estimate = line()
    told = ij.identifiability(estimate)
    design = np.stack([np.ones(31), TS - TS[0]], axis=1)
    noise = np.sqrt(np.sum(np.asarray(estimate.residuals) ** 2) / 29)
    covariance = np.linalg.inv(design.T @ design) * noise**2
    np.testing.assert_allclose(told.bounds, np.sqrt(np.diag(covariance)), rtol=1e-9)
    known = covariance[0, 1] / math.sqrt(covariance[0, 0] * covariance[1, 1])
    np.testing.assert_allclose(told.correlation, [[1, known], [known, 1]], rtol=1e-9)
    np.testing.assert_allclose(told.sensitivities, design * np.abs(estimate.values) / noise)
    assert told.of_model == (False, False)
    assert told.directions.names == ()


def random_information(seed: int) -> tuple[np.ndarray, ij.Information]:
    """Four data sets with a linear law of power restitutions, and its matrix."""
    matrix = np.random.default_rng(seed).standard_normal((7, 4))

    def data(model: ij.ImpactOscillator) -> jax.Array:
        own = model.oscillator
        assert isinstance(own, ij.LinearOscillator)
        assert model.lower is not None
        law = model.lower.law
        assert isinstance(law, ij.PowerRestitution)
        return jnp.asarray(matrix) @ jnp.stack([own.omega_n, own.zeta, law.r0, law.alpha])

    model = ij.ImpactOscillator(
        ij.LinearOscillator(2.0, 0.5), ij.Stop(ij.PowerRestitution(0.8, 0.1))
    )
    return matrix, ij.information_in(data, model, 0.01)


def test_bounds_and_directions_of_inverse_information():
    for seed in range(5):
        matrix, told = random_information(seed)
        assert told.names == ("omega_n", "zeta", "r0", "alpha")
        np.testing.assert_allclose(told.values, [2, 0.5, 0.8, 0.1])
        covariance = np.linalg.inv(matrix.T @ matrix) * 1e-4
        errors = np.sqrt(np.diag(covariance))
        np.testing.assert_allclose(told.bounds, errors, rtol=1e-9)
        np.testing.assert_allclose(
            told.correlation, covariance / np.outer(errors, errors), rtol=1e-9
        )
        relative = covariance / np.outer(told.scale, told.scale)
        found = told.directions
        for row, error in zip(np.asarray(found.exponents), np.asarray(found.errors), strict=True):
            np.testing.assert_allclose(relative @ row, error**2 * row, rtol=1e-7, atol=1e-12)
        other = np.array([1.0, 0.0, -2.0, 0.5])
        np.testing.assert_allclose(found.error(jnp.asarray(other)) ** 2, other @ relative @ other)
        assert np.all(np.diff(found.errors) > 0)


def test_directions_treat_initial_state_as_nuisance():
    told = ij.identifiability(swing())
    assert told.names == ("omega_n", "zeta", "r", "x0")
    assert told.of_model == (True, True, True, False)
    use = [0, 1, 3]  # r is not felt at all
    scaled = np.asarray(told.sensitivities)[:, use]
    covariance = np.linalg.inv(scaled.T @ scaled)[:2, :2]
    expected = np.sqrt(np.linalg.eigvalsh(covariance))
    np.testing.assert_allclose(told.directions.errors, [*expected, np.inf], rtol=1e-9)
    assert ij.findings(told)[2].combination == "r"
    errors = np.asarray(swing().standard_errors)[use]
    np.testing.assert_allclose(np.asarray(told.bounds)[use], errors, rtol=1e-6)


def test_information_with_more_parameters_than_data():
    told = ij.information_in(
        lambda law: law.restitution(jnp.asarray(0.5)), ij.LinearRestitution(0.7, 0.1), 0.01
    )
    found = told.directions
    np.testing.assert_allclose(found.errors[0], 0.01 / math.hypot(0.7, 0.05), rtol=1e-12)
    assert np.isinf(found.errors[1])
    np.testing.assert_allclose(found.exponents @ found.exponents.T, np.eye(2), atol=1e-12)


def test_information_is_invariant_under_jit_and_vmap():
    def errors(c: jax.Array) -> jax.Array:
        return ij.information_in(rebounds, ij.Walton(1e4, c), 1e-3).directions.errors

    several = jnp.array([500.0, 1000.0, 2000.0])
    together = jax.jit(jax.vmap(errors))(several)
    alone = jnp.stack([errors(c) for c in several])
    np.testing.assert_allclose(together, alone, rtol=1e-9)


def told_by(exponents, errors, law) -> str:
    """The words for given directions: data are made so that they are what comes out."""
    names = [name for name in vars(law) if name != "separation"]
    rows = np.asarray(exponents, float)
    rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    values = np.array([float(getattr(law, name)) for name in names])

    def data(own):
        relative = jnp.stack([getattr(own, name) for name in names]) / values
        return jnp.asarray(rows / np.array(errors)[:, None]) @ relative

    return ij.coupling(ij.information_in(data, law, 1.0, free=names))


@pytest.mark.parametrize(
    ("exponents", "errors", "said"),
    [
        ([[1, -1], [1, 1]], [0.003, 7], "Determined: c/k to 0.42 %; not determined: k at fixed"),
        ([[-1, 2], [2, 1]], [0.03, 60], "Determined: c/k^(1/2) to 3.4 %; not determined: k at"),
        ([[-1, 1.37], [1.37, 1]], [0.03, 60], "Determined: c/k^0.73 to 3.7 %; not determined: k"),
        ([[1, 0], [0, 1]], [0.001, 0.2], "Determined: k to 0.10 %, c to 20 %."),
        ([[1, 0], [0, 1]], [2, 3], "Not determined: k (± 200 %), c (± 300 %)."),
        ([[1, 1], [-1, 1]], [0.001, 0.002], "Determined: k·c to 0.14 %, c/k to 0.28 %."),
    ],
)
def test_directions_in_words_are_simple_products(exponents, errors, said):
    assert told_by(exponents, errors, ij.Walton(1e4, 1e3)).startswith(said)


def test_directions_of_signed_parameters_are_sums():
    told = ij.information_in(
        lambda law: law.restitution(SPEEDS), ij.LinearRestitution(0.7, 0.1), jnp.full(3, 0.01)
    )
    first, second = ij.findings(told)
    mean = float(jnp.mean(SPEEDS))
    assert first.combination.startswith("r0 - 0.3")
    weight = float(first.combination.split()[2])
    assert weight == pytest.approx(mean, rel=0.1)
    assert second.combination == "alpha"
    assert second.amount.endswith("s/m")


def test_wrong_information_requests_are_refused():
    law = ij.Walton(1e4, 1e3)
    with pytest.raises(ValueError, match="There is no parameter `q`; there are k, c"):
        ij.information_in(rebounds, law, 1.0, free=("q",))
    with pytest.raises(ValueError, match="Walton has no parameter that is left free"):
        ij.information_in(rebounds, law, 1.0, fixed=("k", "c"))


def test_errors_of_single_parameters_are_their_bounds():
    matrix = np.array([[3.0, 8.0], [1.0, 2.0], [2.0, 5.5]])
    covariance = np.linalg.inv(matrix.T @ matrix) * 1e-6

    def data(law: ij.KelvinVoigt) -> jax.Array:
        return jnp.asarray(matrix) @ jnp.stack([law.omega0, law.gamma])

    for gamma in (0.2, 1e-11, 0.0):
        told = ij.information_in(data, ij.KelvinVoigt(1.0, gamma), 1e-3)
        errors = np.sqrt(np.diag(covariance))
        np.testing.assert_allclose(told.bounds, errors, rtol=1e-8)
        alone = jax.vmap(told.directions.error)(jnp.eye(2)) * told.scale
        np.testing.assert_array_equal(alone, told.bounds)


def test_words_of_parameter_at_range_end_agree_with_bound():
    matrix = np.array([[20.0, 130.0], [1.0, 2.0]])

    def data(law: ij.KelvinVoigt) -> jax.Array:
        return jnp.asarray(matrix) @ jnp.stack([law.omega0, law.gamma])

    covariance = np.linalg.inv(matrix.T @ matrix) * 0.01
    told = ij.information_in(data, ij.KelvinVoigt(1.0, 1e-11), 0.1)
    assert math.isclose(math.sqrt(covariance[0, 0]), 0.145, rel_tol=0.01)  # of omega0 alone
    both = np.array([1.0, 6.5])
    assert math.isclose(math.sqrt(both @ covariance @ both), 0.0050, rel_tol=0.01)
    assert ij.coupling(told) == "Determined: omega0 + 6.5 gamma to 0.50 %; not determined: gamma."


@quick
def test_information_refuses_noise_and_names_without_sense():
    def data(law):
        return law.restitution(jnp.array([0.5, 1.0]))

    law = ij.LinearRestitution(0.7, 0.1)
    for sigma in (0.0, -1.0, np.array([1e-3, np.nan])):
        with pytest.raises(ValueError, match="must be positive"):
            ij.information_in(data, law, sigma)
    with pytest.raises(ValueError, match="in both `free` and `fixed`"):
        ij.information_in(data, law, 1e-3, free=["alpha"], fixed=["alpha"])
