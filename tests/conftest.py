"""Double precision, strict promotion, one compilation cache for all test processes."""

import math
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

CACHE = Path(__file__).parent.parent / ".jax_cache"
MAPS, MANY_PIECES = Path("/proc/self/maps"), 20_000

os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(CACHE))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.1")
os.environ.setdefault("EQX_ON_ERROR", "nan")

import jax  # noqa: E402  after the environment that it reads

from impactjax._cli.compiler_flags import FAST, prepare  # noqa: E402

# Most programs run only once: optimising them takes longer than it saves.
WITHOUT_OPTIMISATION = (
    "--xla_backend_optimization_level=0",
    "--xla_llvm_enable_alias_scope_metadata=false",
    "--xla_llvm_enable_noalias_metadata=false",
    "--xla_disable_hlo_passes=while-loop-simplifier,while-loop-constant-sinking,"
    "while-loop-invariant-code-motion,conditional-simplifier",
)
os.environ.setdefault("XLA_FLAGS", " ".join((FAST, *WITHOUT_OPTIMISATION)))
prepare()
jax.config.update("jax_numpy_dtype_promotion", "strict")


@pytest.fixture(scope="module", autouse=True)
def _not_too_many_programs() -> Iterator[None]:
    """Clears compiled programs after a file if they are many; else the next file may use them.

    Linux lets a process map 65,530 pieces of memory; a program takes several, and one too many ends
    the process.
    """
    yield
    if _pieces_of_memory() > MANY_PIECES:
        jax.clear_caches()


def _pieces_of_memory() -> float:
    """Number of pieces of memory that this process maps; infinite where the system does not say."""
    try:
        return MAPS.read_bytes().count(b"\n")
    except OSError:
        return math.inf


@pytest.fixture(scope="module")
def numpy_promotes() -> Iterator[None]:
    """NumPy's promotion of types, as in the command."""
    with jax.numpy_dtype_promotion("standard"):
        yield
