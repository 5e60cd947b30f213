"""The pages tell the truth: their Python prints what they say, their links lead somewhere."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import jax
import pytest

from pages import FENCE, assert_same_output, programs
from tiers import mostly_thorough

ROOT = Path(__file__).parent.parent
PAGES = [*ROOT.glob("*.md"), ROOT / "data" / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SLOW = (
    *("design.md", "diffrax-events.md", "engine.md", "fitting.md", "forced-response.md"),
    *("how-do-i.md", "hybrid-systems.md", "identifiability.md", "models.md", "multiple-scales.md"),
    *("other-libraries.md", "profiles.md", "several-recordings.md", "studies.md", "your-own.md"),
)
LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchors(page: str) -> set[str]:
    """The anchors that a code host gives to a page's headings."""
    headings = re.findall(r"^#+ (.*)$", FENCE.sub("", page), re.MULTILINE)
    return {
        re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings
    }


@pytest.fixture(autouse=True)
def _no_programs_left() -> Iterator[None]:
    """Clears compiled programs after each page: all pages together have too many."""
    yield
    jax.clear_caches()


ELSEWHERE = ("couplings.md",)  # test_couplings.py
WITH_PYTHON = [page for page in PAGES if page.name not in ELSEWHERE and programs(page.read_text())]


@pytest.mark.parametrize(
    "page",
    mostly_thorough(WITH_PYTHON, *(page for page in WITH_PYTHON if page.name not in SLOW)),
    ids=lambda page: page.stem,
)
def test_code_blocks_print_documented_output(page, tmp_path, monkeypatch, capsys):
    shutil.copytree(ROOT / "data", tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    text = page.read_text()
    namespace = {"__name__": page.stem}
    for block, promised in programs(text):
        lines_above = "\n" * (text.count("\n", 0, block.start) + 1)
        exec(compile(lines_above + block.text, page, "exec"), namespace)
        printed = capsys.readouterr().out
        if promised is not None:
            assert_same_output(printed, promised)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_are_valid(page):
    for link in LINK.findall(FENCE.sub("", page.read_text())):
        if link.startswith("https://"):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target.read_text()), link


def test_index_lists_every_page():
    index = (ROOT / "docs" / "index.md").read_text()
    assert {link for link in LINK.findall(index) if "/" not in link} >= {
        page.name for page in (ROOT / "docs").glob("*.md") if page.name != "index.md"
    }


def test_documentation_checks_can_fail():
    with pytest.raises(AssertionError):
        assert_same_output("r = 0.577", "r = 0.59")
    with pytest.raises(AssertionError):
        assert_same_output("r = 0.577", "k = 0.577")
    page = (
        "```python\n1\n```\n\n```text\n2\n```\nwords\n```python\n3\n```\nwords\n```text\n4\n```\n"
    )
    assert [promised for _, promised in programs(page)] == ["2\n", None]
    assert anchors("# What's a stop?\n## A b") == {"whats-a-stop", "a-b"}
