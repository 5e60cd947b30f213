"""The runs of a class with their verdicts."""

from collections.abc import Iterator

import jax
import numpy as np
from jaxtyping import PyTree

from impactjax import RESULTS

from .classes import CLASSES, Draw, draw
from .compare import Ours, Verdict, compare
from .package import cotangents, program
from .reference import motions

BATCH = 50  # runs of one call: their reverse derivatives take up to 90 MB each


def _result_names() -> dict[int, str]:
    return {int(getattr(RESULTS, name)._value): name for name in RESULTS._name_to_item}


def campaign(
    name: str, runs: int, seed: int, tolerance: float, *, values_only: bool = False
) -> Iterator[tuple[Draw, Verdict]]:
    """The runs of a class with their verdicts, one after the other."""
    each = CLASSES[name]
    rng = np.random.default_rng([seed, *name.encode()])
    run = program(each, tolerance, not values_only)
    names = _result_names()
    for first in range(0, runs, BATCH):
        draws = [draw(each, rng) for _ in range(min(BATCH, runs))]
        p, ts, directions = (np.array(column) for column in list(zip(*draws, strict=True))[:3])
        w = cotangents(rng, len(draws), ts.shape[1])
        output = jax.tree.map(np.asarray, run(p, ts, directions, w))
        for lane, drawn in enumerate(draws[: runs - first]):
            ours = _lane(output, w, lane)
            code = names[int(ours.rest["result"])]
            verdict = compare(each, drawn, motions(each, drawn, rng), ours, code, tolerance)
            yield drawn, verdict


def _lane(output: tuple[PyTree, ...], w: dict[str, np.ndarray], lane: int) -> Ours:
    values, rest = ({k: v[lane] for k, v in part.items()} for part in output[:2])
    if len(output) == 2:
        return Ours(values, rest, None, 0.0)
    slopes = {k: v[lane] for k, v in output[2].items()}
    terms = np.concatenate([np.ravel(w[k][lane] * slopes[k]) for k in slopes])
    size = np.sum(np.abs(terms)) + 1e-300
    return Ours(values, rest, slopes, float(abs(terms.sum() - output[3][lane]) / size))
