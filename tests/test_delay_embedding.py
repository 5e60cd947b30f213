"""Delay embedding of records, and the exponents that they tell."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import impactjax as ij
from tiers import quick

pytestmark = quick


@pytest.fixture(scope="module")
def henon():
    """The Hénon map, whose exponent is 0.4192 (Sprott, 2003)."""
    x, y = np.zeros(5100), 0.1
    for i in range(x.size - 1):
        x[i + 1], y = 1 - 1.4 * x[i] ** 2 + y, 0.3 * x[i]
    return x[100:]


@pytest.fixture(scope="module")
def lorenz():
    """Lorenz's system, whose exponent is 0.9056 (Sprott, 2003). Runge-Kutta steps of Python's
    numbers are the same on every machine, which a chaotic motion needs to be the same record.
    """
    state, record = (1.0, 1.0, 20.0), np.zeros(15_000)
    for i in range(record.size):
        record[i] = state[0]
        state = stepped(state, 0.01)
    return record[2000:]


def stepped(state, h):
    def moved(slope, h):
        return tuple(s + h * k for s, k in zip(state, slope, strict=True))

    def rates(x, y, z):
        return 10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z

    k1 = rates(*state)
    k2 = rates(*moved(k1, h / 2))
    k3 = rates(*moved(k2, h / 2))
    k4 = rates(*moved(k3, h))
    each = zip(k1, k2, k3, k4, strict=True)
    return moved(tuple((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in each), h)


def test_exponent_of_a_map(henon):
    embedding = ij.delay_embedding(henon, 1.0, delay=1)
    assert embedding.dimension == 2
    np.testing.assert_array_equal(embedding.vectors[:, 0], henon[:-1])
    np.testing.assert_array_equal(embedding.vectors[:, 1], henon[1:])
    found = ij.divergence(embedding, 1, 7, 10)
    assert abs(found.exponent - 0.4192) < 3 * found.error < 0.03


def test_delay_dimension_and_exponent_of_a_flow(lorenz):
    """The first minimum of the information is at 0.16 to 0.18 (Fraser and Swinney, 1986)."""
    embedding = ij.delay_embedding(lorenz, 0.01)
    assert 15 <= embedding.delay <= 19
    assert embedding.dimension == 3
    found = ij.divergence(embedding, 0.5, 3, 1.0)
    assert abs(found.exponent - 0.9056) < 3 * found.error < 0.2


def test_periodic_motion_does_not_diverge():
    noise = 0.01 * np.random.default_rng(0).standard_normal(4000)
    swing = np.sin(2 * np.pi * np.arange(4000) / 80.3) + noise
    embedding = ij.delay_embedding(swing, 0.01, delay=20, dimension=2)
    found = ij.divergence(embedding, 0.5, 3.0, 0.8)
    assert abs(found.exponent) < 0.02


def test_information_of_independent_values_is_that_of_its_estimate():
    """The mean over independent values is (cells − 1)² / (2 size ln 2) bit."""
    noise = np.random.default_rng(1).standard_normal(4000)
    embedding = ij.delay_embedding(noise, 1.0, delay=1, dimension=1, most=2)
    expected = (14 - 1) ** 2 / (2 * 4000 * np.log(2))
    np.testing.assert_allclose(np.mean(embedding.information), expected, rtol=0.15)


def test_line_of_a_divergence_has_its_exponent(henon):
    found = ij.divergence(ij.delay_embedding(henon, 1.0, delay=1), 1, 7, 10)
    ax = ij.plot.divergence(plt.figure().add_subplot(), found)
    line = np.asarray(ax.lines[1].get_xydata())
    np.testing.assert_allclose(np.diff(line[:, 1]) / np.diff(line[:, 0]), found.exponent)
    plt.close("all")


def test_spectrum_marks_harmonics():
    """Harmonics of a motion that repeats after two periods of a force at 4 Hz."""
    times = np.arange(4000) * 0.005
    motion = np.sin(2 * np.pi * 4 * times) + 0.3 * np.sin(2 * np.pi * 6 * times)
    ax = ij.plot.spectrum(plt.figure().add_subplot(), motion, 0.005, 4.0, 2)
    *marks, curve = ax.lines
    assert [np.asarray(mark.get_xdata())[0] for mark in marks[:4]] == [2, 4, 6, 8]
    assert [mark.get_linestyle() for mark in marks[:4]] == [":", "-", ":", "-"]
    lines, density = np.asarray(curve.get_xydata()).T
    highest = np.sort(lines[np.argsort(density)[-6:]])
    np.testing.assert_allclose(highest, [3.95, 4.0, 4.05, 5.95, 6.0, 6.05], rtol=1e-12)
    plt.close("all")


@pytest.mark.parametrize(
    ("values", "settings", "said"),
    [
        (np.zeros(300), {}, "does not change"),
        (np.arange(100.0), {}, "at least 200 samples"),
        (np.full(300, np.nan), {}, "must be finite"),
        (np.arange(300.0), {"delay": 30}, "too few for 8 coordinates 30 samples apart"),
        (np.sin(np.arange(300.0)), {"interval": 0.0}, "`interval` must be above 0"),
        (np.arange(300.0), {}, "no minimum within a tenth"),
        (np.random.default_rng(0).standard_normal(900), {"delay": 1, "most": 2}, "still false"),
    ],
)
def test_record_that_cannot_be_embedded_is_refused(values, settings, said):
    interval = settings.pop("interval", 0.1)
    with pytest.raises(ValueError, match=said):
        ij.delay_embedding(values, interval, **settings)


def test_times_of_a_divergence_must_suit(henon):
    embedding = ij.delay_embedding(henon[:300], 1.0, delay=1)
    with pytest.raises(ValueError, match="must rise"):
        ij.divergence(embedding, 5, 5, 10)
    with pytest.raises(ValueError, match="too short to follow neighbours 40 s apart"):
        ij.divergence(embedding, 1, 7, 40)
