"""What the command sets for its own process: a program may, a library may not."""

import os
from pathlib import Path

import jax

XLA_FLAGS = (
    "--xla_backend_extra_options="
    "xla_cpu_use_multi_output_fusion,xla_cpu_small_while_loop_byte_threshold=1000000"
)
"""On a CPU: do not compute shared intermediate results again for each of their uses, and run small
loops as one kernel. Several times faster to run and half the time to compile."""


def prepare() -> None:
    """Double precision, a cache of compiled programs, and two options of XLA.

    To be called before JAX computes anything. What the environment says is kept.
    """
    os.environ.setdefault("XLA_FLAGS", XLA_FLAGS)
    home = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))
    jax.config.update("jax_enable_x64", True)
    if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        jax.config.update("jax_compilation_cache_dir", str(Path(home) / "impactjax"))
    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
