"""Compilation of a function to one kernel on a CPU."""

from collections.abc import Callable
from typing import TypeVar

import jax
from jax.experimental.xla_metadata import set_xla_metadata

Argument = TypeVar("Argument")
Result = TypeVar("Result")


def one_kernel(function: Callable[[Argument], Result]) -> Callable[[Argument], Result]:
    """The function, compiled on a CPU to one kernel instead of hundreds. For a computation with a
    few numbers this takes two thirds of the time to compile, and less to run.
    """
    if jax.default_backend() != "cpu":
        return function

    def within(argument: Argument) -> Result:
        with set_xla_metadata(xla_cpu_small_call=None, inlineable=None):  # unmarks inner calls
            return function(argument)

    def marked(argument: Argument) -> Result:
        with set_xla_metadata(xla_cpu_small_call="true", inlineable="false"):
            return jax.jit(within)(argument)

    return marked
