"""Requests of a fit are carried out, or refused with a sentence."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import SMALL, line
from tiers import thorough

TS = np.linspace(0.0, 1.0, 41)
SWING = ij.Recording(
    jnp.asarray(TS),
    jnp.asarray(np.cos(5 * TS) + 0.01 * np.random.default_rng(3).standard_normal(41)),
    ij.Displacement(),
)
FREE = ij.ImpactOscillator(ij.LinearOscillator(5.1, 0.01))


def fitted(model=FREE, **arguments):
    start = ij.InitialState(0.9)
    return ij.fit(ij.Experiment(model, SWING, start, simulation=SMALL, **arguments))


def test_fixed_values_are_used():
    found = fitted(fixed={"zeta": 0.0017, "x_dot0": 0})
    assert found.names == ("omega_n", "x0")
    oscillator = found.system.model.oscillator
    assert isinstance(oscillator, ij.LinearOscillator)
    assert float(oscillator.zeta) == 0.0017
    assert float(found.system.initial.velocity) == 0
    assert found.verdict("zeta") is ij.Verdict.FIXED


@thorough
def test_fixed_values_may_be_traced():
    @jax.jit
    def x0(zeta):
        return fitted(fixed={"zeta": zeta, "x_dot0": 0.0}).value("x0")

    alone = fitted(fixed={"zeta": 0.0017, "x_dot0": 0}).value("x0")
    np.testing.assert_allclose(x0(0.0017), alone, rtol=1e-9)


class Plain(ij.AbstractImpactLaw):
    """A restitution that is not declared as a parameter."""

    r: jax.Array = eqx.field(converter=ij.as_parameter)

    def restitution(self, speed):
        return self.r * jnp.ones_like(speed)


class Amplified(ij.AbstractImpactLaw):
    """A restitution whose parameter is called as the sensor's."""

    gain: jax.Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("1", at_least=0))

    def restitution(self, speed):
        return self.gain * jnp.ones_like(speed)


class Nested(ij.AbstractImpactLaw):
    """A law made of another."""

    inner: ij.Restitution

    def restitution(self, speed):
        return self.inner.restitution(speed)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (Plain(0.5), "model.lower.law.r is a number without a unit and a range"),
        (Nested(ij.Restitution(0.5)), "model.lower.law.inner.r is a number without a unit"),
        (
            Amplified(0.5),
            "Two parameters are called `gain`, model.lower.law.gain and sensor.gain",
        ),
    ],
)
def test_undeclared_parameters_are_refused(law, words):
    with pytest.raises(ValueError, match=words):
        fitted(ij.ImpactOscillator(ij.LinearOscillator(5.1, 0.01), ij.Stop(law, gap=2.0)))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"fixed": {"zeat": 0.0017}}, "no parameter `zeat`; did you mean `zeta`?"),
        ({"fixed": {"zeta": -0.1}}, "`zeta` must be .*, but it is -0.1"),
        ({"fixed": {"zeta": np.nan}}, "`zeta` must be .*, but it is nan"),
        ({"fixed": {"zeta": np.ones(2)}}, "`zeta` must be one number, but its shape is .2,."),
        ({"free": "mass"}, "`free` must be a list of names"),
    ],
)
def test_wrong_fit_requests_are_refused(arguments, words):
    with pytest.raises((TypeError, ValueError), match=words):
        fitted(**arguments)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"laws": ["restitutions"]}, "no law `restitutions`; did you mean `restitution`"),
        ({"fixed": {"zetta": 0.1}}, "did you mean `zeta`"),
        ({"start": {"omgea_n": 5.0}}, "did you mean `omega_n`"),
        ({"free": ("masse",)}, "did you mean `mass`"),
        ({"oscillator": ij.BouncingBall(), "fixed": {"zeta": 0.1}}, "no parameter `zeta`"),
        ({"oscillator": ij.Pendulum(5.0)}, "record of displacement does not suit a Pendulum"),
        ({"start": {"t0": 1.0}}, "`t0` cannot be started elsewhere"),
        ({"start": {"zeta": -1.0}}, "`zeta` must be .* it is -1"),
        ({"fixed": {"mass": 1.0}, "free": ("mass",)}, "`mass` is in both `free` and `fixed`"),
    ],
)
def test_wrong_prepare_requests_are_refused(said, words):
    with pytest.raises(ValueError, match=words):
        ij.prepare(SWING, **{"laws": ["none"], **said})


def test_information_needs_lists_of_names():
    law = ij.Restitution(0.5)
    with pytest.raises(TypeError, match="`fixed` must be a list of names"):
        ij.information_in(lambda own: own.restitution(jnp.ones(2)), law, 1.0, fixed="r")


def test_batched_estimate_refuses_single_fit_methods():
    _, one = line()
    many = jax.tree.map(lambda x: jnp.stack([x, x, x]), one)
    assert str(many) == "3 fits of x0, x_dot0: 3 converged, 3 of them describe their record"
    for ask in (lambda e: e.verdict("x0"), lambda e: e.quoted("x0"), ij.profiled):
        with pytest.raises(ValueError, match="holds 3 fits: take one of them"):
            ask(many)
