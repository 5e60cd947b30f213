"""Intervals across laws that cannot be distinguished, against mixtures by SciPy."""

import re

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array
from scipy import optimize, stats

import impactjax as ij
from estimates import line, swing
from impactjax._compare.across import across
from impactjax._report.document import document
from impactjax._report.rows import parameter_rows
from impactjax._report.words import sentences

ERROR = 0.02


def moved(by: float, aic: float, high: float | None = None) -> ij.Estimate[ij.Problem]:
    """The fit of a line with another first value, whose error is ERROR, and another criterion."""
    estimate = line()[1]
    value = float(estimate.value("x0")) + by
    low, high = value - 1.96 * ERROR, value + 1.96 * ERROR if high is None else high
    return eqx.tree_at(
        lambda e: (e.values, e.low, e.high, e.aic),
        estimate,
        (
            jnp.asarray(estimate.values).at[0].set(value),
            jnp.asarray(estimate.low).at[0].set(low),
            jnp.asarray(estimate.high).at[0].set(high),
            jnp.asarray(aic),
        ),
    )


@pytest.mark.parametrize(("by", "behind"), [(0.1, 0.0), (0.1, 4.0), (-0.05, 2.0)])
def test_interval_across_two_laws_is_that_of_their_mixture(by, behind):
    pair = [moved(0.0, 0.0), moved(by, behind)]
    share = np.exp(-behind / 2) / (1 + np.exp(-behind / 2))
    at = float(pair[0].value("x0"))

    def above(x: float, level: float) -> float:
        own, other = (stats.norm.cdf(x, loc, ERROR) for loc in (at, at + by))
        return (1 - share) * own + share * other - level

    ends = [
        optimize.root_scalar(above, (level,), bracket=(at - 1, at + 1)).root
        for level in (0.025, 0.975)
    ]
    own = pair[0]["x0"]
    found = across(pair)["x0"]
    np.testing.assert_allclose(found.low, min(ends[0], own.low), atol=1e-5)
    np.testing.assert_allclose(found.high, max(ends[1], own.high), atol=1e-5)
    assert found.models == (0, 1)
    assert "x_dot0" not in across(pair)


def test_printed_interval_of_an_unlikely_law_holds_its_own():
    pair = [ij.Fitted("a", moved(0.0, 0.0), 0.0), ij.Fitted("b", moved(0.5, 4.0), 0.0)]
    assert across([each.estimate for each in pair])["x0"].high < pair[1].estimate["x0"].high
    for row, each in zip((rows[0] for rows in parameter_rows(pair)), pair, strict=True):
        low, high = (float(end) for end in row["interval"].split(" to "))
        own = each.estimate["x0"]
        assert low <= own.low + 1e-3
        assert high >= own.high - 1e-3


def test_rejected_law_does_not_widen_an_interval():
    assert across([moved(0.0, 0.0), moved(0.1, 12.0)]) == {}


def test_open_interval_of_a_likely_law_stays_open():
    pair = [moved(0.0, 0.0), moved(0.0, 1.0, np.inf)]
    assert across(pair)["x0"].high == np.inf
    assert across(pair)["x0"].verdict is ij.Verdict.ONE_SIDED
    rows = parameter_rows([ij.Fitted(name, own, 0.0) for name, own in zip("ab", pair, strict=True)])
    assert rows[0][0]["verdict"] == "one-sided"
    both = eqx.tree_at(lambda e: e.low, pair[1], jnp.asarray(pair[1].low).at[0].set(-np.inf))
    assert across([pair[0], both])["x0"].verdict is ij.Verdict.NOT_IDENTIFIED
    unknown = eqx.tree_at(lambda e: e.low, pair[0], jnp.asarray(pair[0].low).at[0].set(np.nan))
    assert across([unknown, pair[1]]) == {}
    assert across([moved(0.0, 0.0), moved(0.0, 9.0, np.inf)]) == {}


class Halved(ij.AbstractImpactLaw):
    """Half of a number r, which is no coefficient of restitution."""

    r: Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("1", at_least=0))

    def restitution(self, speed):
        return self.r / 2 * jnp.ones_like(speed)


def test_laws_of_different_types_share_no_parameter_of_the_law():
    """The name r means something else in a law of another type."""
    one = swing()
    at = one.names.index("r")
    first, second = (
        eqx.tree_at(
            lambda e: (e.values, e.low, e.high, e.standard_errors),
            one,
            (
                jnp.asarray(one.values).at[at].set(r),
                jnp.asarray(one.low).at[at].set(r - 0.02),
                jnp.asarray(one.high).at[at].set(r + 0.02),
                jnp.asarray(one.standard_errors).at[at].set(0.01),
            ),
        )
        for r in (0.5, 0.6)
    )
    assert across([first, second])["r"].high == pytest.approx(0.62, abs=0.01)
    law = Halved(0.5)
    other = eqx.tree_at(lambda e: e.problem.system.model.lower.law, second, law)
    assert set(other.problem.handles()) == set(one.names)
    assert "r" not in across([first, other])


def test_interval_across_laws_is_printed_and_written():
    pair = tuple(ij.Fitted(name, moved(by, 0.0), 0.0) for name, by in (("a", 0.0), ("b", 0.1)))
    (said,) = (each for each in sentences(pair) if "over all of them" in each)
    assert said.startswith("a and b cannot be distinguished. Intervals over all of them, with")
    rows = parameter_rows(pair)
    assert rows[0][0]["interval"] in said
    fits = document([ij.Comparison("x", pair)])["fits"]
    assert fits[0]["across"]["x0"]["laws"] == ["a", "b"]
    assert fits[1]["across"] == {}


def test_laws_that_differ_in_several_parameters_need_one_sentence():
    first, second = moved(0.0, 0.0), moved(0.1, 0.0)
    by = 5 * second.standard_errors[1]
    second = eqx.tree_at(
        lambda e: (e.values, e.low, e.high),
        second,
        [jnp.asarray(each).at[1].add(by) for each in (second.values, second.low, second.high)],
    )
    pair = ij.Fitted("a", first, 0.0), ij.Fitted("b", second, 0.0)
    (said,) = (each for each in sentences(pair) if "over all of them" in each)
    assert said.startswith("a and b cannot be distinguished. ")
    ends = r"[-\d.]+ to [-\d.]+"
    assert re.search(rf"brackets: x0 {ends} m \({ends} m\), x_dot0 {ends} m/s \({ends} m/s\)", said)
