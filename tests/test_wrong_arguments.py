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
import wrong_responses
from tiers import quick

TIERS = {
    wrong_fits: quick,
    wrong_hybrid_systems: quick,
    wrong_responses: quick,
    wrong_experiments: (),  # which need an estimate
}
PROGRAMS = [pytest.param(each, id=each.__name__, marks=tier) for each, tier in TIERS.items()]
CASES = [
    pytest.param(each, case, id=f"{each.__name__}, {case}", marks=tier)
    for each, tier in TIERS.items()
    for case in each.SENTENCES
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
