"""Double precision, strict promotion, one compilation cache for all test processes."""

import os
from pathlib import Path

CACHE = Path(__file__).parent.parent / ".jax_cache"

os.environ.setdefault(
    "XLA_FLAGS",
    "--xla_backend_extra_options="
    "xla_cpu_use_multi_output_fusion,xla_cpu_small_while_loop_byte_threshold=1000000",
)
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(CACHE))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.1")
os.environ.setdefault("EQX_ON_ERROR", "nan")

import jax  # noqa: E402  after the environment that it reads

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
