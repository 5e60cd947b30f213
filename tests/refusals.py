"""Sentences in which wrong arguments end.

The cases run in a process of their own: here types are checked at run time, which would come first.
"""

import json
import subprocess
import sys

_END = """
import json, sys
found = {}
for name, case in cases.items():
    try:
        case()
    except (TypeError, ValueError) as error:
        found[name] = f"{type(error).__name__}: {error}"
json.dump(found, sys.stdout)
"""


def sentences_of(program: str) -> dict[str, str]:
    """Type and sentence of the error of each case that is refused.

    **Arguments:**

    - `program`: code that defines `cases`, functions by name.
    """
    run = subprocess.run(
        [sys.executable, "-c", program + _END], capture_output=True, text=True, check=True
    )
    return json.loads(run.stdout)
