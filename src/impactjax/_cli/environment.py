"""What the command sets for its own process: a program may, a library may not."""

import gc
import os
from pathlib import Path

import jax

OPTIONS = (
    "--xla_backend_optimization_level=1 --xla_backend_extra_options="
    "xla_cpu_small_while_loop_byte_threshold=1000000,xla_cpu_disable_new_fusion_emitters"
)
"""XLA_FLAGS on a CPU for who waits for the compiler rather than for the program: half the time."""

_COLLECT_AFTER = 100_000  # allocations; tracing makes much and leaves little garbage


def prepare() -> None:
    """Double precision, programs that compile fast, and a cache of them.

    What the environment says is kept. To be called before JAX computes anything.
    """
    gc.set_threshold(_COLLECT_AFTER)
    os.environ.setdefault("XLA_FLAGS", OPTIONS)
    home = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))
    jax.config.update("jax_enable_x64", True)
    if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        jax.config.update("jax_compilation_cache_dir", str(Path(home) / "impactjax"))
    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
