"""impactjax's own side of the comparison. NOT WRITTEN YET: every task raises until it is.

Each function prepares one task, exactly as `rivals/tasks.py` defines it, and returns a `Prepared`
(see `rivals/prepared.py`) whose `run()` gives the same array as a rival's. The pattern is
`rivals/numba_rival.py`.
"""

from rivals.prepared import Prepared


def t1(law: str) -> Prepared:
    """One trajectory: (1401,)."""
    raise NotImplementedError


def t2(law: str) -> Prepared:
    """A thousand trajectories: (1000, 1401)."""
    raise NotImplementedError


def t3(law: str) -> Prepared:
    """Derivatives of one trajectory: (parameters, 1401)."""
    raise NotImplementedError


def t3_batch(law: str) -> Prepared:
    """Derivatives of a thousand trajectories: (1000, parameters, 1401)."""
    raise NotImplementedError


def t4(law: str) -> Prepared:
    """The forced record: (22001,)."""
    raise NotImplementedError


def t4_sweep(law: str) -> Prepared:
    """The sweep of forcing frequencies: (200, 50)."""
    raise NotImplementedError


def t5(law: str) -> Prepared:
    """The fit: the estimate, in the order of `tasks.NAMES` without the start angle."""
    raise NotImplementedError
