"""Pages of the documentation: their Python, and what it prints."""

import re
from itertools import pairwise
from typing import NamedTuple

import pytest

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
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


def assert_same_output(printed: str, promised: str) -> None:
    """The same words, and numbers equal but for what another processor may round otherwise."""
    assert NUMBER.sub("#", printed).split() == NUMBER.sub("#", promised).split()
    for number, other in zip(NUMBER.findall(printed), NUMBER.findall(promised), strict=True):
        assert float(number) == pytest.approx(float(other), rel=2e-3)
