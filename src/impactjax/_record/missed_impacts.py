"""Which of the times in a list are impacts, and which impacts are missing from it."""

import math
from typing import NamedTuple

import numpy as np

_MOST_MISSED, _MOST_FALSE = 3, 3  # in a row
_PENALTY = 30.0  # of a missed or false time, in squared deviations
_LEAST_SPREAD, _LARGEST_SPREAD = 0.05, 0.2  # of the logarithm of successive flights' ratios
_QUARTILE = 0.3186  # of the size of a normal deviation
_LARGEST = 0.1  # logarithm of the ratio: flights do not get longer
_RATES = 7  # ratios that are tried
_LEAST_TIMES = 6


class Heard(NamedTuple):
    """A list of impacts without holes.

    - `times`: of all impacts; estimates where they were missed [s].
    - `valid`: which of them were heard.
    - `false`: times in the list that are no impacts [s].
    """

    times: np.ndarray
    valid: np.ndarray
    false: np.ndarray


class _Flight(NamedTuple):
    """From one time of the list to another, with impacts between that were missed."""

    begin: int
    end: int
    flights: int


def heard(times: np.ndarray) -> Heard:
    """The impacts behind a list of times, judged by the durations of the flights alone.

    A flight of a ball takes r times as long as the one before, with an r that changes slowly. Of
    all ways to leave times out as false and to fill impacts in as missed, the one is chosen whose
    squared deviations from that, each in units of the usual spread, and whose corrections, at 30
    each, sum up to the least (by dynamic programming). The usual ratio and its spread are those
    around which the ratios crowd, so that a third of them may be wrong.
    """
    everything = Heard(times, np.ones(len(times), bool), np.zeros(0))
    if len(times) < _LEAST_TIMES:
        return everything
    logs = np.diff(np.log(np.diff(times)))
    likely = logs[logs < _LARGEST]
    if not likely.size:  # nothing like a bouncing ball
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
    """The least cost, and the chain of flights that has it."""
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
    """Duration of the first of the flights."""
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
