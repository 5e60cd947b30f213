"""Profiles in reports and in the command `identifiability`."""

import json

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import line
from impactjax._cli.identifiability import profile_rows
from impactjax._report.document import document
from impactjax._report.page import page
from impactjax._report.profile_curves import NO_CURVES, best_curves

pytestmark = pytest.mark.usefixtures("numpy_promotes")


def test_profiles_of_a_line_are_parabolas():
    """In document and page: a rise of (p - estimate)²/error²."""
    estimate = line()[1]
    straight = ij.Comparison("line", (ij.Fitted("a", estimate, 0.0), ij.Fitted("b", estimate, 0.0)))
    curves = best_curves([straight])
    first, second = document([straight], None, curves)["fits"]
    assert second["profiles"] == {}
    assert [*first["profiles"]] == [*estimate.names] == ["x0", "x_dot0"]
    for name, found in first["profiles"].items():
        own = estimate[name]
        away = (np.array(found["at"]) - float(own.value)) / float(own.standard_error)
        np.testing.assert_allclose(found["rise"], away**2, rtol=1e-3, atol=1e-3)
        reach = float(own.standard_error) * found["threshold"] ** 0.5
        ends = [float(own.value) - reach, float(own.value) + reach]
        np.testing.assert_allclose(found["interval95"], ends, atol=1e-2 * reach)
        assert (found["shape"], found["unit"]) == ("bounded", own.unit)
    without, text = (page([straight], "", None, each) for each in ({}, curves))
    assert text.count("<img") == without.count("<img") + 2
    assert "Profile of a parameter of a for line: x0: 0." in text
    assert "<h3>Profiles" not in without
    assert NO_CURVES not in without
    told = profile_rows(estimate)
    assert [row.split(":")[0] for row in told] == ["Profiles, 95 %", "  x0", "  x_dot0"]
    assert all(row.endswith("(bounded)") for row in told[1:])


def test_profiles_are_written_if_asked(tmp_path):
    straight = ij.Comparison("line", (ij.Fitted("a", line()[1], 0.0),))
    for asked in (False, True):
        path, _ = ij.io.write_report(tmp_path, straight, profiles=asked, force=True)
        (found,) = json.loads(path.read_text())["fits"]
        assert bool(found["profiles"]) == asked


def test_fit_without_profile_has_none():
    stopped = eqx.tree_at(lambda e: e.outcome, line()[1], jnp.int32(ij.Outcome.MAX_ITERATIONS))
    assert best_curves([ij.Comparison("x", (ij.Fitted("a", stopped, 0.0),))]) == {"x": {}}
