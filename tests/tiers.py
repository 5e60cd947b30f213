"""Tiers: which tests run when. The Makefile says what each is for."""

from collections.abc import Iterable

import pytest

quick = pytest.mark.quick
thorough = pytest.mark.thorough


def mostly_thorough(cases: Iterable[object], *usual: object) -> list[object]:
    """Cases of a test, of which only the `usual` ones run every time; a tuple is several values."""
    cases = list(cases)
    assert all(each in cases for each in usual), f"{usual} are not among {cases}"
    return [each if each in usual else _thorough(each) for each in cases]


def _thorough(case: object) -> object:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=thorough)
