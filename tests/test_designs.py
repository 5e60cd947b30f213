"""Designs of studies: the points that they promise."""

import numpy as np
import pytest
from scipy.stats import qmc

import impactjax as ij
from tiers import quick

pytestmark = quick

RANGES = {"gamma": (0.1, 0.3), "omega0": ij.LogUniform(100.0, 10_000.0)}


def test_grid_varies_its_last_parameter_fastest():
    grid = ij.Grid(gamma=[0.1, 0.2], omega0=[300, 500, 700])
    assert grid.names == ("gamma", "omega0")
    assert grid.dimensions == {"gamma": 2, "omega0": 3}
    expected = [[g, o] for g in (0.1, 0.2) for o in (300.0, 500.0, 700.0)]
    np.testing.assert_array_equal(grid.points(), expected)


def test_latin_hypercube_has_one_lane_in_each_stratum():
    points = ij.LatinHypercube(RANGES, 50, seed=3).points()
    gamma = (points[:, 0] - 0.1) / 0.2
    omega0 = np.log(points[:, 1] / 100) / np.log(100)
    for u in (gamma, omega0):
        np.testing.assert_array_equal(np.sort(np.floor(50 * u)), np.arange(50))


def test_sobol_sequence_of_any_size_is_the_beginning_of_a_longer_one():
    whole = ij.SobolSequence({"x": (0.0, 1.0), "y": (0.0, 1.0)}, 128, seed=1).points()
    part = ij.SobolSequence({"x": (0.0, 1.0), "y": (0.0, 1.0)}, 100, seed=1).points()
    np.testing.assert_array_equal(part, whole[:100])
    assert qmc.discrepancy(whole) < 0.1 * qmc.discrepancy(np.random.default_rng(0).random((128, 2)))


@pytest.mark.parametrize("second_order", [False, True])
def test_saltelli_blocks_mix_two_points(second_order):
    design = ij.Saltelli({"x": (0, 1), "y": (2, 4), "z": (5, 6)}, 8, second_order=second_order)
    members = 8 if second_order else 5
    assert design.dimensions == {"block": 8, "member": members}
    blocks = design.points().reshape(8, members, 3)
    a, b = blocks[:, 0], blocks[:, -1]
    for i in range(3):
        mixed = a.copy()
        mixed[:, i] = b[:, i]
        np.testing.assert_array_equal(blocks[:, 1 + i], mixed)
        if second_order:
            mixed = b.copy()
            mixed[:, i] = a[:, i]
            np.testing.assert_array_equal(blocks[:, 4 + i], mixed)
    assert (np.abs(a - b) > 0).all()


@pytest.mark.parametrize("kind", [ij.LatinHypercube, ij.SobolSequence, ij.Saltelli])
def test_seed_determines_a_sample(kind):
    first = kind(RANGES, 16, seed=5).points()
    np.testing.assert_array_equal(kind(RANGES, 16, seed=5).points(), first)
    assert not np.array_equal(kind(RANGES, 16, seed=6).points(), first)
    assert (first[:, 0] >= 0.1).all()
    assert (first[:, 0] <= 0.3).all()
    assert (first[:, 1] >= 100).all()
    assert (first[:, 1] <= 10_000).all()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ij.Grid(), "at least one parameter"),
        (lambda: ij.Grid(gamma=[]), "`gamma` must be a list of at least one number"),
        (lambda: ij.Grid(gamma=0.2), "`gamma` must be a list"),
        (lambda: ij.Grid(gamma=np.ones((1, 2))), "`gamma` must be a list"),
        (lambda: ij.Grid(gamma=[0.2, np.nan]), "finite"),
        (lambda: ij.LatinHypercube({}, 10), "at least one parameter"),
        (lambda: ij.LatinHypercube(RANGES, 0), "`size` must be at least 1"),
        (lambda: ij.LatinHypercube(RANGES, 10, seed=-1), "`seed` must be at least 0"),
        (lambda: ij.SobolSequence({"x": (1.0, 1.0)}, 8), "must increase"),
        (lambda: ij.SobolSequence({"x": (0.0, np.inf)}, 8), "must increase"),
        (lambda: ij.SobolSequence({"x": 3.0}, 8), r"range of `x` must be two numbers"),
        (lambda: ij.SobolSequence({"x": ("a", "b")}, 8), r"range of `x` must be two numbers"),
        (lambda: ij.LogUniform(0.0, 1.0), "from above zero"),
        (lambda: ij.Saltelli(RANGES, 12), "power of 2"),
    ],
)
def test_impossible_designs_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
