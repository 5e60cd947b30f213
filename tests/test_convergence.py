"""Convergence of chains, in words."""

import numpy as np
import pytest
import xarray
from arviz_base import from_dict

from impactjax._identify.convergence import diagnosis
from tiers import quick

pytestmark = quick


def tree_of(draws: np.ndarray, diverging: int = 0) -> xarray.DataTree:
    lost = np.arange(draws.size).reshape(draws.shape) < diverging
    return from_dict({"posterior": {"gamma": draws}, "sample_stats": {"diverging": lost}})


@pytest.mark.parametrize(
    ("shift", "diverging", "doubtful", "sentence"),
    [
        (1.0, 0, False, "the chains of gamma have not mixed"),
        (0.0, 3, False, "3 divergences. Warning: after divergences"),
        (0.0, 0, True, "autocorrelated over longer times"),
    ],
)
def test_diagnosis_warns(shift, diverging, doubtful, sentence):
    draws = np.random.default_rng(0).standard_normal((4, 500)) + shift * np.arange(4)[:, None]
    assert sentence in diagnosis(tree_of(draws, diverging), doubtful)


def test_diagnosis_warns_of_few_and_of_standing_draws():
    few = np.random.default_rng(0).standard_normal((2, 20))
    assert "too few for its quantiles" in diagnosis(tree_of(few), doubtful=False)
    assert "have not mixed" in diagnosis(tree_of(np.zeros((2, 20))), doubtful=False)


def test_diagnosis_of_good_chains_does_not_warn():
    said = diagnosis(tree_of(np.random.default_rng(0).standard_normal((4, 500))), doubtful=False)
    assert said.startswith("R-hat at most 1.00")
    assert said.endswith("of 2000 draws, no divergence.")
