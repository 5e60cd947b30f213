"""The look at a recording before any fit: noise, forecasts in closed form, doubts, words."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy import signal

import impactjax as ij
from impactjax._check.flights import Motion
from impactjax._check.noise import noise_of
from reference import ball, pendulum, simulate_rigid, spring
from tiers import quick

MOTION = ["omega_n", "zeta", "r", "theta0", "theta_dot0"]
DATA = Path(__file__).parent.parent / "data"
TS = np.arange(2000) / 1000
SHORT = TS[:1400]  # before the impacts of a ball come too fast for the integrator
GRAVITY = 9.80665


def noisy(values, size, seed=0):
    return values + size * np.random.default_rng(seed).standard_normal(len(values))


def displacement(values, ts=TS):
    return ij.Recording(ts[: len(values)], values, ij.Displacement())


def bouncing(r=0.8, gravity=GRAVITY):
    """Heights of a ball from 0.2 m, by SciPy."""
    found = simulate_rigid(ball(gravity), [0.2, 0.0], SHORT, lambda v: r)
    return noisy(found.position, 1e-4)


@quick
def test_flights_of_a_ball_agree_with_integrator():
    motion = Motion(0.0, 0.0, GRAVITY, 0.2, 0.0, 0.0, 0.8, 0.02)
    places, hits = motion.along(SHORT)
    found = simulate_rigid(ball(), [0.2, 0.0], SHORT, lambda v: 0.8 - 0.02 * v)
    np.testing.assert_allclose(places, found.position, atol=1e-8)
    assert hits[0] == pytest.approx(np.sqrt(0.4 / GRAVITY))


@quick
@pytest.mark.parametrize("gap", [0.0, 0.006, -0.004])
def test_swings_onto_a_stop_agree_with_integrator(gap):
    omega = 20.0
    motion = Motion(omega, 0.0, 0.0, 0.03, 0.0, gap, 0.7, 0.0)
    found = simulate_rigid(
        spring(omega, gap),
        [0.03 + gap, 0.0],
        TS[:800],
        lambda v: 0.7,
    )
    places, _ = motion.along(TS[:800])
    np.testing.assert_allclose(places, found.position - gap, atol=1e-7)


@quick
def test_soft_contact_has_the_restitution_and_duration_of_its_law():
    law = ij.KelvinVoigt.from_restitution(300.0, 0.6)
    gamma = float(law.gamma)
    motion = Motion(0.0, 0.0, 0.0, 0.1, -1.0, 0.0, 1.0, 0.0, 300.0, gamma)
    places, hits = motion.along(TS)
    told = law.equivalents(1.0, 1.0)
    assert hits.tolist() == pytest.approx([0.1])
    assert -places.min() == pytest.approx(float(told.deepest_penetration), rel=5e-3)
    left = 0.1 + float(told.duration)
    np.testing.assert_allclose(places[left < TS], 0.6 * (TS[left < TS] - left), atol=1e-9)


@quick
def test_noise_of_a_swing_and_of_a_filter():
    swing = 0.03 * np.cos(12 * TS)
    white = noise_of(displacement(noisy(swing, 1e-3)))
    assert white.size == pytest.approx(1e-3, rel=0.1)
    assert (white.memory, white.step) == (1, 0.0)
    sos = signal.butter(2, 100.0, fs=1000, output="sos")
    smooth = np.asarray(signal.sosfilt(sos, np.random.default_rng(1).standard_normal(len(TS))))
    filtered = noise_of(displacement(swing + 1e-3 * smooth / smooth.std()))
    assert filtered.memory > 1
    assert filtered.size == pytest.approx(1e-3, rel=0.35)
    stepped = noise_of(displacement(np.round(noisy(swing, 1e-4) / 2e-3) * 2e-3))
    assert stepped.step == pytest.approx(2e-3)


@quick
def test_forecast_for_a_free_swing_is_that_of_a_sine_wave():
    """Frequency and decay of a sine wave with unknown amplitude and phase have the variance
    24 σ²/(A² n T²); source: Rife & Boorstyn, IEEE Trans. Inf. Theory 20, 591 (1974).
    """
    omega, sigma, size = 40.0, 1e-3, 0.03
    values = size * np.exp(-1e-3 * omega * TS) * np.cos(omega * TS)
    told = ij.check(displacement(noisy(values, sigma))).forecasts
    assert told is not None
    errors = {each.name: each.error for each in told.motion}
    expected = sigma / size * np.sqrt(24 / len(TS)) / TS[-1]
    assert errors["omega_n"] == pytest.approx(expected, rel=0.15)
    assert errors["zeta"] == pytest.approx(expected / omega, rel=0.15)


@quick
def test_forecast_for_impact_times_is_no_better_than_the_mean_of_ratios():
    rng = np.random.default_rng(5)
    ratios = 0.9 * np.exp(0.01 * rng.standard_normal(24))
    flights = 0.5 * np.cumprod([1.0, *ratios])
    told = ij.check(ij.ImpactTimes(np.cumsum([0.1, *flights]))).forecasts
    assert told is not None
    (r,) = [each.error for each in told.motion if each.name == "r"]
    assert r == pytest.approx(np.std(ratios, ddof=1) / np.sqrt(24), rel=1e-6)


def test_forecast_agrees_with_errors_of_a_fit():
    """The fit uses the exact simulator and the residuals."""
    told = ij.check(DATA / "restitution.csv").forecasts
    estimate = ij.fit(ij.prepare(DATA / "restitution.csv", laws=["restitution"]).experiment)
    assert told is not None
    errors = {each.name: each.error for each in told.motion}
    for name in ("omega_n", "r", "theta0", "theta_dot0"):
        assert errors[name] == pytest.approx(float(estimate.standard_error(name)), rel=0.3)


@quick
def test_check_says_what_is_in_the_record():
    text = str(ij.check(DATA / "kelvin_voigt.csv"))
    assert text.startswith(f"{DATA / 'kelvin_voigt.csv'}\n- Read: 1401 samples of angle, ")
    for words in (
        "at 1000 Hz",
        "Sidecar: ",
        "System: pendulum, as the sidecar says.",
        "length = 0.071",
        "Low-pass: 50 Hz, order 2.",
        "- Noise: 0.2",
        "6 found, from 0.1",
        "5 of 5 ms (rubber)",
        "The low-pass smooths contacts shorter than about 8.8 ms.",
        "Nothing looks wrong.",
        "zeta only from above",
        "omega0) if contacts last longer than about 0.26 ms",
    ):
        assert words in text
    told = ij.check(DATA / "free_decay.csv")
    assert "None: it swings freely" in str(told)
    assert "<th>Impacts</th><td>None: it swings freely" in told._repr_html_()


UNEVEN = np.concatenate([SHORT[:700], SHORT[760:]])
DOUBTFUL = {
    "1 of 1339 intervals differ": displacement(np.interp(UNEVEN, SHORT, bouncing()), UNEVEN),
    "gravity of 4.9 m/s² instead of 9.81: check the scale (`gain = 0.5`": displacement(
        bouncing() / 2
    ),
    "multiples of 0.5 mm, more than the noise": displacement(np.round(bouncing() / 5e-4) * 5e-4),
    "A flight has only": displacement(bouncing()[::40], SHORT[::40]),
    "seem to have a restitution above 1": ij.ImpactTimes(np.cumsum([0.1, 0.4, 0.41, 0.42, 0.43])),
}


@quick
@pytest.mark.parametrize("words", DOUBTFUL)
def test_doubts_about_a_record(words):
    told = ij.check(DOUBTFUL[words], oscillator=ij.BouncingBall())
    assert any(words in each for each in told.doubts), told.doubts


@quick
def test_doubt_about_the_zero_of_a_free_swing():
    told = ij.check(displacement(noisy(0.03 * np.cos(20 * TS) + 0.004, 1e-4)))
    (doubt,) = told.doubts
    assert doubt.startswith("The middle of the swing is at 3.99 mm, not at 0")
    assert ij.check(displacement(noisy(0.03 * np.cos(20 * TS), 1e-4))).doubts == ()


@quick
def test_height_or_velocity_of_a_falling_mass_is_taken_for_that_of_a_ball():
    record = displacement(bouncing())
    told = str(ij.check(record))
    assert "System: bouncing-ball, as its flights have an acceleration of 9.8" in told
    falls = simulate_rigid(ball(GRAVITY), [0.2, 0.0], SHORT, lambda v: 0.8).velocity
    told = str(ij.check(ij.Recording(SHORT, noisy(falls, 0.02), ij.Velocity())))
    assert "System: bouncing-ball, as its flights have an acceleration of 9.8" in told
    prepared = ij.prepare(record, laws=["restitution"])
    assert prepared.experiment.model.oscillator.weight() is not None
    assert any(note.startswith("The system is a bouncing ball") for note in prepared.notes)


@quick
def test_doubt_about_a_ball_taken_for_an_oscillator():
    for told in (
        ij.check(displacement(bouncing()), oscillator=ij.LinearOscillator(1.0)),
        ij.check(displacement(bouncing()), fixed={"omega_n": 1.0}),
    ):
        assert any("`--system bouncing-ball`" in each for each in told.doubts), told.doubts


@quick
@pytest.mark.parametrize("amplitude", [0.03, 0.0525, 0.08])
def test_no_doubt_about_an_oscillator_that_is_accelerated_as_a_ball_for_a_while(amplitude):
    places, _ = Motion(20.0, 0.0, 0.0, amplitude, 0.0, 0.0, 0.8, 0.0).along(TS[:1000])
    told = ij.check(displacement(noisy(places, 1e-4)))
    assert not any("bouncing-ball" in each for each in told.doubts), told.doubts


@quick
@pytest.mark.parametrize("sigma", [1e-2, 1e-6])
def test_doubt_about_a_stated_noise(sigma):
    """The record has a noise of 0.1 mm."""
    sensor = ij.Sensor(sigma=sigma)
    told = ij.check(displacement(bouncing()), oscillator=ij.BouncingBall(), sensor=sensor)
    (doubt,) = [each for each in told.doubts if "stated noise" in each]
    ratio = float(doubt.split(" times that")[0].split()[-1])
    assert ratio == pytest.approx(sigma / 1e-4, rel=0.1)
    fine = ij.check(
        displacement(bouncing()), oscillator=ij.BouncingBall(), sensor=ij.Sensor(sigma=1e-4)
    )
    assert fine.doubts == ()


STATED = {
    "are not in the record": "[sensor]\nquantisation = 0.1\n",
    "is it in milliseconds?": "[sensor]\ndelay = 0.5\n",
    "beyond the upper stop at 22.9 deg": "[upper]\ngap = 0.4\n",
    "is it in millimetres?": "[fixed]\nlength = 71\n",
    "more than a turn": "",
}


@quick
@pytest.mark.parametrize("words", STATED)
def test_doubt_about_a_statement_that_the_record_contradicts(words, tmp_path):
    """A pendulum of 71 mm on a stop, by SciPy, with a noise of 0.1 deg."""
    found = simulate_rigid(pendulum(13.47), [0.78, 0.0], TS, lambda v: 0.7)
    angle = np.rad2deg(noisy(found.position, np.deg2rad(0.1)))
    file = tmp_path / "swing.csv"
    unit = "deg" if STATED[words] else "rad"
    np.savetxt(file, np.c_[TS, angle], delimiter=",", header=f"t [s],angle [{unit}]", comments="")
    plain = "" if "length" in STATED[words] else "[fixed]\nlength = 0.071\n"
    file.with_suffix(".toml").write_text(STATED[words] + plain)
    told = ij.check(file)
    assert any(words in each for each in told.doubts), told.doubts
    if unit == "deg":
        file.with_suffix(".toml").write_text("[fixed]\nlength = 0.071\n")
        assert ij.check(file).doubts == ()


@quick
def test_no_typical_restitution_of_growing_flights():
    told = str(ij.check(ij.ImpactTimes(np.cumsum([0.1, 0.4, 0.41, 0.42, 0.43]))))
    assert "none is between 0.02 and 1" in told


@quick
def test_figure_of_a_check_marks_impacts():
    ax = Figure().add_subplot()
    assert ij.plot.check(ax, ij.check(displacement(bouncing()), oscillator=ij.BouncingBall())) is ax
    marks = ax.lines[1].get_xdata()
    np.testing.assert_allclose(np.asarray(marks)[0], np.sqrt(0.4 / GRAVITY), atol=3e-3)
    assert ax.get_ylabel() == "displacement [mm]"
    ax = Figure().add_subplot()
    ij.plot.check(ax, ij.check(ij.ImpactTimes(np.array([0.0, 0.4, 0.7, 0.92]))))
    np.testing.assert_allclose(np.asarray(ax.lines[0].get_ydata()), [400, 300, 220])


PROGRAM = "import sys; from impactjax._cli.main import app; app(sys.argv[1:])"


@quick
@pytest.mark.parametrize("held", [["gamma"], ["omega0", "zeta"], MOTION, [*MOTION, "r0", "alpha"]])
def test_known_parameters_have_no_forecast(held):
    found = ij.check(DATA / "kelvin_voigt.csv", fixed=dict.fromkeys(held))
    assert found.forecasts is not None
    told = (*found.forecasts.motion, *found.forecasts.line, found.forecasts.gamma)
    assert not {each.name for each in told if each is not None} & {*held}
    assert "Such a record can bound: " in str(found)


@quick
def test_check_compiles_no_program(tmp_path):
    """Only the conversion of lists to arrays of JAX is compiled."""
    environment = {
        **os.environ,
        "JAX_COMPILATION_CACHE_DIR": str(tmp_path),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    }
    command = [sys.executable, "-c", PROGRAM, "check", str(DATA / "kelvin_voigt.csv")]
    run = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    assert "Such a record can bound" in run.stdout
    compiled = {path.name.split("-")[0] for path in tmp_path.glob("*-cache")}
    assert compiled <= {"jit_stage", "jit_convert_element_type", "jit_copy"}
