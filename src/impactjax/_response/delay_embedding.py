"""Delay embedding: the states of a motion, and its chaos, from a record of one quantity."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._known import AnyArray
from impactjax._refusal import whole
from impactjax._types import Numbers

_FEWEST = 200  # samples
_PER_CELL = 20.0  # pairs of values in a pair of cells, on average
_STRETCHED = 15.0  # a false neighbour's distance grows by more than this factor
_FAR = 2.0  # or to more than this, relative to the size of the motion
_MOST = 4000  # states whose neighbours are looked at
_TRUE = 0.01  # largest share of false neighbours in a sufficient dimension
_BLOCKS = 8  # parts of a record, of which the standard error is that of a mean

Vectors = Float[np.ndarray, "states dimension"]


class DelayEmbedding(NamedTuple):
    """States (x(t), x(t + delay), …) made of a record of x.

    - `vectors`: the states, one for each sample.
    - `delay`: number of samples between two coordinates.
    - `interval`: time between two samples [s].
    - `information`: mutual information [bit] of two values 1, 2, … samples apart.
    - `false_neighbours`: share of false nearest neighbours with 1, 2, … coordinates.
    """

    vectors: Vectors
    delay: int
    interval: float
    information: Float[np.ndarray, " delays"]
    false_neighbours: Float[np.ndarray, " dimensions"]

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return self.vectors.shape[1]


class Divergence(NamedTuple):
    """Mean divergence of neighbouring states.

    - `after`: times [s].
    - `logarithm`: mean logarithm of the distance of states that were nearest neighbours.
    - `exponent`, `error`: its slope, the largest Lyapunov exponent, and its standard error [1/s].
    - `begin`, `end`: times between which that is its slope [s].
    """

    after: Float[np.ndarray, " times"]
    logarithm: Float[np.ndarray, " times"]
    exponent: float
    error: float
    begin: float
    end: float


def delay_embedding(
    values: Numbers,
    interval: float,
    *,
    delay: int | None = None,
    dimension: int | None = None,
    most: int = 8,
) -> DelayEmbedding:
    """Delay embedding of a record.

    The delay is the first minimum of the mutual information of two values, which a histogram of
    cells with equal probabilities on each axis estimates. The dimension is the least one with less
    than 1 % of false nearest neighbours: those that a further coordinate takes apart.

    Source: Fraser and Swinney, Physical Review A 33, 1134 (1986); Kennel, Brown and Abarbanel,
    Physical Review A 45, 3403 (1992).

    **Arguments:**

    - `values`: samples at equal intervals, without gaps.
    - `interval`: time between two samples [s].
    - `delay`: number of samples between two coordinates, instead of the first minimum.
    - `dimension`: number of coordinates, instead of the least sufficient one.
    - `most`: largest dimension to try. Noise keeps neighbours false in any dimension.

    **Raises** `ValueError` for fewer than 200 samples, values that are not finite, a record whose
    information has no minimum within a tenth of it, and a dimension that is not sufficient.
    """
    record = _checked(values, interval)
    most = whole("most", most, 1)
    cells, count = _cells(record)
    lags = range(1, record.size // 10)
    information = np.array([_information(cells[:-k], cells[k:], count) for k in lags])
    lag = (
        _first_minimum(information, cells.size, count)
        if delay is None
        else whole("delay", delay, 1)
    )
    if lag * most >= record.size // 2:
        raise ValueError(
            f"The record has {record.size} samples, too few for {most} coordinates {lag} samples "
            "apart: reduce `most`, or give a longer record."
        )
    false = np.array([_false_share(record, lag, d) for d in range(1, most + 1)])
    enough = np.flatnonzero(false < _TRUE)
    if dimension is None and not enough.size:
        raise ValueError(
            f"With {most} coordinates {false[-1]:.0%} of the nearest neighbours are still false, "
            "perhaps by noise: state the `dimension`, or raise `most`."
        )
    own = int(enough[0]) + 1 if dimension is None else whole("dimension", dimension, 1)
    return DelayEmbedding(_vectors(record, lag, own), lag, interval, information, false)


def divergence(embedding: DelayEmbedding, begin: float, end: float, apart: float) -> Divergence:
    """Divergence of states that are nearest neighbours, and the largest Lyapunov exponent.

    The mean logarithm of their distance grows as exponent · t between the time after which the
    distance has turned into the fastest direction and that at which it is as large as the motion.
    The exponent is the slope between `begin` and `end`; draw the curve to choose them. The error is
    that of a mean over eight parts of the record.

    Source: Rosenstein, Collins and De Luca, Physica D 65, 117 (1993).

    **Arguments:**

    - `embedding`: result of `delay_embedding`.
    - `begin`, `end`: times [s] after which the logarithm has grown in a straight line.
    - `apart`: neighbours are at least this much apart in time [s], such as a period.

    **Raises** `ValueError` for times that do not rise, and a record that is too short for them.
    """
    interval = embedding.interval
    first, last, gap = (round(float(each) / interval) for each in (begin, end, apart))
    if not 0 <= first < last:
        raise ValueError(f"The times must rise, but they are {begin:g} and {end:g} s.")
    states = embedding.vectors
    if len(states) - last < _BLOCKS * max(gap, 1):
        raise ValueError(
            f"The record is too short to follow neighbours {apart:g} s apart for {end:g} s."
        )
    here, there = _neighbours(states[: len(states) - last], gap)
    steps = np.arange(last + 1)
    curves = np.array([_log_distances(states, here + k, there + k) for k in steps]).T
    parts = np.array([np.nanmean(each, axis=0) for each in np.array_split(curves, _BLOCKS)])
    after = steps * interval
    slopes = np.polyfit(after[first:], parts[:, first:].T, 1)[0]
    error = float(np.std(slopes, ddof=1) / np.sqrt(_BLOCKS))
    return Divergence(after, np.mean(parts, axis=0), float(np.mean(slopes)), error, begin, end)


def _checked(values: Numbers, interval: float) -> np.ndarray:
    record = np.asarray(values, float)
    if record.ndim != 1 or record.size < _FEWEST:
        raise ValueError(
            f"Argument `values` must be a list of at least {_FEWEST} samples, but its shape is "
            f"{record.shape}."
        )
    if not np.isfinite(record).all():
        raise ValueError("Argument `values` must be finite, without gaps.")
    if np.ptp(record) == 0:
        raise ValueError("Argument `values` does not change.")
    if not interval > 0:
        raise ValueError(f"Argument `interval` must be above 0 s, but it is {interval}.")
    return record


def _cells(record: np.ndarray) -> tuple[np.ndarray, int]:
    """The number of the cell that each value is in, and the number of cells. All hold about equally
    many values. A pair of cells holds 20 pairs of independent values in the mean.
    """
    count = max(int(np.sqrt(record.size / _PER_CELL)), 2)
    ranks = np.empty(record.size, int)
    ranks[np.argsort(record, kind="stable")] = np.arange(record.size)
    return ranks * count // record.size, count


def _information(first: np.ndarray, second: np.ndarray, count: int) -> float:
    """Mutual information [bit] of values in some of `count` cells."""
    pairs = np.bincount(first * count + second, minlength=count**2).reshape(count, count)
    shares = pairs / first.size
    alone = np.outer(shares.sum(1), shares.sum(0))
    held = shares > 0
    return float(np.sum(shares[held] * np.log2(shares[held] / alone[held])))


def _first_minimum(information: AnyArray, size: int, count: int) -> int:
    """Place of the first minimum that is deeper than what is found of independent values, which is
    (count − 1)² / (2 size ln 2) bit in the mean.
    """
    from scipy.signal import find_peaks  # a second that others can do without

    found, _ = find_peaks(-information, prominence=(count - 1) ** 2 / (2 * size * np.log(2)))
    if not found.size:
        raise ValueError(
            "The mutual information has no minimum within a tenth of the record: state the `delay`."
        )
    return int(found[0]) + 1


def _vectors(record: np.ndarray, lag: int, dimension: int) -> Vectors:
    size = record.size - lag * (dimension - 1)
    return np.stack([record[k * lag : k * lag + size] for k in range(dimension)], axis=1)


def _false_share(record: np.ndarray, lag: int, dimension: int) -> float:
    """Share of nearest neighbours that one more coordinate takes apart."""
    longer = _vectors(record, lag, dimension + 1)
    states, further = longer[:, :-1], longer[:, -1]
    here, there = _neighbours(states, lag)
    near = np.linalg.norm(states[here] - states[there], axis=1)
    beyond = np.abs(further[here] - further[there])
    size = np.std(record)
    apart = beyond > _STRETCHED * near
    apart = apart & (near > 0) | (np.hypot(near, beyond) > _FAR * size)
    return float(np.mean(apart))


def _neighbours(states: Vectors, gap: int) -> tuple[np.ndarray, np.ndarray]:
    """Some states, spread over the record, and the nearest one of each that is more than `gap`
    samples away.
    """
    from scipy.spatial import KDTree  # a tenth of a second that others can do without

    here = np.unique(np.linspace(0, len(states) - 1, _MOST).astype(int))
    asked = min(2 * gap + 2, len(states))
    _, near = KDTree(states).query(states[here], k=asked)
    near = np.asarray(near)
    far = np.abs(near - here[:, None]) > gap
    first = np.argmax(far, axis=1)
    found = far[np.arange(here.size), first]
    return here[found], near[np.arange(here.size), first][found]


def _log_distances(states: Vectors, here: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Logarithms of distances; NaN for states that are equal."""
    distances = np.linalg.norm(states[here] - states[there], axis=1)
    return np.log(np.where(distances > 0, distances, np.nan))
