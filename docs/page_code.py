"""The Python of a page, for the script that draws its figures."""

import contextlib
import io
import re
import runpy
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def names_of(page: str) -> dict[str, Any]:
    """All names that the Python blocks of a page define, run one after the other.

    **Arguments:**

    - `page`: name of a file in this folder, such as "hybrid-systems.md".
    """
    program = "\n".join(_BLOCK.findall((HERE / page).read_text(encoding="utf-8")))
    quiet = contextlib.redirect_stdout(io.StringIO())
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), quiet:
        path = Path(folder) / "page.py"
        path.write_text(program, encoding="utf-8")
        return runpy.run_path(str(path))
