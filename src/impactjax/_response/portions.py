"""Many motions on all processors of a computer."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import jax
import numpy as np
from jaxtyping import PyTree

from impactjax._known import is_known
from impactjax._terminal import telling

T = TypeVar("T")
Common = TypeVar("Common")

_PORTION = 100  # motions: few enough to share out evenly, and to see how far the work is


def in_portions(program: Callable[[Common, PyTree], T], common: Common, lanes: PyTree) -> T:
    """The results of a compiled program for all lanes, which it gets in portions, with progress.

    As many portions run at a time as there are processors. All go into one call where numbers are
    still unknown, as under `jit`.
    """
    count = len(jax.tree.leaves(lanes)[0])
    if count <= _PORTION or not is_known((common, lanes)):
        return program(common, lanes)
    double = jax.numpy.result_type(float) == np.float64
    places = np.minimum(np.arange(-(-count // _PORTION) * _PORTION), count - 1)

    def portion(some: np.ndarray) -> T:
        with jax.enable_x64(double):  # holds for one thread
            own = jax.tree.map(lambda leaf: leaf[some], lanes)
            return jax.block_until_ready(program(common, own))

    found = []
    with ThreadPoolExecutor(os.cpu_count()) as pool, telling("Motions") as tell:
        try:
            for each in pool.map(portion, places.reshape(-1, _PORTION)):
                found.append(each)
                tell(f"{min(len(found) * _PORTION, count)} of {count}")
        finally:
            pool.shutdown(cancel_futures=True)  # after an interruption too
    return jax.tree.map(lambda *leaves: jax.numpy.concatenate(leaves)[:count], *found)
