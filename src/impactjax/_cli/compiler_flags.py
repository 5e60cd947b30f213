"""Settings of the command's own process, which a library must not change."""

import gc
import os
from pathlib import Path

import jax

SAFE = (
    "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1000000,"
    "xla_cpu_disable_slp_vectorizer,xla_cpu_disable_loop_unrolling"
)
"""XLA_FLAGS on a CPU that run small loops as one kernel, and leave out two passes of the compiler,
which take an eighth of the time of a first fit."""

FAST = f"{SAFE},xla_cpu_use_multi_output_fusion"
"""XLA_FLAGS that also compute shared intermediate results only once: programs run several times
faster and compile in half the time, but the compiler of JAX 0.10 aborts on a few of them."""

_COLLECT_AFTER = 100_000  # allocations between collections; tracing leaves little garbage


def prepare() -> None:
    """Sets double precision and a cache of compiled programs, unless environment variables do.

    Call it before JAX computes anything.
    """
    gc.freeze()  # imported modules are never garbage
    gc.set_threshold(_COLLECT_AFTER)
    home = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))
    jax.config.update("jax_enable_x64", True)
    if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        jax.config.update("jax_compilation_cache_dir", str(Path(home) / "impactjax"))
    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def compiled_programs() -> Path | None:
    """The folder of JAX's cache of compiled programs; `None` without a cache."""
    folder = jax.config.values["jax_compilation_cache_dir"]
    return None if folder is None else Path(folder)
