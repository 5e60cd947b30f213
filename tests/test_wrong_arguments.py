"""Wrong arguments end in one sentence that says what is wrong, and often what would be right.

The cases run in a process of their own: here types are checked at run time, which would come first.
"""

import functools
import json
import subprocess
import sys
from types import ModuleType

import pytest

import wrong_experiments
import wrong_fits
import wrong_hybrid_systems
from tiers import quick

PROGRAMS = [
    pytest.param(wrong_fits, id="fits", marks=quick),
    pytest.param(wrong_hybrid_systems, id="hybrid systems", marks=quick),
    pytest.param(wrong_experiments, id="experiments"),  # which need an estimate
]
CASES = [
    pytest.param(each.values[0], case, id=f"{each.id}, {case}", marks=each.marks)
    for each in PROGRAMS
    for case in each.values[0].SENTENCES
]

END = """
import json, sys
found = {}
for name, case in cases.items():
    try:
        case()
    except (TypeError, ValueError) as error:
        found[name] = f"{type(error).__name__}: {error}"
json.dump(found, sys.stdout)
"""


@functools.cache
def said(program: ModuleType) -> dict[str, str]:
    """Type and sentence of the error of each case that is refused."""
    run = subprocess.run(
        [sys.executable, "-c", program.PROGRAM + END], capture_output=True, text=True, check=True
    )
    return json.loads(run.stdout)


@pytest.mark.parametrize(("program", "case"), CASES)
def test_wrong_argument_is_refused_with_a_sentence(program, case):
    assert said(program)[case].startswith(program.SENTENCES[case])


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_case_is_refused(program):
    assert said(program).keys() == program.SENTENCES.keys()
