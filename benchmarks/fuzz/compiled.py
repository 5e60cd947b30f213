"""Numba where it is installed, plain Python where it is not."""
# pyright: reportMissingImports=false

import hashlib
from collections.abc import Callable
from pathlib import Path

from jaxtyping import PyTree

try:
    import numba
except ImportError:
    numba = None


def compiled(function: Callable[..., PyTree]) -> Callable[..., PyTree]:
    """Compile a function, keeping the program on disk; without Numba, leave it as it is."""
    if numba is None:
        return function
    return numba.njit(cache=True, error_model="numpy")(function)


def _programs() -> str:
    here = Path(__file__).parent
    texts = [file.read_bytes() for file in sorted(here.glob("*.py"))]
    compiled = b"".join(text for text in texts if b"@compiled" in text)
    return str(here / "__pycache__" / hashlib.sha256(compiled).hexdigest()[:16])


if numba is not None:
    # Numba looks only at a function's own file, not at those of the functions that it calls.
    numba.config.CACHE_DIR = _programs()  # pyright: ignore
