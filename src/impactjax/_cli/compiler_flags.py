"""What the command sets for its own process: a program may, a library may not."""

import gc
import os
from pathlib import Path

import jax

SAFE = "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1000000"
"""XLA_FLAGS on a CPU: run small loops as one kernel."""

FAST = f"{SAFE},xla_cpu_use_multi_output_fusion"
"""And do not compute shared intermediate results again for each of their uses: several times faster
to run and half the time to compile, but the compiler of JAX 0.10 aborts on a few programs."""

_COLLECT_AFTER = 100_000  # allocations; tracing makes much and leaves little garbage


def prepare() -> None:
    """Double precision and a cache of compiled programs. What the environment says is kept.

    To be called before JAX computes anything, as is the choice of XLA_FLAGS.
    """
    gc.freeze()  # what was imported stays
    gc.set_threshold(_COLLECT_AFTER)
    home = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))
    jax.config.update("jax_enable_x64", True)
    if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        jax.config.update("jax_compilation_cache_dir", str(Path(home) / "impactjax"))
    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def compiled_programs() -> Path | None:
    """The folder in which JAX keeps them, if it does."""
    folder = jax.config.values["jax_compilation_cache_dir"]
    return None if folder is None else Path(folder)
