"""Starting values of each law: the restitution, speed and duration of the first look."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._compare.laws import LAWS, USUAL_LAWS
from impactjax._first_look.first_look import FirstLook
from laws import CLOSED, INTEGRATED, MASS, RIGID
from tiers import thorough

CONTACT = 700.0
SPEEDS = np.array([0.7, 0.6, 0.5, 0.4])


def seen(r, slope=0.0):
    pendulum = ij.Pendulum(13.0, mass=MASS)
    ratios = r - slope * (SPEEDS - np.median(SPEEDS))
    return FirstLook(pendulum, ij.InitialState(0.7), SPEEDS, ratios, CONTACT, False)


def start(name, guess) -> Any:
    return LAWS[name](guess)


def test_starting_values_of_every_law_are_tested():
    named = [*RIGID, *CLOSED, *INTEGRATED]
    named.remove("kelvin-voigt without pull")
    assert sorted(LAWS) == sorted(named)
    assert set(USUAL_LAWS) <= set(LAWS)


@pytest.mark.parametrize("r", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("name", [name for name in CLOSED if name in LAWS])
def test_starting_law_has_observed_restitution_and_duration(name, r):
    law = start(name, seen(r))
    found = law.equivalents(seen(r).speed, MASS)
    np.testing.assert_allclose(found.restitution, 1.0 if name == "hertz" else r, rtol=1e-12)
    assert abs(float(found.duration) * CONTACT / math.pi - 1) < 0.3


@pytest.mark.parametrize("name", RIGID)
def test_rigid_starting_law_has_observed_restitution(name):
    guess = seen(0.6, slope=0.3)
    law = start(name, guess)
    np.testing.assert_allclose(law.restitution(jnp.asarray(guess.speed)), 0.6, rtol=1e-12)
    by_speed = jax.grad(law.restitution)(jnp.asarray(guess.speed))
    expected = 0.0 if name == "restitution" else -0.3
    np.testing.assert_allclose(by_speed, expected, atol=1e-9)


@thorough
def test_starting_values_of_laws_without_closed_form():
    guess = seen(0.6)
    simon, own = start("simon", guess), start("pust-peterka", guess)
    assert (own.k, own.alpha, own.q) == (simon.k, simon.c, 1)
    for name, tolerance in (("power-law", 1e-6), ("hertz-dashpot", 0.1)):
        found = ij.single_impact(start(name, guess), guess.speed, MASS)
        assert abs(float(found.restitution) - 0.6) < tolerance
        assert abs(float(found.duration) * CONTACT / math.pi - 1) < 0.3
