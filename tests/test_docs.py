"""The pages tell the truth: their Python prints what they say, their links lead somewhere."""

import re
import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import jax
import pytest

from tiers import mostly_thorough

ROOT = Path(__file__).parent.parent
PAGES = [*ROOT.glob("*.md"), ROOT / "data" / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SLOW = (
    *("couplings.md", "design.md", "diffrax-events.md", "engine.md", "fitting.md", "how-do-i.md"),
    *(
        "forced-response.md",
        "hybrid-systems.md",
        "multiple-scales.md",
        "other-libraries.md",
        "several-recordings.md",
        "studies.md",
        "your-own.md",
    ),
)
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


class Block(NamedTuple):
    """A fenced block: its language, its text, and where it is on the page."""

    language: str
    text: str
    start: int
    end: int


def blocks(page: str) -> list[Block]:
    return [Block(m[1], m[2], m.start(), m.end()) for m in FENCE.finditer(page)]


def programs(page: str) -> list[tuple[Block, str | None]]:
    """Python blocks, each with the output that the page gives right after it, if any."""
    found = []
    for block, after in pairwise([*blocks(page), Block("", "", len(page), len(page))]):
        if block.language == "python":
            follows = after.language == "text" and not page[block.end : after.start].strip()
            found.append((block, after.text if follows else None))
    return found


def anchors(page: str) -> set[str]:
    """The anchors that a code host gives to a page's headings."""
    headings = re.findall(r"^#+ (.*)$", FENCE.sub("", page), re.MULTILINE)
    return {
        re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings
    }


def assert_same_output(printed: str, promised: str) -> None:
    """The same words, and numbers equal but for what another processor may round otherwise."""
    assert NUMBER.sub("#", printed).split() == NUMBER.sub("#", promised).split()
    for number, other in zip(NUMBER.findall(printed), NUMBER.findall(promised), strict=True):
        assert float(number) == pytest.approx(float(other), rel=2e-3)


@pytest.fixture(autouse=True)
def _no_programs_left() -> Iterator[None]:
    """Clears compiled programs after each page: all pages together have too many."""
    yield
    jax.clear_caches()


WITH_PYTHON = [page for page in PAGES if programs(page.read_text())]


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
