"""Options of XLA for programs that run long: see "Getting speed out of a processor" in the docs."""

FAST = (
    "--xla_backend_extra_options="
    "xla_cpu_use_multi_output_fusion,xla_cpu_small_while_loop_byte_threshold=1000000"
)
