"""Curves of special points in two parameters, at closed forms."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

import impactjax as ij
from forced_systems import REST, Below, Map, ModelV
from impactjax._response.linear import linearised
from model_v import closed_form

FREQUENCIES, AMPLITUDES = (0.79, 0.83), (0.25, 0.6)


def frequency(system):
    return system.frequency


@functools.cache
def branch_of(omega, first, between):
    system = ModelV(jnp.array(first), jnp.array(omega))
    orbit = ij.periodic_orbit(system, REST, ModelV.period, multiple=2, settle=300)
    return ij.follow(orbit, lambda system: system.amplitude, between)


def only(branch, kind):
    (found,) = [each for each in branch.special if each.kind == kind]
    return found


@pytest.mark.parametrize("rounding", [0.0, 1e-16])
def test_grazing_in_two_parameters(rounding):
    """The amplitude at which the forced motion without impacts reaches the stop."""
    special = only(branch_of(0.81, 0.36, (0.3, 0.37)), "grazing")
    linear = special.orbit.linear
    linear = linearised(linear.cycle, linear.unknowns + rounding)
    special = special._replace(orbit=dataclasses.replace(special.orbit, linear=linear))
    found = ij.special_curve(special, frequency, FREQUENCIES, AMPLITUDES)
    assert found.complete
    assert found.ends == ("end of the range", "end of the range")
    assert list(found.second[[0, -1]]) == list(FREQUENCIES)
    square = (1 - found.second**2) ** 2 + (0.04 * found.second) ** 2
    np.testing.assert_allclose(found.first, np.sqrt(square), rtol=1e-12)


def test_grazing_of_a_motion_without_impacts():
    """The least distance from the stop vanishes: A = |(1 − ω²) + 0.1 iω|."""
    system, start = Below(jnp.array(0.05), jnp.array(1.0)), ij.Start(0.0, (0.0, 0.0))
    orbit = ij.periodic_orbit(system, start, Below.period)
    branch = ij.follow(orbit, lambda system: system.amplitude, (0.01, 0.5))
    special = only(branch, "grazing")
    found = ij.special_curve(special, frequency, (0.9, 1.2), (0.01, 1.0))
    assert found.complete
    exact = np.hypot(1 - found.second**2, 0.1 * found.second)
    np.testing.assert_allclose(found.first, exact, rtol=1e-11)


def test_curve_from_an_end_of_its_range():
    """There is nothing on one side."""
    special = only(branch_of(0.81, 0.36, (0.3, 0.37)), "grazing")
    found = ij.special_curve(special, frequency, (0.81, 0.83), AMPLITUDES)
    assert found.complete
    assert np.all(np.diff(found.second) > 0)
    assert found.second[0] == 0.81


def test_curve_that_leaves_the_first_range():
    special = only(branch_of(0.81, 0.36, (0.3, 0.37)), "grazing")
    found = ij.special_curve(special, frequency, FREQUENCIES, (0.3, 0.36))
    assert found.ends == ("end of the first range", "end of the range")
    assert found.first[0] == pytest.approx(0.36, abs=1e-4)


def test_curve_of_few_points():
    special = only(branch_of(0.81, 0.36, (0.3, 0.37)), "grazing")
    found = ij.special_curve(special, frequency, FREQUENCIES, AMPLITUDES, max_points=2)
    assert found.ends == ("largest number of points", "largest number of points")
    assert not found.complete
    assert len(found.first) == 5


def test_period_doubling_in_two_parameters():
    special = only(branch_of(0.81, 0.36, (0.3, 0.37)), "period doubling")
    found = ij.special_curve(special, frequency, FREQUENCIES, AMPLITUDES)
    assert found.second[-1] == FREQUENCIES[1]
    assert found.ends == ("grazing", "end of the range")
    border = closed_form(repr(float(found.second[0])), 2)
    assert 0 < found.first[0] - border.amplitude(0) < 1e-6
    for index, (first, second) in enumerate(zip(found.first, found.second, strict=True)):
        exact = closed_form(repr(float(second)), 2)
        speed = mpmath.mpf(float(found.orbit(index).events.before["v"][0]))
        assert first == pytest.approx(exact.amplitude(speed), rel=1e-12)
        if speed > 0.01:  # from where its root is found
            assert first == pytest.approx(exact.amplitude(exact.doubling()), rel=1e-12)
    nearest = np.min(np.abs(found.multipliers + 1), axis=1)
    np.testing.assert_allclose(nearest, 0.0, atol=1e-8)
    middle = found.orbit(len(found.first) // 2)
    assert middle.result == ij.RESULTS.successful
    assert float(vars(middle.system)["frequency"]) == found.second[len(found.first) // 2]


class Cubic(Map):
    """x → x + (a + b x − x³)/5: fixed points with folds at 27 a² = 4 b³, and a cusp at 0."""

    a: jax.Array
    b: jax.Array

    def image(self, y):
        return y + (self.a + self.b * y - y**3) / 5


class Delayed(Map):
    """(x, y) → (y, a y (1 − x) − b y²): the fixed point turns at b = a (a − 2)."""

    a: jax.Array
    b: jax.Array

    def image(self, y):
        x, y = y
        return jnp.stack([y, self.a * y * (1 - x) - self.b * y**2])


def specials(system, start, kind, between):
    orbit = ij.periodic_orbit(system, ij.Start(0.0, jnp.array(start)), 1.0, settle=100)
    branch = ij.follow(orbit, lambda system: system.a, between)
    return [each for each in branch.special if each.kind == kind]


def test_folds_go_through_their_cusp():
    system = Cubic(jnp.array(-0.6), jnp.array(0.5))
    first, *_ = specials(system, -1.0, "fold", (-0.7, 0.7))
    found = ij.special_curve(first, lambda system: system.b, (-0.1, 1.0), (-0.7, 0.7))
    assert found.complete
    np.testing.assert_allclose(27 * found.first**2, 4 * found.second**3, atol=1e-11)
    assert found.first[0] * found.first[-1] < 0  # both branches of the cusp
    assert list(found.second[[0, -1]]) == [1.0, 1.0]
    assert 0 <= np.min(found.second) < 0.01


def test_neimark_sacker_in_two_parameters():
    system = Delayed(jnp.array(1.8), jnp.array(0.0))
    (special,) = specials(system, [0.4, 0.4], "Neimark-Sacker", (1.7, 2.1))
    found = ij.special_curve(special, lambda system: system.b, (-0.1, 0.3), (1.5, 2.5))
    assert found.complete
    np.testing.assert_allclose(found.second, found.first * (found.first - 2), atol=1e-9)
    np.testing.assert_allclose(np.abs(found.multipliers), 1.0, atol=1e-8)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"where": lambda system: system.amplitude}, "the parameter of the branch: choose another"),
        ({"where": lambda system: 3.0}, "must select one real number"),
        ({"between": (0.9, 1.0)}, "`between` must be a range around the value"),
        ({"first_between": (0.5, 0.6)}, "`first_between` must be a range around the value"),
        ({"longest": -1.0}, "`longest` must be positive"),
        ({"max_points": 0}, "`max_points` must be at least 1"),
    ],
)
def test_wrong_request_is_one_sentence(changed, sentence):
    arguments = {"where": frequency, "between": FREQUENCIES, "first_between": AMPLITUDES, **changed}
    special = only(branch_of(0.81, 0.36, (0.3, 0.37)), "grazing")
    with pytest.raises(ValueError, match=sentence):
        ij.special_curve(special, **arguments)


def test_end_of_the_range_has_no_curve():
    special = only(branch_of(0.81, 0.36, (0.3, 0.37)), "end of the range")
    with pytest.raises(ValueError, match="of the kind `end of the range`; there are curves of"):
        ij.special_curve(special, frequency, FREQUENCIES, AMPLITUDES)


def test_begin_of_a_doubled_branch_has_no_curve():
    """It is a point of the branch of single orbits."""
    special = only(branch_of(0.81, 0.36, (0.3, 0.37)), "period doubling")
    twice = ij.follow(ij.doubled(special.orbit), lambda system: system.amplitude, (0.34, 0.37))
    begin = [each for each in twice.special if each.kind == "period doubling"][-1]
    assert begin.parameter == pytest.approx(special.parameter, rel=1e-9)
    with pytest.raises(ValueError, match="orbits with half the period"):
        ij.special_curve(begin, frequency, FREQUENCIES, AMPLITUDES)
