"""Single blows recorded by their force alone, from closed forms and SciPy's integrator."""

import json
import math

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate

import impactjax as ij
from command import impactjax
from impactjax._first_look.blow import blow
from impactjax._record.file_error import FileError
from impactjax._record.read_recording import read_recording
from records import record_file
from tiers import thorough

MASS, OMEGA0, GAMMA, SPEED, TOUCH = 0.3, 1290.0, 0.12, 1.2, 0.0123
RATE, NOISE = 40e3, 1.0
RESONANCE, DAMPING = 5000.0, 0.05
TS = np.arange(1600) / RATE


def kelvin_voigt(place, rate):
    """Force of a spring and a dashpot that do not pull."""
    pushed = -MASS * OMEGA0 * (OMEGA0 * place + 2 * GAMMA * rate)
    return max(pushed, 0.0) if place < 0 else 0.0


def forces(resonance=None):
    """Forces at the samples without noise, behind a load cell if it has a resonance."""
    omega = 2 * math.pi * (resonance or 0.0)

    def rates(_, y):
        force = kelvin_voigt(y[0], y[1])
        return [y[1], force / MASS, y[3], omega**2 * (force - y[2]) - 2 * DAMPING * omega * y[3]]

    at = TS[TS >= TOUCH] - TOUCH
    touched = [0.0, -SPEED, 0.0, 0.0]
    settings = {"method": "DOP853", "max_step": 1e-5, "rtol": 1e-10, "atol": 1e-13}
    y = integrate.solve_ivp(rates, (0.0, at[-1]), touched, t_eval=at, **settings).y
    shown = y[2] if resonance else np.array([kelvin_voigt(*each) for each in y[:2].T])
    return np.concatenate([np.zeros(TS.size - at.size), shown])


def values(resonance=None):
    return forces(resonance) + NOISE * np.random.default_rng(3).standard_normal(TS.size) + 2.0


def recording(resonance=None):
    return ij.Recording(TS, values(resonance), ij.ContactForce())


def agrees(estimate, truths):
    """True if each value is within four standard errors and 2 % of the truth."""
    for name, truth in truths.items():
        found = estimate[name]
        assert found.verdict is ij.Verdict.IDENTIFIED, name
        assert abs(found.value - truth) < 4 * found.standard_error, name
        assert found.value == pytest.approx(truth, rel=0.02), name


BEST = "kelvin-voigt without pull"
CONTACT = {"omega0": OMEGA0, "gamma": GAMMA, "x_dot0": -SPEED}


def test_blow_behind_a_load_cell_that_rings():
    prepared = ij.prepare(recording(RESONANCE), laws=["kelvin-voigt"], fixed={"mass": MASS})
    assert isinstance(prepared.experiments["kelvin-voigt"].model.oscillator, ij.FreeMass)
    best = ij.compare(prepared, starts=ij.Starts(4)).best
    assert best.name == BEST
    instrument = {"resonance": RESONANCE, "resonance_damping": DAMPING, "offset": 2.0}
    agrees(best.estimate, CONTACT | instrument)


def test_blow_of_an_accelerometer(tmp_path):
    """In g, with the resonance of its mounting; a swing that hits a stop is no blow."""
    shown = values(RESONANCE) / MASS / 9.80665
    path = record_file(tmp_path / "a.csv", "Acceleration (g)", TS, shown)
    prepared = ij.prepare(path)
    assert {*prepared.experiments} == {"kelvin-voigt", BEST, "hunt-crossley"}
    best = ij.fit(prepared.experiments[BEST], starts=ij.Starts(4))
    agrees(best, CONTACT | {"resonance": RESONANCE, "resonance_damping": DAMPING})
    swing = 300.0 * np.sin(80.0 * TS)
    with_swing = ij.Recording(TS, forces() / MASS + swing, ij.Acceleration())
    assert not ij.prepare(with_swing).first_look.is_blow


@pytest.mark.parametrize("gain", [-1.0, -1e-3])
@pytest.mark.parametrize("quantity", [ij.ContactForce(), ij.Acceleration()])
def test_instrument_that_counts_pressure_as_negative(gain, quantity):
    turned = ij.Recording(TS, gain * values(), quantity)
    prepared = ij.prepare(turned, laws=["kelvin-voigt"])
    assert prepared.first_look.is_blow
    assert any("its sign is turned" in note for note in prepared.notes)
    record = prepared.experiments["kelvin-voigt"].recording
    assert isinstance(record, ij.Recording)
    assert np.asarray(record.values).max() == pytest.approx(abs(gain) * values().max())
    kept = ij.prepare(turned, laws=["kelvin-voigt"], fixed={"gain": 1.0})
    assert not any("its sign is turned" in note for note in kept.notes)


@pytest.mark.parametrize("zero", [-300.0, 0.0, 300.0])
def test_first_look_at_a_blow_with_any_zero(zero):
    """Impulse and duration of a contact of 446 N at most, of which 300 N is two thirds."""
    shown = ij.Recording(TS, forces() + zero, ij.ContactForce())
    look = ij.prepare(shown, laws=["kelvin-voigt"]).first_look
    assert look.is_blow
    impulse = float(forces().sum() / RATE)
    assert look.speed * 1.6 == pytest.approx(impulse, rel=0.05)
    assert look.contact_frequency == pytest.approx(OMEGA0, rel=0.15)
    assert look.marks == pytest.approx(TOUCH, abs=5e-4)


@pytest.mark.parametrize("damping", [0.02, 0.2, 0.35])
def test_decay_of_an_acceleration_is_no_blow(damping):
    """Also one that is flat for nine tenths of the record."""
    after = np.maximum(TS - TOUCH, 0.0)
    decay = np.exp(-damping * 2000 * after) * np.sin(2000 * after)
    look = ij.prepare(ij.Recording(TS, 100 * decay, ij.Acceleration())).first_look
    assert not look.is_blow


def test_instrument_that_is_stated_is_not_fitted():
    stated = {"resonance": 5000.0, "resonance_damping": 0.05}
    for fixed in (stated, {"cutoff": math.inf}, {"cutoff": 4000.0}, {"resonance": None}):
        prepared = ij.prepare(recording(), laws=["kelvin-voigt"], fixed={"mass": MASS, **fixed})
        assert prepared.experiments["kelvin-voigt"].free == ("offset",)


def test_damping_alone_can_be_stated():
    fixed = {"mass": MASS, "resonance_damping": 0.05}
    found = ij.prepare(recording(), laws=["kelvin-voigt"], fixed=fixed).experiments["kelvin-voigt"]
    assert {*found.free} == {"resonance", "offset"}
    assert found.fixed["resonance_damping"] == 0.05


def test_force_tells_frequency_and_momentum_but_not_the_mass():
    """Half the mass with all lengths twice as large gives the same force."""
    stated = {"resonance": RESONANCE, "resonance_damping": DAMPING}
    prepared = ij.prepare(recording(RESONANCE), laws=["kelvin-voigt"], fixed=stated)
    assert any("one blow" in note for note in prepared.notes)
    found = ij.fit(prepared.experiments[BEST])
    lines = str(found).splitlines()
    given = {line.split(" ")[0] for line in lines if "given mass" in line}
    assert given == {"x0", "x_dot0"}
    assert float(found.value("x_dot0")) == pytest.approx(-SPEED * MASS, rel=0.01)
    assert float(found.value("omega0")) == pytest.approx(OMEGA0, rel=0.01)


@thorough
def test_usual_laws_of_a_force_are_force_laws(tmp_path):
    """The command reads a hammer's file without a sidecar."""
    path = record_file(tmp_path / "hammer.csv", "contact force [N]", TS, values(RESONANCE))
    assert {*ij.prepare(path).experiments} == {"kelvin-voigt", BEST, "hunt-crossley"}
    law = "--law", "kelvin-voigt"
    done = impactjax("fit", path, *law, "--out", tmp_path / "out", "--fix", f"mass={MASS}")
    assert done.status == 0, done.stderr
    fits = json.loads((tmp_path / "out" / "fit.json").read_text())["fits"]
    assert fits[0]["law"] == BEST
    assert "one blow" in done.stdout
    assert "impulse is that of an approach" in done.stdout


@pytest.mark.parametrize("count", [2, 5])
def test_several_blows_are_not_one(count):
    several = np.tile(forces(), count)
    assert blow(forces()) is not None
    assert blow(several) is None
    assert blow(np.zeros(50)) is None
    assert blow(-forces()) is None


def test_sidecar_states_a_resonance(tmp_path):
    sidecar = "[sensor]\nresonance = 5000.0\nresonance_damping = 0.1\n"
    path = record_file(tmp_path / "a.csv", "contact force [N]", TS, forces(), sidecar)
    low_pass = ij.prepare(path, laws=["hunt-crossley"]).experiment.sensor.low_pass
    assert isinstance(low_pass, ij.Resonance)
    assert (float(low_pass.resonance), float(low_pass.resonance_damping)) == (5000.0, 0.1)


@pytest.mark.parametrize(
    ("sidecar", "sentence"),
    [
        ("resonance_damping = 0.1", "line 2: `resonance_damping` says nothing without `resonance`"),
        ("cutoff = 50.0\nresonance = 9.0", "line 2: `cutoff` and `resonance` are two low-passes"),
        (
            "resonance = 9.0\nresonance_damping = 1.0",
            r"line 3: `sensor.resonance_damping` cannot be used \(Expected a number <= 0.99\)",
        ),
        (
            "resonance = -9.0",
            r"line 2: `sensor.resonance` cannot be used \(Expected a number > 0.0\)",
        ),
    ],
)
def test_wrong_resonance_is_one_sentence(tmp_path, sidecar, sentence):
    path = record_file(
        tmp_path / "a.csv", "contact force [N]", TS, forces(), f"[sensor]\n{sidecar}"
    )
    with pytest.raises(FileError, match=sentence):
        read_recording(path)


@pytest.mark.parametrize("frequency", [0.3, 1.0, 3.0])
def test_resonance_response_to_sine(frequency):
    """The transfer function 1 / (1 - f² + 2 i zeta f) at f times the resonance, once settled."""
    ts = np.linspace(0.0, 40.0, 4001)
    omega = 2 * math.pi * frequency
    sine, rates = np.sin(omega * ts), omega * np.cos(omega * ts)
    found = ij.Resonance(1.0, 0.3).filtered(jnp.asarray(ts), jnp.asarray(sine), jnp.asarray(rates))
    gain = 1 / (1 - frequency**2 + 0.6j * frequency)
    expected = np.imag(gain * np.exp(1j * omega * ts))
    np.testing.assert_allclose(np.asarray(found)[ts > 30], expected[ts > 30], atol=2e-5)


@pytest.mark.parametrize("low_pass", [ij.Resonance(1e12, 0.7), ij.Butterworth(1e12)])
def test_filter_far_above_the_motion_has_no_effect(low_pass):
    """Second derivative of sin 30 t: the filter takes none of a number that has lost its digits."""
    ts = np.linspace(0.0, 1.0, 2001)
    place, rate = np.sin(30 * ts), 30 * np.cos(30 * ts)
    before = jnp.asarray(0.0), jnp.asarray(-27000.0)
    found = low_pass.filtered_acceleration(*map(jnp.asarray, (ts, place, rate)), before)
    np.testing.assert_allclose(np.asarray(found)[1:], -900 * place[1:], atol=0.05)
