"""Attractors of many motions, from the states that they repeat."""

import numpy as np
from jaxtyping import Bool, Float, Int

NONE = -1  # for a motion that approaches no periodic one

Labels = Int[np.ndarray, " lanes"]


def attractor_of_each(
    rows: Float[np.ndarray, "lanes keep numbers"], periods: Labels, same: float
) -> Labels:
    """The index of the attractor that each motion approaches, the commonest first; −1 for none.

    Two motions approach the same one if they repeat after as many periods, and if their states
    differ by at most `same`, from some period on.
    """
    labels, count = np.full(len(rows), NONE), 0
    for period in np.unique(periods[periods > 0]):
        waiting = np.flatnonzero(periods == period)
        while waiting.size:
            together = _agree(rows[waiting, -period:], rows[waiting[0], -period:], same)
            labels[waiting[together]] = count
            waiting, count = waiting[~together], count + 1
    sizes = np.bincount(labels[labels != NONE], minlength=count)
    order = np.empty(count, int)
    order[np.argsort(-sizes, kind="stable")] = np.arange(count)
    return np.where(labels == NONE, NONE, order[labels]) if count else labels


def _agree(
    rows: Float[np.ndarray, "lanes period numbers"],
    one: Float[np.ndarray, "period numbers"],
    same: float,
) -> Bool[np.ndarray, " lanes"]:
    """True for the rows that are those of one motion, in any phase. A motion agrees with itself."""
    phases = [np.roll(one, shift, axis=0) for shift in range(len(one))]
    return np.any([np.max(np.abs(rows - each), axis=(1, 2)) <= same for each in phases], axis=0)
