"""Detection of false and missed impacts in a list of times, by dynamic programming."""

import math
from typing import NamedTuple

import numpy as np

_MOST_MISSED, _MOST_FALSE = 3, 3  # largest numbers in a row
_PENALTY = 30.0  # cost of a missed or false time, in squared deviations
_LEAST_SPREAD, _LARGEST_SPREAD = 0.05, 0.2  # of the logarithm of successive flights' ratios
_QUARTILE = 0.3186  # first quartile of |x| for a standard normal x
_LARGEST = 0.1  # largest logarithm of a ratio: flights do not get longer
_RATES = 7  # number of ratios tried
_LEAST_TIMES = 6


class Heard(NamedTuple):
    """A complete list of impacts.

    - `times`: times of all impacts; estimates for missed ones [s].
    - `valid`: mask of the impacts that were heard.
    - `false`: times in the list that are not impacts [s].
    """

    times: np.ndarray
    valid: np.ndarray
    false: np.ndarray


class _Flight(NamedTuple):
    """A stretch of the list between two times taken as impacts: `flights` flights, with
    `flights` − 1 missed impacts between them, and the times from `begin` to `end` false.
    """

    begin: int
    end: int
    flights: int


def heard(times: np.ndarray) -> Heard:
    """The complete list of impacts, inferred from a list of times by the durations of the flights.

    The flights of a ball get shorter by a factor r that changes slowly. Dynamic programming over
    all ways to drop false times and insert missed impacts minimises

        Σ (log(ratio of successive flights / r) / spread)² + 30 × (dropped + inserted impacts).

    r and the spread are estimated where the ratios are densest, so that a third of them may be
    wrong.
    """
    everything = Heard(times, np.ones(len(times), bool), np.zeros(0))
    if len(times) < _LEAST_TIMES:
        return everything
    logs = np.diff(np.log(np.diff(times)))
    likely = logs[logs < _LARGEST]
    if not likely.size:  # not like a bouncing ball
        return everything
    rates = np.unique(np.quantile(likely, np.linspace(0.1, 0.9, _RATES)))
    quartiles = np.quantile(np.abs(logs[:, None] - rates), 0.25, axis=0)
    spread = max(float(quartiles.min()) / _QUARTILE, _LEAST_SPREAD)
    if spread > _LARGEST_SPREAD:
        return everything
    chains = [(*_best(times, math.exp(rate), spread), math.exp(rate)) for rate in rates.tolist()]
    _, chain, r = min(chains, key=lambda each: each[0])
    return _filled(times, chain, r)


def _best(times: np.ndarray, r: float, spread: float) -> tuple[float, list[_Flight]]:
    """The least cost, and the chain of stretches that has it.

    The cost of a chain that ends with the stretch f = (b, e, m) of m flights is

        C(f) = 30 (m − 1 + e − b − 1) + min(30 b, min over g ending at b of C(g) + d(g, f)²),

    with d(g, f) = log(first flight of f / (r × last flight of g)) / spread. The first choice of the
    minimum starts the chain with f and drops the b times before it. At the end the times after the
    last stretch are dropped, at 30 each.

    Example: in the list 0, 1, 1.9, 3.439 with r = 0.9 the stretch from 1.9 to 3.439 is best
    explained by two flights of 0.81 and 0.729, so that an impact at 2.71 was missed.
    """
    count = len(times)
    costs: dict[_Flight, float] = {}
    before: dict[_Flight, _Flight] = {}
    ending: list[list[_Flight]] = [[] for _ in times]
    for end in range(1, count):
        for begin in range(max(end - 1 - _MOST_FALSE, 0), end):
            for flights in range(1, _MOST_MISSED + 2):
                flight = _Flight(begin, end, flights)
                own = _PENALTY * (flights - 1 + end - begin - 1)
                choices: list[tuple[float, _Flight | None]] = [(_PENALTY * begin, None)]
                for last in ending[begin]:
                    expected = r * _first(times, last, r) * r ** (last.flights - 1)
                    deviation = math.log(_first(times, flight, r) / expected) / spread
                    choices.append((costs[last] + deviation**2, last))
                cost, last = min(choices, key=lambda choice: choice[0])
                costs[flight] = own + cost
                if last is not None:
                    before[flight] = last
                ending[end].append(flight)
    for flight in costs:
        costs[flight] += _PENALTY * (count - 1 - flight.end)
    chain = [min(costs, key=lambda flight: costs[flight])]
    least = costs[chain[0]]
    while chain[0] in before:
        chain.insert(0, before[chain[0]])
    return least, chain


def _first(times: np.ndarray, flight: _Flight, r: float) -> float:
    """Duration of the first flight of a stretch, whose flights shorten by the factor r."""
    whole = sum(r**i for i in range(flight.flights))
    return float(times[flight.end] - times[flight.begin]) / whole


def _filled(times: np.ndarray, chain: list[_Flight], r: float) -> Heard:
    found, valid = [float(times[chain[0].begin])], [True]
    for flight in chain:
        duration = _first(times, flight, r)
        for _ in range(flight.flights - 1):
            found.append(found[-1] + duration)
            valid.append(False)
            duration *= r
        found.append(float(times[flight.end]))
        valid.append(True)
    false = np.setdiff1d(times, np.array(found)[valid])
    return Heard(np.array(found), np.array(valid), false)
