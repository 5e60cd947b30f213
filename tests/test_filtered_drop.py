"""A dropped accelerometer behind a low-pass that nobody stated, made with SciPy."""

import functools

import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from reference import ball, simulate_compliant

GRAVITY, HEIGHT, HELD, RATE, FINE = 9.80665, 0.4, 0.2011, 500, 20_000
TRUTH = {"omega0": 300.0, "gamma": 0.1, "x0": HEIGHT}


def contact(t, y):
    del t
    return np.array([y[1], felt(y[0], y[1]) - GRAVITY])


def felt(x, v):
    """Acceleration by the stop, spring and dashpot, without weight."""
    return -(TRUTH["omega0"] ** 2) * x - 2 * TRUTH["gamma"] * TRUTH["omega0"] * v


@functools.cache
def recording(cutoff=np.inf):
    """Held in a hand, let go between two samples, and fallen on a stop."""
    ts = np.arange(round(0.75 * FINE)) / FINE
    falls = ts >= HELD
    fallen = simulate_compliant(ball(), contact, [HEIGHT, 0.0], ts[falls] - HELD)
    push = np.where(fallen.position < 0, felt(fallen.position, fallen.velocity), 0.0)
    values = np.concatenate([np.full(np.count_nonzero(~falls), GRAVITY), push])
    if np.isfinite(cutoff):
        sections = signal.butter(2, cutoff, fs=FINE, output="sos")
        values, _ = signal.sosfilt(sections, values, zi=signal.sosfilt_zi(sections) * values[0])
    values = values[:: FINE // RATE]
    noise = 0.1 * np.random.default_rng(4).standard_normal(values.size)
    return ij.Recording(np.arange(values.size) / RATE, values + noise, ij.ProperAcceleration())


@pytest.mark.parametrize(
    ("stated", "possible"),
    [
        ({}, ij.Butterworth(0.1 * RATE)),
        ({"fixed": {"cutoff": np.inf}}, None),
        ({"free": ["cutoff"]}, None),
        ({"sensor": ij.Sensor(low_pass=ij.Butterworth(80.0))}, None),
        ({"sensor": ij.Sensor()}, None),
    ],
)
def test_low_pass_is_possible_unless_stated(stated, possible):
    found = ij.prepare(recording(), laws=["restitution"], **stated).possible_low_pass
    assert (found is None) is (possible is None)
    if possible is not None and found is not None:
        assert float(found.cutoff) == pytest.approx(float(possible.cutoff))
        assert found.order == possible.order


def prepared(cutoff=np.inf, **stated):
    """One law, whose start is far off."""
    law = ij.KelvinVoigt(omega0=250.0, gamma=0.2)
    return ij.prepare(recording(cutoff), laws=[law], **stated)


def compared(cutoff=np.inf):
    return ij.compare(prepared(cutoff), starts=ij.Starts(4))


def test_low_pass_of_dropped_accelerometer_is_found():
    done = compared(150.0)
    (said,) = (note for note in done.notes if "asks for `cutoff`" in note)
    assert "instead of none" in said
    found = done.best.estimate
    for name, truth in (TRUTH | {"cutoff": 150.0}).items():
        assert found[name].low < truth < found[name].high
        assert found[name].verdict is ij.Verdict.IDENTIFIED


def test_dropped_accelerometer_without_low_pass_has_none():
    """A low-pass would describe the record, too, but moves the natural frequency by 13 errors."""
    done = compared()
    found = done.best.estimate
    assert "cutoff" not in found.names
    assert not bool(found.exceeds_noise)
    for name, truth in TRUTH.items():
        assert found[name].low < truth < found[name].high


def test_stated_absence_of_a_low_pass_leaves_nothing_identified():
    stated = prepared(150.0, fixed={"cutoff": np.inf})
    assert stated.possible_low_pass is None
    found = ij.fit(stated.experiment, starts=ij.Starts(4))
    assert "cutoff" not in found.names
    assert bool(found.exceeds_noise)
    assert found.reason("omega0") is ij.Reason.EXCEEDS_NOISE
