"""Tiers: which tests run when. The Makefile says what each is for."""

from collections.abc import Iterable

import pytest

quick = pytest.mark.quick
thorough = pytest.mark.thorough


def mostly_thorough(cases: Iterable, *usual: object) -> list:
    """Cases of a test, of which only the `usual` ones run every time."""
    cases = list(cases)
    assert all(each in cases for each in usual), f"{usual} are not among {cases}"
    return [each if each in usual else pytest.param(each, marks=thorough) for each in cases]
