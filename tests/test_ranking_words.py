"""Sentences and tables on laws against their own numbers: constructed criteria, by hand."""

import re

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import line, swing, with_dry_friction
from impactjax._compare.ranking import best_first, differences
from impactjax._number_format import apart
from impactjax._report.document import document
from impactjax._report.rows import law_rows
from impactjax._report.words import sentences

pytestmark = pytest.mark.usefixtures("numpy_promotes")


def white(seed: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(count)


def law(
    name: str,
    aic: float,
    *,
    of: ij.Estimate[ij.Problem],
    n: int = 400,
    freedom: float | None = None,
):
    """A fit with a criterion, from so many observations."""
    free = float(n - len(of.names)) if freedom is None else freedom
    recording = ij.Recording(jnp.arange(float(n)), jnp.asarray(white(0, n)), ij.Displacement())
    own = eqx.tree_at(
        lambda e: (e.aic, e.freedom, e.problem.recording, e.outcome, e.residuals, e.rms),
        of,
        (
            jnp.asarray(aic),
            jnp.asarray(free),
            recording,
            jnp.asarray(0),
            jnp.asarray(0.01 * white(1, n)),
            jnp.asarray(0.01),
        ),
    )
    return ij.Fitted(name, own, 0.0)


def ranking(*fits: ij.Fitted) -> str:
    said = sentences([fits[i] for i in best_first([each.estimate for each in fits])])
    return " ".join(each for each in said if re.search("law|best|apart|rank", each))


@pytest.mark.parametrize("freedom", [None, 3.0, 40.0, np.inf])
def test_ranking_sentence_and_table_use_the_same_difference(freedom):
    """Law b is behind by every amount around ten; so is what the table shows."""
    narrow = line()[1]
    for ahead in (0.0, 2.0, 9.96, 9.9999, 10.0, 10.04, 60.0, 2000.0):
        fits = [
            law(name, aic, of=narrow, freedom=freedom) for name, aic in (("a", 0.0), ("b", ahead))
        ]
        said = ranking(*fits)
        by = float(law_rows(fits)[1]["behind"])
        assert ("clearly best" in said) == (by >= 10.0), (said, by)
        assert ("cannot be distinguished from b" in said) == (by < 10.0), (said, by)


def test_correlated_residuals_reduce_sample_size():
    """The quasi-likelihood criterion by hand: 400 that count as 40; both laws find 3 numbers."""
    pair = [
        law(name, aic, of=line()[1], freedom=38.0).estimate for name, aic in (("a", 0), ("b", 60))
    ]
    np.testing.assert_allclose(differences(pair), [0.0, 60 * 40 / 400], atol=1e-12)


def test_few_observations_use_corrected_criterion():
    """By hand: AIC + 2 k (k + 1)/(n − k − 1), with k of 3 and 5, from 9 observations."""
    narrow, wide = line()[1], swing()
    pair = [law("a", 0.0, of=narrow, n=9), law("b", -10.0, of=wide, n=9)]
    found = differences([each.estimate for each in pair])
    first, second = 0.0 + 24 / 5, -10.0 + 60 / 3
    np.testing.assert_allclose(found, [0.0, second - first], atol=1e-12)


@pytest.mark.parametrize("n", [5, 6, 7])
def test_undefined_criterion_ranks_nothing(n):
    """The criterion of k = 5 numbers from n observations exists for n > 6."""
    narrow, wide = line()[1], swing()
    fits = [law("a", 0.0, of=narrow, n=n), law("b", -200.0, of=wide, n=n)]
    said = ranking(*fits)
    order = best_first([each.estimate for each in fits])
    rows = law_rows([fits[i] for i in order])
    if n == 7:
        assert "clearly best" in said
        assert "too short" not in said
    else:
        assert "best" not in said
        assert f"too short to rank b: its effective sample size is {n}," in said
        assert [row["behind"] for row in rows] == ["0.0", "–"]
        found = document([ij.Comparison("x", tuple(fits[i] for i in order))])["fits"]
        assert [fit["aic_behind"] for fit in found] == [0.0, None]
        assert found[1]["aicc"] is None


def test_undefined_criterion_is_reported():
    fits = [law(name, aic, of=swing(), n=5) for name, aic in (("a", 0.0), ("b", -200.0))]
    assert "too short to rank the laws" in ranking(*fits)
    assert [row["behind"] for row in law_rows(fits)] == ["–", "–"]


def test_order_by_criterion_with_failed_fits_last():
    rng = np.random.default_rng(0)
    for _ in range(50):
        several = [
            law(
                str(i),
                rng.normal(0, 20),
                of=(line()[1], swing())[i % 2],
                n=int(rng.integers(5, 40)),
            )
            for i in range(5)
        ]
        freedom = float(rng.uniform(0.1, 30))
        own = [
            eqx.tree_at(
                lambda e: (e.freedom, e.outcome),
                each.estimate,
                (jnp.asarray(freedom), jnp.asarray(0 if ok else 1)),
            )
            for each, ok in zip(several, rng.random(5) > 0.2, strict=True)
        ]
        behind = [differences(own)[i] for i in best_first(own)]
        ranked = [by for by in behind if not np.isnan(by)]
        assert behind[: len(ranked)] == ranked == sorted(ranked)
        assert not ranked or ranked[0] == 0
        assert differences([own[i] for i in best_first(own)])[: len(ranked)] == ranked


def missing(aic: float, dry: bool) -> ij.Fitted:
    """Free flight that leaves most of a slow motion."""
    ts = np.arange(400.0)
    values = np.sin(ts / 20)
    fitted = law("free flight", aic, of=line()[1])
    own = eqx.tree_at(
        lambda e: (e.problem.recording.values, e.residuals, e.rms, e.misfit),
        fitted.estimate,
        (
            jnp.asarray(values),
            jnp.asarray(0.7 * values),
            jnp.asarray(0.7 * np.std(values)),
            jnp.asarray(0.7),
        ),
    )
    return ij.Fitted("free flight", with_dry_friction(own) if dry else own, 0.0)


@pytest.mark.parametrize("ahead", [1.0, 500.0])
def test_misfitting_laws_are_not_ranked(ahead):
    said = sentences([missing(0.0, True), missing(ahead, False)])
    assert any("leaves 70 % of its motion" in each for each in said)
    assert not any("friction describes" in each or "friction alone" in each for each in said)
    laws = [
        each._replace(name=name)
        for name, each in zip("ab", (missing(0.0, True), missing(ahead, True)), strict=True)
    ]
    assert not any(
        "describes the record best" in each or "clearly" in each for each in sentences(laws)
    )


def test_friction_sentence_uses_the_same_difference():
    narrow = line()[1]
    for ahead, freedom, says in ((60.0, None, "alone does not"), (60.0, 38.0, "is not needed")):
        dry = law("free flight", 0.0, of=with_dry_friction(narrow), freedom=freedom)
        viscous = law("free flight", ahead, of=narrow, freedom=freedom)
        assert says in sentences([dry, viscous])[0]


def test_laws_tried_with_and_without_friction_are_ranked_once():
    fits = [
        law("free flight", 0.0, of=line()[1]),
        law("free flight with dry friction", 1.0, of=with_dry_friction(line()[1])),
        law("a", 50.0, of=swing()),
    ]
    said = sentences(fits)
    assert "Viscous friction describes the record" in said[0]
    assert said[1] == "Among the laws tried, free flight describes the record clearly best."


@pytest.mark.parametrize(("times", "says"), [(0.3, False), (0.9, True), (1.1, True), (1.3, False)])
def test_quantisation_sentence_only_at_quantisation_level(times, says):
    fitted = law("free flight", 0.0, of=line()[1])
    own = eqx.tree_at(
        lambda e: (e.problem.system.sensor.quantisation, e.rms),
        fitted.estimate,
        (jnp.asarray(0.012), jnp.asarray(times * 0.012 / np.sqrt(12))),
        is_leaf=lambda leaf: leaf is None,
    )
    said = [each for each in sentences([fitted._replace(estimate=own)]) if "quantisation" in each]
    assert bool(said) == says
    if said:
        assert f"{times * 12 / np.sqrt(12):.3g} mm rms" in said[0]


@pytest.mark.parametrize(
    ("a", "b"), [(73.4, 73.5), (73.401, 73.402), (1.0, 2.0), (2e-9, 2.000001e-9)]
)
def test_different_numbers_are_printed_differently(a, b):
    shown = apart(a, b)
    assert shown[0] != shown[1]
    assert (float(shown[0]) < float(shown[1])) == (a < b)
