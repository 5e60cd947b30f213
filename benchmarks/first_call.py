"""How long a first call takes in a new process, and the memory of many derivatives: a JSON line.

    python benchmarks/first_call.py T1|T3|memory restitution|kelvin-voigt [--cache DIR]

Call it twice with the same `--cache` for the time with compiled programs at hand. `memory` takes
the derivatives of ten times a thousand trajectories.
"""

import argparse
import json
import resource
import time

import jax
import jax.numpy as jnp
import numpy as np

import ours
from rivals import tasks


def _first_call(task: str, law: str) -> float:
    """Seconds to trace, compile and run."""
    values = jnp.asarray(tasks.parameters(law))
    jax.block_until_ready(jnp.sin(values))  # JAX itself has started
    function = {"T1": ours.angles, "T3": ours.derivatives}[task]
    begin = time.perf_counter()
    jax.block_until_ready(jax.jit(lambda p: function(law, p))(values))
    return time.perf_counter() - begin


def _peak(law: str) -> float:
    """Largest memory of the process [MiB], that of JAX and of the result included."""
    lanes = jnp.asarray(np.tile(tasks.drawn_parameters(law), (10, 1)))
    jax.block_until_ready(jax.jit(ours.together(ours.derivatives, law))(lanes))
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description="First calls and memory.")
    parser.add_argument("task", choices=("T1", "T3", "memory"))
    parser.add_argument("law", choices=tasks.LAWS)
    parser.add_argument("--cache", help="folder of compiled programs")
    arguments = parser.parse_args()
    if arguments.cache is not None:
        jax.config.update("jax_compilation_cache_dir", arguments.cache)
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    line: dict[str, object] = {"task": arguments.task, "law": arguments.law}
    if arguments.task == "memory":
        line["peak_mib"] = round(_peak(arguments.law))
    else:
        line["seconds"] = round(_first_call(arguments.task, arguments.law), 2)
    print(json.dumps(line))


if __name__ == "__main__":
    main()
