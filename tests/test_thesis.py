"""The thesis reproduced: its constants, its table, and the verdicts on its claims."""

import json
import re
from pathlib import Path

import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

import impactjax as ij
from command import impactjax, impactjax_in_its_own_process
from impactjax._thesis import constants
from impactjax._thesis.claim import Claim, Verdict, judged
from impactjax._thesis.compliance import figure_3_5
from impactjax._thesis.figures import FIGURES
from impactjax._thesis.motions import Motion, rigid
from impactjax._thesis.spectrum import exact_peak, peak
from impactjax._thesis.stuck import stuck_for_ever, stuck_from
from impactjax._thesis.sweep import figure_4_8
from longest_contact import longest_contact
from tiers import quick, thorough

NUMBERS = ["2.3", *(f"3.{n}" for n in range(1, 10)), "4.1", "4.2", "4.3", "4.3-1hz"]
NUMBERS += [f"4.{n}" for n in range(4, 11)]


@quick
def test_all_figures_of_the_thesis_in_its_order():
    assert list(FIGURES) == NUMBERS


@quick
def test_verdict_of_a_claim():
    assert judged(True) == "agrees"
    assert judged(True, misprint=True) == "agrees"
    assert judged(False, misprint=True) == "misprint"
    assert judged(False) == "differs"


@quick
def test_printed_restitutions_and_damping_ratios_against_mpmath():
    with mpmath.workdps(30):
        for gamma in (0.14, 0.165, 0.18):
            exact = mpmath.exp(
                -mpmath.pi * mpmath.mpf(gamma) / mpmath.sqrt(1 - mpmath.mpf(gamma) ** 2)
            )
            assert constants.restitution_of(gamma) == pytest.approx(float(exact), rel=1e-14)
            assert constants.damping_of(float(exact)) == pytest.approx(gamma, rel=1e-13)
    assert constants.damping_of(0.577) == pytest.approx(0.1724, abs=5e-5)
    assert constants.restitution_of(0.18) == pytest.approx(0.5628, abs=5e-5)


@quick
def test_peak_of_a_record_of_15_s_is_one_of_its_lines():
    """A quarter of 94.25 rad/s is 3.7501 Hz; the nearest fifteenth of 1 Hz is 3.7333."""
    ts = np.arange(15_000) / 1000
    assert peak(np.cos(94.25 / 4 * ts), 1e-3) == pytest.approx(56 / 15)
    whole = np.arange(15_000) / 15_000 * 40 * 2 * np.pi / 94.25
    assert exact_peak(np.cos(94.25 / 4 * whole), 94.25, 40) == pytest.approx(94.25 / 8 / np.pi)


class _Rests:
    """A rest log with one rest, or with none."""

    def __init__(self, count):
        self.count, self.begin = np.int32(count), np.array([0.5, 0.0])


@quick
@pytest.mark.parametrize(("count", "still"), [(1, 50), (0, 0)])
def test_mass_that_is_stuck_for_ever(count, still):
    ts = np.arange(100) / 100
    motion = Motion(ts, np.ones(100), np.ones(100), None, _Rests(count), None)  # pyright: ignore
    assert stuck_from(motion) == (0.5 if count else np.inf)
    angle = stuck_for_ever(motion)
    assert np.sum(angle == 0) == still
    np.testing.assert_array_equal(angle[: 100 - still], 1)


@quick
def test_figure_that_does_not_exist_is_refused():
    run = impactjax("thesis", "--figure", "5.1")
    assert run.status == 2
    assert run.stderr.startswith("impactjax: there is no figure 5.1; there are 2.3, 3.1,")


@quick
def test_files_that_exist_are_kept(tmp_path):
    (tmp_path / "figure-4.8.png").write_text("mine")
    run = impactjax("thesis", "--figure", "4.8", "--out", tmp_path)
    assert run.status == 2
    assert "figure-4.8.png exists" in run.stderr
    assert (tmp_path / "figure-4.8.png").read_text() == "mine"


@quick
def test_table_in_every_form(tmp_path):
    """Figure 4.8, for which nothing is simulated."""
    run = impactjax("thesis", "--figure", "4.8", "--out", tmp_path)
    assert (run.status, run.stderr) == (0, "")
    assert run.stdout.startswith("4.8      Relationship between forcing frequency and amplitude")
    document = json.loads((tmp_path / "thesis.json").read_text())
    (first, second) = document["figures"]["4.8"]["claims"]
    assert first["verdict"] == "agrees"
    assert second["verdict"] == "differs"
    assert second["reason"]
    page = (tmp_path / "thesis.html").read_text()
    for text in (run.stdout, page):
        assert first["ours"] in text
    assert 'src="figure-4.8.png"' in page
    assert (tmp_path / "figure-4.8.png").read_bytes().startswith(b"\x89PNG")


@quick
def test_sweep_of_the_base():
    """33.1 mm at 3 Hz, by the printed polynomial."""
    exact = 10 ** (-0.0004963 * 27 + 0.019409 * 9 - 0.33884 * 3 - 0.6252)
    (first, _) = figure_4_8().claims
    assert first.ours == f"{1e3 * exact:.1f} mm"


def test_walton_curve_and_its_approximation():
    """The largest deviation of equation 3.29 from the exact curve, and the slope at |Z0| = 1.03."""
    close, falls, sensitive = figure_3_5().claims
    with mpmath.workdps(20):
        sizes = np.linspace(0.01, 10, 200)
        exact = [_walton(z) for z in sizes]
        worst = max(
            abs(1 / (z + mpmath.exp(-0.4 * z)) / r - 1) for z, r in zip(sizes, exact, strict=True)
        )
        slope = mpmath.diff(lambda x: mpmath.log(_walton(mpmath.exp(x))), mpmath.log(1.03))
    assert close.ours == f"within {100 * float(worst):.1f} % up to |Z0| = 10"
    assert falls.verdict == Verdict.AGREES
    assert sensitive.ours == f"17 % of r are {17 / abs(float(slope)):.0f} % of λ"


def _walton(size):
    """Root r of equation 3.30 with Z0 = −size."""
    return mpmath.findroot(
        lambda r: -size * (1 + r) + mpmath.log((1 + size) / (1 - size * r)),
        (1e-4, 0.99999 / size),
        solver="anderson",
    )


SEVERAL = {
    "2.3": "cannot be judged, differs, agrees, differs",
    "3.1": "misprint, cannot be judged, agrees, cannot be judged",
    "3.2": "agrees, differs",
    "3.3": "cannot be judged",
    "3.4": "differs, misprint, misprint, agrees, agrees, differs, differs, cannot be judged",
    "3.5": "agrees, agrees, agrees",
    "3.6": "misprint, agrees",
    "3.7": "misprint, agrees, agrees, differs",
    "3.8": "differs",
    "3.9": "agrees, differs",
    "4.1": "agrees, agrees, agrees, agrees, agrees, agrees",
    "4.2": "agrees, agrees, agrees, agrees, differs",
    "4.3": "agrees, agrees, agrees, differs, agrees, agrees, differs",
    "4.3-1hz": "misprint, differs, misprint, agrees, agrees",
    "4.4": "agrees, misprint",
    "4.5": "agrees, misprint",
    "4.6": "agrees, misprint",
    "4.7": "agrees, differs, differs, cannot be judged, differs",
    "4.8": "agrees, differs",
    "4.9": "differs, differs",
    "4.10": "differs, agrees",
}
"""Verdicts on the claims beside each figure."""


@quick
def test_page_has_these_verdicts():
    """`python docs/thesis.py` writes its table."""
    page = (Path(__file__).parent.parent / "docs" / "thesis.md").read_text()
    rows = page.split("<!-- table -->")[1].split("<!-- end of the table -->")[0].splitlines()[3:]
    found = [row.split(" | ")[-1].removesuffix(" |") for row in rows]
    assert ", ".join(found) == ", ".join(SEVERAL.values())


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """The claims beside each figure, by one run of the whole command."""
    out = tmp_path_factory.mktemp("thesis")
    run = impactjax_in_its_own_process("thesis", "--out", out)
    assert (run.status, run.stderr) == (0, "")
    assert all((out / f"figure-{number}.png").stat().st_size > 10_000 for number in NUMBERS)
    figures = json.loads((out / "thesis.json").read_text())["figures"]
    return {
        number: [Claim(**{**each, "verdict": Verdict(each["verdict"])}) for each in found["claims"]]
        for number, found in figures.items()
    }


def ours(table, figure, said):
    """The numbers in what was computed for the claim that begins in this way."""
    (found,) = [each for each in table[figure] if each.said.startswith(said)]
    return [float(each) for each in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", found.ours)]


@thorough
def test_every_verdict(table):
    found = {number: ", ".join(each.verdict for each in claims) for number, claims in table.items()}
    assert found == SEVERAL
    for claim in [each for claims in table.values() for each in claims]:
        assert claim.said
        assert claim.ours
        assert claim.reason or claim.verdict == Verdict.AGREES


@thorough
def test_forced_motions_have_their_known_numbers(table):
    """Values found by two simulators independently of this command."""
    assert ours(table, "4.1", "period of the motion, restitution") == [1]
    assert ours(table, "4.2", "period of the motion, Kelvin-Voigt") == [2]
    assert ours(table, "4.3", "period of the motion, restitution") == [4]
    assert ours(table, "4.3", "largest line") == [3.7333, 3.7333]
    assert ours(table, "4.3", "frequency of the largest") == [3.7501]
    exponent, error = ours(table, "4.7", "chaos with the Kelvin-Voigt")
    assert abs(exponent - 3.28) < 3 * np.hypot(error, 0.17)
    assert ours(table, "4.7", "chaos with restitution") == [8]
    small, tenfold, *_ = ours(table, "4.3-1hz", "largest angle")
    assert (small, tenfold) == (0.99, 9.87)
    rests, impacts = ours(table, "4.3-1hz", "restitution: chatter")
    assert (rests, impacts) == (1, 26)


@thorough
def test_chatter_at_1_hz_is_summed_after_22_impacts_at_a_tolerance_of_1e_minus_6():
    """The infinite series is followed longer, the smaller the tolerance."""
    case = constants.AT_1_HZ
    run = ij.simulate(
        rigid(case), ij.InitialState(0.2), jnp.array([0.0, 12.0]), tolerance=1e-6, max_impacts=512
    )
    begins = np.asarray(run.rests.begin)[: int(run.rests.count)][-5:]
    times = np.asarray(run.impacts.time)
    assert np.sum((times > begins[0]) & (times < begins[-1])) == 4 * 22


@thorough
def test_contacts_have_their_known_numbers(table):
    assert ours(table, "3.7", "r of k x^1.5 + c") == [0.144, 0.247, 0.329, 0.1, 0.3, 0.73]
    si, radian = ours(table, "3.6", "λ = 0.1")
    assert si == pytest.approx(0.954, abs=1e-3)
    assert radian == pytest.approx(0.586, abs=2e-3)
    assert ours(table, "3.4", "contact duration from")[0] == 3.87
    low, high, *_ = ours(table, "4.10", "no chatter")
    assert low > 20
    assert high < 80


@thorough
@pytest.mark.parametrize(
    ("place", "case"),
    [(0, (3.32e-3, 0.65, 0.05)), (1, (3.32e-3, 0.6, 0.05)), (2, (33.2e-3, 0.65, 0.05 / 0.071))],
)
def test_rest_of_the_kelvin_voigt_contact_against_scipy(table, place, case):
    """The longest contact at 1 Hz in ms: with r0 = 0.65, with 0.60, and with α in s/rad."""
    told = table["4.3-1hz"]
    texts = told[2].ours, told[3].ours, told[2].reason
    shown = re.findall(r"(\d+\.?\d*) ms", texts[place])[0]
    assert float(shown) == pytest.approx(1e3 * longest_contact(*case), abs=0.5)
