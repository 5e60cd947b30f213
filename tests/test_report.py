"""The report is one page that needs nothing else, and a browser has nothing to complain of."""

import re
from html.parser import HTMLParser

import equinox as eqx
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest

import impactjax as ij
from browser import look, needs_browser
from estimates import SMALL, line, swing, with_dry_friction
from impactjax._compare.ranking import rejected
from impactjax._first_look.first_look import FirstLook
from impactjax._number_format import interval, with_error, with_unit
from impactjax._report.document import document
from impactjax._report.page import page
from impactjax._report.profile_curves import NO_CURVES
from impactjax._report.rows import law_rows, parameter_rows
from impactjax._report.style import LAWS
from impactjax._report.words import sentences

pytestmark = pytest.mark.usefixtures("numpy_promotes")

PICTURES = 11 + 8 + 10  # with impacts; without; from a list of impact times
HOSTILE = '<script>alert("x")</script>&amp; \'"[bold]'


@pytest.fixture(scope="module")
def bounces() -> ij.Estimate[ij.Problem]:
    times = 0.3 + 0.3 * (1 - 0.8 ** np.arange(9)) / 0.2
    times = times + 1e-4 * np.random.default_rng(2).standard_normal(9)
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.7)))
    start = ij.InitialState(0.0, 1.4)
    return ij.fit(ij.Experiment(model, ij.ImpactTimes(jnp.asarray(times)), start, simulation=SMALL))


@pytest.fixture(scope="module")
def fits(bounces) -> list[ij.Comparison]:
    _, straight = line()
    dry = ij.Fitted("free flight with dry friction", with_dry_friction(straight), 0.5)
    note = "A <bounce> was missed."
    return [
        ij.Comparison(HOSTILE, (ij.Fitted("restitution", swing(), 1.5),), looked(swing()), seed=7),
        ij.Comparison(
            "a/line.csv", (ij.Fitted("free flight", straight, 0.5), dry), looked(straight)
        ),
        ij.Comparison(
            "bounces.csv", (ij.Fitted("restitution", bounces, 0.5),), looked(bounces), (note,)
        ),
    ]


def looked(estimate: ij.Estimate[ij.Problem]) -> FirstLook:
    """The first look at the recording of an estimate."""
    problem = estimate.problem
    return problem.recording.first_look(problem.system.model.oscillator)


@pytest.fixture(scope="module")
def text(fits) -> str:
    return page(fits, f"impactjax fit '{HOSTILE}'")


class Tags(HTMLParser):
    def __init__(self, text: str) -> None:
        HTMLParser.__init__(self)
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


def test_page_loads_no_external_files(text):
    for tag, attributes in Tags(text).found:
        assert tag not in ("script", "iframe", "object", "embed", "base"), tag
        for name in ("src", "href", "srcset", "data", "action"):
            assert (attributes.get(name) or "data:").startswith("data:"), (tag, attributes)
    style = re.sub(r'"data:[^"]*"', "", text)
    assert not re.search(r"https?:|//[a-z]|url\(|@import", style)


def test_images_are_embedded_with_alternative_text(text):
    images = [attributes for tag, attributes in Tags(text).found if tag == "img"]
    assert len(images) == PICTURES
    for attributes in images:
        assert (attributes["src"] or "").startswith("data:image/png;base64,iVBORw0KGgo")
        assert len(attributes["alt"] or "") > 15
    assert len({attributes["alt"] for attributes in images}) == len(images)


def test_file_names_are_escaped_in_page(text):
    assert "<script" not in text
    assert "&lt;script&gt;" in text
    assert "A &lt;bounce&gt; was missed." in text


def test_page_contains_all_numbers_and_verdicts(text, fits):
    plain = re.sub(r"<[^>]*>", " ", text)
    for fitted in (each for comparison in fits for each in comparison):
        estimate = fitted.estimate
        for i, name in enumerate(estimate.names):
            error = float(estimate.standard_errors[i])
            assert name in plain
            assert estimate.quoted(name) in plain
            assert interval(float(estimate.low[i]), float(estimate.high[i]), error) in plain
    words = ("identified", "one-sided", "not identified", "converged", "seed 7", "rad/s")
    for word in words:
        assert word in plain


def test_page_says_that_a_fit_with_scatter_has_no_profiles(text, fits):
    asked = page(fits, "impactjax fit", curves={each.name: {} for each in fits})
    assert asked.count(NO_CURVES) == 1
    assert NO_CURVES not in text


@needs_browser
@pytest.mark.parametrize("width", [1200, 500])
def test_browser_shows_report(text, tmp_path, width):
    seen = look(text, tmp_path, width)
    assert len(seen.images) == PICTURES
    assert min(seen.images) > 500
    assert seen.console == []
    assert seen.overflow == 0


@needs_browser
def test_browser_test_can_fail(tmp_path):
    broken = """<html><body><img src="missing.png"><img src="https://a.test/b.png">
    <div style="width: 3000px">wide</div><script>console.error("oh")</script></body></html>"""
    seen = look(broken, tmp_path)
    assert seen.images == [0, 0]
    assert any("oh" in line for line in seen.console)
    assert seen.overflow > 1000


def test_failed_law_shows_its_reason():
    model, recording = swing().problem.system.model, swing().problem.recording
    inside, held = ij.InitialState(-3.0), ("x_dot0",)
    failed = ij.fit(ij.Experiment(model, recording, inside, fixed=held, simulation=SMALL))
    assert "The initial position lies inside a rigid stop" in failed.cause
    rows = law_rows([ij.Fitted("a", swing(), 0.0), ij.Fitted("b", failed, 0.0)])
    assert rows[1]["rms"] == rows[1]["behind"] == "–"
    assert "inside a rigid stop" in page([ij.Comparison("x", (ij.Fitted("b", failed, 0.0),))], "")
    assert swing().cause == "converged"
    stopped = ij.LevenbergMarquardt(max_iterations=2)
    start = ij.InitialState(0.5)
    early = ij.fit(
        ij.Experiment(model, recording, start, fixed=held, simulation=SMALL), optimiser=stopped
    )
    assert early.cause == "not converged: the search took all its evaluations (`max_iterations`)"


def test_one_sided_value_is_quoted_as_bound():
    loose = eqx.tree_at(
        lambda e: (e.values, e.standard_errors, e.low, e.high, e.verdicts),
        line()[1],
        (
            jnp.array([1.1e8, 0.7]),
            jnp.array([4e11, 0.01]),
            jnp.array([3.12e4, 0.68]),
            jnp.array([jnp.inf, 0.72]),
            jnp.array([ij.Verdict.ONE_SIDED, ij.Verdict.IDENTIFIED], jnp.int32),
        ),
    )
    assert loose.quoted("x0") == "more than 3.12e+04"
    assert loose.quoted("x_dot0") == "0.700 ± 0.010"
    assert swing().quoted("r") == "any value"


def test_sentence_on_unknown_end_of_interval():
    numbers = (jnp.array([jnp.nan, 0.68]), jnp.array([ij.Verdict.UNDECIDED, 1], jnp.int32))
    stopped = eqx.tree_at(lambda e: (e.low, e.verdicts), line()[1], numbers)
    expected = (
        "The search for an end of the interval of x0 failed; only its standard error is known."
    )
    assert expected in sentences([ij.Fitted("free flight", stopped, 0.0)])


def test_sentences_on_undetermined_parameters(bounces):
    said = sentences([ij.Fitted("restitution", swing(), 0.0)])
    assert any(re.search(r"zeta has an upper bound only: 0\.0\d+ ", each) for each in said)
    assert "r is not determined by the record." in said
    gravity, scatter = sentences([ij.Fitted("restitution", bounces, 0.0)])
    assert gravity.startswith("x_dot0 rests on gravity = 9.807 m/s² (not stated; the default)")
    assert "scatter" in scatter
    assert sentences([ij.Fitted("restitution", bounces, 0.0, stated=("gravity",))]) == [scatter]
    assert any(each.endswith("not determined: zeta, r.") for each in said), said


def test_sentences_on_dry_friction_and_laws(bounces):
    worse, friction = line()[1], "free flight with dry friction"
    same = with_dry_friction(worse)
    better = eqx.tree_at(lambda e: (e.aic, e.rms), same, (worse.aic - 60, 0.9 * worse.rms))
    pair = [ij.Fitted(friction, better, 0.0), ij.Fitted("free flight", worse, 0.0)]
    assert "Viscous friction alone does not describe the record" in sentences(pair)[0]
    assert "AIC better by" in sentences(pair)[0]
    equal = [ij.Fitted("free flight", worse, 0.0), ij.Fitted(friction, same, 0.0)]
    assert sentences(equal)[0].startswith("Viscous friction describes the record")
    tie = [ij.Fitted("restitution", bounces, 0.0), ij.Fitted("walton", bounces, 0.0)]
    assert "cannot be distinguished from walton" in sentences(tie)[0]


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (13.4829, 0.0072, "13.4829 ± 0.0072"),
        (698.4, 17.2, "698 ± 17"),
        (0.00196, 0.0019, "0.0020 ± 0.0019"),
        (1.5e-9, 2e-10, "1.5e-09 ± 2e-10"),
        (123456.0, 2345.0, "123500 ± 2300"),
        (4528410.0, 1875170.0, "4.5e+06 ± 1.9e+06"),
        (1293280.0, 553039.0, "1.29e+06 ± 5.5e+05"),
        (0.5, np.inf, "0.5"),
        (0.5, 0.0, "0.5"),
    ],
)
def test_values_are_rounded_to_their_error(value, error, shown):
    assert with_error(value, error) == shown


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [
        (1.234, 1.289, "1.234 to 1.289"),
        (-np.inf, 1.234, "less than 1.234"),
        (1.234, np.inf, "more than 1.234"),
        (-np.inf, np.inf, "any value"),
    ],
)
def test_open_intervals_in_words(low, high, shown):
    assert interval(low, high, 0.025) == shown


def test_any_value_has_no_unit():
    assert with_unit(interval(-np.inf, np.inf, 0.025), "rad/s") == "any value"
    assert with_unit(interval(1.234, np.inf, 0.025), "rad/s") == "more than 1.234 rad/s"


def test_document_is_json_without_infinities(fits):
    found = document(fits)
    (r,) = [fit["parameters"]["r"] for fit in found["fits"] if fit["recording"] == HOSTILE]
    assert r["standard_error"] is None
    assert r["interval95"] == [0, 1]
    assert r["verdict"] == "not identified"
    assert found["recording"] == f"{HOSTILE}, a/line.csv, bounces.csv"


def test_restitution_figure_with_more_curves_than_colours(monkeypatch):
    monkeypatch.setattr("impactjax._report.coupling_figures.LAWS", LAWS[:1])
    _, estimate = line()
    ax = ij.plot.sensitivities(
        plt.figure().add_subplot(), ij.identifiability(estimate), estimate.problem.recording
    )
    legend = ax.get_legend()
    assert legend is not None
    labels = {text.get_text() for text in legend.get_texts()}
    assert labels == {"x0", "x_dot0"}


@pytest.mark.parametrize(("worse", "missed"), [(9.0, 0.0), (30.0, 0.0), (30.0, 0.7)])
def test_rejected_law_shows_no_verdicts(worse, missed):
    """In the tables and in `fit.json`; a law that misses the record itself rules none out."""
    _, fit = line()
    best = eqx.tree_at(lambda e: e.misfit, fit, jnp.asarray(missed))
    other = eqx.tree_at(lambda e: e.aic, best, best.aic + worse)
    out = worse > 10 and missed == 0
    assert rejected([best, other]) == [False, out]
    assert rejected([other, best]) == [out, False]
    pair = tuple(ij.Fitted(name, own, 0.0) for name, own in (("a", best), ("b", other)))
    words = {row["verdict"] for row in parameter_rows(pair)[1]}
    assert words == ({"law rejected"} if out else {"identified"})
    comparison = ij.Comparison("x", pair)
    assert [each["rejected"] for each in document([comparison])["fits"]] == [False, out]
    assert ("law rejected" in page([comparison], "")) == out
