"""Values that rest on a lever, a mass or a gravity that nobody stated."""

import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import line
from impactjax._compare.laws import LAWS
from impactjax._first_look.first_look import FirstLook
from impactjax._model.law import AbstractImpactLaw
from impactjax._problem.assumptions import assumptions, rests
from impactjax._problem.dimensions import dimensions, unit_of
from impactjax._problem.parameters import handles
from impactjax._report.document import document
from impactjax._report.given import given, given_sentences, taken
from impactjax._report.page import page
from impactjax._sensor.system import Start, System

pytestmark = pytest.mark.usefixtures("numpy_promotes")

GRAVITY = 9.80665


def system(oscillator, law=None, unit="rad", gap=0.0, velocity=0.0):
    stop = None if law is None else ij.Stop(law, gap=gap)
    model = ij.ImpactOscillator(oscillator, stop)
    return System(model, ij.InitialState(0.5, velocity), Start(0.0), ij.Sensor(), unit)


def samples(quantity):
    return ij.Recording(jnp.arange(3.0), jnp.arange(3.0), quantity)


def resting(whole, recording, *names, stated=()):
    assumed = assumptions(whole, names, stated)
    return rests(whole, recording, names, assumed)


def shown(found):
    return {name: (rest.own_name(name), rest.unit) for name, rest in found.items()}


PENDULUM = ij.Pendulum(10.0, 0.01)


@pytest.mark.parametrize(
    ("unit", "read"),
    [
        ("s/m", "s/m"),
        ("N/m^1.5", "kg/(m^0.5 s²)"),
        ("N s/m²", "kg/(m s)"),
        ("N/m^n", "kg/(m^0.5 s²)"),
        ("N s^q/m^(p+q)", "kg/(m s)"),
        ("(m/s)^alpha", "m^0.25/s^0.25"),
        ("rad/s²", "rad/s²"),
        ("1", "1"),
        ("Hz", "1/s"),
    ],
)
def test_units_are_parsed(unit, read):
    found = dimensions(unit, {"n": 1.5, "p": 0.5, "q": 0.5 + 0.5, "alpha": 0.25})
    if unit == "N s^q/m^(p+q)":
        read = "kg/(m^0.5 s)"
    assert found is not None
    assert unit_of(found) == read


@pytest.mark.parametrize("unit", ["furlong", "m^", "(m", "m)", "s//", "unit of the quantity"])
def test_invalid_units_are_not_parsed(unit):
    assert dimensions(unit) is None or unit == "s//"


def scaled(law, length, mass):
    """The law with its parameters in other metres and kilograms, by their units."""
    known = handles(system(ij.FreeMass(), law))
    own = {name: handle for name, handle in known.items() if "law" in handle.path}
    values = {name: float(handle.get(system(ij.FreeMass(), law))) for name, handle in own.items()}
    factors = []
    for handle in own.values():
        found = dimensions(handle.allowed.unit, values)
        assert found is not None
        factors.append(length ** found.get("m", 0.0) * mass ** found.get("kg", 0.0))
    return eqx.tree_at(
        lambda each: [getattr(each, name) for name in own],
        law,
        [jnp.asarray(values[name] * f) for name, f in zip(own, factors, strict=True)],
    )


@pytest.mark.parametrize("name", LAWS)
def test_units_of_laws_give_their_scaling(name):
    """Twice the metre and thrice the kilogram: the same restitution, six times the force."""
    seen = FirstLook(
        ij.FreeMass(2.0),
        ij.InitialState(0.1),
        np.array([0.5, 0.4, 0.3]),
        np.array([0.6, 0.65, 0.7]),
        700.0,
        False,
    )
    law = LAWS[name](seen)
    other = scaled(law, 2.0, 3.0)
    v, depth, m = jnp.asarray(0.7), jnp.asarray(1e-3), jnp.asarray(2.0)
    if isinstance(law, AbstractImpactLaw):
        assert isinstance(other, AbstractImpactLaw)
        np.testing.assert_allclose(other.restitution(2 * v), law.restitution(v), rtol=1e-12)
        return
    assert isinstance(law, ij.AbstractForceLaw)
    assert isinstance(other, ij.AbstractForceLaw)
    before, after = law.touch(v, m), other.touch(2 * v, 3 * m)
    force, more = law.force(depth, v, before, m), other.force(2 * depth, 2 * v, after, 3 * m)
    np.testing.assert_allclose(more, 6 * force, rtol=1e-12)


def test_lever_and_mass_of_a_pendulum():
    angle = samples(ij.Angle())
    line_ = system(PENDULUM, ij.LinearRestitution(0.6, 0.2))
    names = ("omega_n", "zeta", "r0", "alpha", "theta0")
    assert shown(resting(line_, angle, *names)) == {"alpha": ("alpha·length", "s/rad")}
    assert resting(line_, angle, *names, stated=("length",)) == {}
    known = system(ij.Pendulum(10.0, 0.01, length=0.07), ij.LinearRestitution(0.6, 0.2))
    assert resting(known, angle, *names) == {}
    simon = system(PENDULUM, ij.Simon(1e6, 0.3))
    assert shown(resting(simon, angle, "omega_n", "k", "c")) == {
        "k": ("k·length^0.5/mass", "1/(s² rad^0.5)"),
        "c": ("c·length", "s/rad"),
    }
    assert shown(resting(simon, angle, "k", "c", stated=("mass",))) == {
        "k": ("k·length^0.5", "kg/(s² rad^0.5)"),
        "c": ("c·length", "s/rad"),
    }
    power = system(PENDULUM, ij.PowerRestitution(0.5, 0.25))
    assert shown(resting(power, angle, "r0", "alpha")) == {
        "r0": ("r0/length^0.25", "rad^0.25/s^0.25")
    }
    linear = system(PENDULUM, ij.KelvinVoigt(700.0, 0.2))
    assert resting(linear, angle, "omega_n", "omega0", "gamma") == {}


def test_linear_oscillator_depends_on_no_lever():
    spring = system(ij.LinearOscillator(10.0), ij.Hertz(1e6), unit="m")
    found = resting(spring, samples(ij.Displacement()), "omega_n", "k", "x0")
    assert shown(found) == {"k": ("k/mass", "1/(m^0.5 s²)")}
    heavy = system(ij.LinearOscillator(10.0, mass=0.02), ij.Hertz(1e6), unit="m")
    assert resting(heavy, samples(ij.Displacement()), "omega_n", "k", "x0") == {}


def test_impact_times_depend_on_gravity():
    ball = system(ij.BouncingBall(), ij.LinearRestitution(0.8, 0.1), unit="s", velocity=1.4)
    ball = eqx.tree_at(lambda each: each.initial.position, ball, jnp.asarray(0.0))
    heard = ij.ImpactTimes(jnp.array([0.0, 1.0, 1.5]))
    assert shown(resting(ball, heard, "r0", "alpha", "x_dot0", "t0")) == {
        "alpha": ("alpha·gravity", "1/s"),
        "x_dot0": ("x_dot0/gravity", "s"),
    }
    assert resting(ball, heard, "r0", "alpha", "x_dot0", stated=("gravity",)) == {}
    stated_speed = resting(ball, heard, "r0", "alpha", "t0")  # x_dot0 is given: it knows the metre
    assert {name: rest.powers for name, rest in stated_speed.items()} == dict.fromkeys(
        ("r0", "alpha", "t0")
    )


def test_displacement_record_fixes_the_length_scale():
    """A fall in metres beside an assumed gravity, a force in newtons beside an assumed mass."""
    ball = system(ij.BouncingBall(), ij.Restitution(0.8), unit="m")
    found = resting(ball, samples(ij.Displacement()), "r", "x0")
    assert {name: (rest.on, rest.powers) for name, rest in found.items()} == {
        "r": (("gravity",), None),
        "x0": (("gravity",), None),
    }
    spring = system(ij.LinearOscillator(10.0), ij.Hertz(1e6), unit="N")
    assert resting(spring, samples(ij.ContactForce()), "k")["k"].powers is None
    freed = resting(spring, samples(ij.ContactForce()), "k", "gain")
    assert shown(freed) == {"k": ("k/mass", "1/(m^0.5 s²)"), "gain": ("gain·mass", "kg")}


def test_stated_stiffness_fixes_length_and_mass_scale():
    found = resting(system(PENDULUM, ij.Simon(1e6, 0.3)), samples(ij.Angle()), "omega_n", "c")
    assert {name: rest.powers for name, rest in found.items()} == {"omega_n": None, "c": None}


class Odd(AbstractImpactLaw):
    """A law of one's own with a unit that nothing here can read."""

    r: jax.Array = eqx.field(
        converter=jnp.asarray, metadata=ij.parameter("furlong", at_least=0, at_most=1)
    )

    def restitution(self, speed):
        return self.r


def test_parameter_with_unreadable_unit_depends_on_all_assumptions():
    rest = resting(system(PENDULUM, Odd(0.5)), samples(ij.Angle()), "omega_n", "r")["r"]
    assert (set(rest.on), rest.powers) == ({"length", "mass"}, None)


TRUTH = {"omega_n": 12.0, "zeta": 0.004, "r0": 0.75, "alpha": 0.1853, "theta0": 0.7}
LEVER = 0.071


@pytest.fixture(scope="module")
def fitted() -> ij.Fitted:
    """A pendulum with a lever of 71 mm that nobody states."""
    ts = np.linspace(0, 2.0, 501)
    oscillator = ij.Pendulum(TRUTH["omega_n"], TRUTH["zeta"], length=LEVER)
    law = ij.LinearRestitution(TRUTH["r0"], TRUTH["alpha"])
    run = ij.simulate(ij.ImpactOscillator(oscillator, ij.Stop(law)), ij.InitialState(0.7), ts)
    values = np.asarray(run.position) + 1e-3 * np.random.default_rng(0).standard_normal(501)
    recording = ij.Recording(jnp.asarray(ts), jnp.asarray(values), ij.Angle())
    sensor = {"offset": 0.0, "drift": 0.0, "gain": 1.0}
    prepared = ij.prepare(recording, laws=["linear-restitution"], fixed=sensor)
    estimate = ij.fit(prepared.experiment, starts=ij.Starts(4))
    return ij.Fitted("linear-restitution", estimate, 0.0, stated=tuple(sensor))


def test_scale_free_value_is_the_true_one(fitted):
    estimate, known = fitted.estimate, given(fitted)
    lever = GRAVITY / TRUTH["omega_n"] ** 2
    assert abs(float(estimate.value("alpha")) - TRUTH["alpha"] * LEVER / lever) < 4 * float(
        estimate.standard_error("alpha")
    )
    own = known.own["alpha"]
    assert (own.name, own.unit) == ("alpha·length", "s/rad")
    assert abs(own.value - TRUTH["alpha"] * LEVER) < 4 * own.error
    assert set(known.own) == {"alpha"}
    both = [estimate.names.index(name) for name in ("alpha", "omega_n")]
    powers = np.array([1.0, -2.0])  # of alpha g / omega², by hand
    slopes = powers * own.value / np.asarray(estimate.values)[both]
    expected = np.sqrt(slopes @ np.asarray(estimate.covariance)[np.ix_(both, both)] @ slopes)
    np.testing.assert_allclose(own.error, expected, rtol=1e-6)


def test_assumptions_appear_in_sentences_page_and_document(fitted):
    (said,) = given_sentences(fitted)
    assert re.match(r"alpha rests on length = 0\.068\d+ m \(not stated; that of a point mass", said)
    assert re.search(r"tells alpha·length: 0\.01\d+ ± 0\.000\d+ s/rad\.$", said)
    text = re.sub(r"<[^>]*>", "", page([ij.Comparison("x", (fitted,))], ""))
    plain = " ".join(text.split())
    assert "identified, given length" in plain
    assert "alpha·length" in plain
    assert "Speeds rest on length = 0.068" in plain
    (fit,) = document([ij.Comparison("x", (fitted,))])["fits"]
    alpha, r0 = fit["parameters"]["alpha"], fit["parameters"]["r0"]
    assert (alpha["rests_on"], r0["rests_on"], r0["own"]) == (["length"], [], None)
    assert alpha["own"]["unit"] == "s/rad"
    assert abs(alpha["own"]["value"] - TRUTH["alpha"] * LEVER) < 4 * alpha["own"]["standard_error"]
    assert [each["name"] for each in fit["assumptions"]] == ["length", "mass"]
    assert fit["parameters"]["gap"]["assumed"]
    assert not alpha["assumed"]


def test_stated_values_are_not_listed_as_assumptions(fitted):
    stated = fitted._replace(stated=("length", "mass", "gap"))
    assert given_sentences(stated) == []
    (fit,) = document([ij.Comparison("x", (stated,))])["fits"]
    assert fit["assumptions"] == []
    assert not any(each["rests_on"] for each in fit["parameters"].values())
    assert not fit["parameters"]["gap"]["assumed"]


def test_page_lists_all_assumptions(fitted):
    said = " ".join(taken(fitted))
    assert "On it rests: alpha." in said
    assert "mass = 1 kg (not stated; the default). On it rests: no value." in said
    assert "gap = 0 rad (neither fitted nor stated)." in said
    assert "Of the sensor: delay = 0 s" in said
    assert "a Butterworth low-pass of order 2" in said


def test_printed_estimate_names_assumptions(fitted):
    lines = dict(each.split(" = ", 1) for each in str(fitted.estimate).splitlines() if "=" in each)
    assert lines["alpha"].endswith("s/m (identified, given length)")
    assert lines["omega_n"].endswith("rad/s (identified)")
    assert "given" not in str(line()[1])
