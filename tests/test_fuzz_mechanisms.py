"""A few random runs of mechanisms beside those of SciPy; `benchmarks/fuzz` has thousands."""

import pytest
from benchmarks.fuzz.mechanisms import campaign

from tiers import thorough

pytestmark = thorough


@pytest.mark.usefixtures("numpy_promotes")
@pytest.mark.parametrize(
    ("system", "laws"),
    [
        ("two-masses", "mixed"),
        ("cart-pendulum", "restitution"),
        ("double-pendulum", "at-zero-force"),
        ("chain", "hunt-crossley"),
    ],
)
def test_random_runs_agree_with_scipy(system, laws):
    ((_, verdicts),) = campaign(system, 0, 30, 1e-11, laws)
    assert len(verdicts) >= 6
    assert {each.said for each in verdicts} <= {"right", "ill-conditioned"}
    assert sum(each.said == "right" for each in verdicts) >= 5
