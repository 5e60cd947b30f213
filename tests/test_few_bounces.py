"""Laws of few bounces with scatter: the criterion for few observations has a pole there."""

import numpy as np
import pytest

import impactjax as ij
from estimates import line, swing
from impactjax._compare.ranking import CLEAR, differences, rejected
from test_ranking_words import law
from tiers import mostly_thorough, quick

G = 9.80665


def bounces(count, seed, restitution):
    """Times of impacts, with a clock noise of 0.1 ms, of a ball that starts with 3 m/s."""
    rng, speed, time, times = np.random.default_rng(seed), 3.0, 0.3, []
    for _ in range(count):
        times.append(time)
        speed *= restitution(speed, rng)
        time += 2 * speed / G
    return ij.ImpactTimes(np.array(times) + 1e-4 * rng.standard_normal(count))


def fits(times):
    prepared = ij.prepare(times, laws=["restitution", "linear-restitution"])
    return [ij.fit(each, starts=ij.Starts(4)) for each in prepared.experiments.values()]


@pytest.mark.parametrize("count", mostly_thorough([7, 8, 9, 10], 8))
def test_restitution_that_falls_with_speed_is_found(count):
    """r = 0.92 - 0.03 v: a constant one has residuals seven times larger."""
    constant, linear = found = fits(bounces(count, 100, lambda speed, rng: 0.92 - 0.03 * speed))
    assert constant.rms > 4 * linear.rms
    behind = differences(found)
    assert behind[1] == 0 < behind[0]
    assert not rejected(found)[1]
    assert linear["r0"].low < 0.92 < linear["r0"].high
    assert linear["alpha"].low < 0.03 < linear["alpha"].high


@pytest.mark.parametrize(("free", "said"), [((), True), (("drag",), False)])
def test_restitution_that_falls_with_speed_may_be_drag(free, said):
    times = bounces(12, 100, lambda speed, rng: 0.92 - 0.03 * speed)
    prepared = ij.prepare(times, laws=["linear-restitution"], free=free)
    notes = ij.compare(prepared, starts=ij.Starts(2)).notes
    assert any("may be air drag" in note for note in notes) == said


def test_scatter_of_few_bounces_rejects_no_law():
    def scattering(speed, rng):
        del speed
        return 0.85 * np.exp(0.01 * rng.standard_normal())

    found = fits(bounces(8, 500, scattering))
    assert differences(found)[0] == 0
    assert rejected(found) == [False, False]


@quick
@pytest.mark.usefixtures("numpy_promotes")
def test_correction_for_few_observations_alone_rejects_no_law():
    few = law("few", -100.0, of=line()[1], n=8).estimate
    many = law("many", -108.0, of=swing(), n=8).estimate
    assert len(many.names) > len(few.names)
    assert differences([few, many])[1] > CLEAR
    assert rejected([few, many]) == [False, False]
