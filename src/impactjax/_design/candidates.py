"""Experiments to choose from."""

import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from impactjax._problem.experiment import Experiment
from impactjax._refusal import as_names, check_kind, check_number, check_takes

Values = Mapping[str, float]
Posed = Experiment | Sequence[Experiment]

PERFORMANCES = "performances"  # a resource of which each performance takes one

_STEPS = {1: 9, 2: 5}  # values of each range, if one or two are varied together
_POINTS = 32  # points, if more are


@dataclasses.dataclass(frozen=True)
class Between:
    """A number that may be chosen freely in a range.

    **Raises** `ValueError` if the limits do not rise or are not finite.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        check_number("low", self.low)
        check_number("high", self.high)
        if not -math.inf < self.low < self.high < math.inf:
            raise ValueError(f"A range must rise, but its limits are {self.low} and {self.high}.")


def _nothing(**choices: float) -> dict[str, float]:
    """The cost of an experiment that takes no resource."""
    del choices
    return {}


@dataclasses.dataclass(frozen=True)
class Candidates:
    """Experiments of one kind, from which some are chosen.

    - `experiment`: function of a model and of the choices by name. It returns an experiment with a
      planned recording, or several experiments: recordings of one motion by several sensors.
    - `choices`: for each name a range, `Between(0.2, 1.2)`, or a list of values.
    - `cost`: function of the choices by name: the amount of each resource that one performance
      takes, such as `{"s": 60.0}`. One of the resource "performances" is always taken, and no
      other number of them.
    - `name`: name in the result.
    """

    experiment: Callable[..., Posed]
    choices: Mapping[str, Between | Sequence[float]] = dataclasses.field(default_factory=dict)
    cost: Callable[..., Mapping[str, float]] = _nothing
    name: str = "experiment"

    def __post_init__(self) -> None:
        check_kind("choices", self.choices, Mapping, "{'theta0': Between(0.2, 1.2)}")
        names = as_names("choices", [*self.choices])
        check_takes("experiment", self.experiment, names, None)
        check_takes("cost", self.cost, names)
        for name, each in self.choices.items():
            listed = isinstance(each, Sequence | np.ndarray) and not isinstance(each, str)
            if not isinstance(each, Between) and not (listed and len(each)):
                raise ValueError(f"Choice `{name}` needs a range, Between(a, b), or some values.")
            for value in [] if isinstance(each, Between) else each:
                check_number(name, value)

    @property
    def ranges(self) -> dict[str, Between]:
        """The choices that are continuous."""
        return {name: each for name, each in self.choices.items() if isinstance(each, Between)}

    def points(self) -> list[dict[str, float]]:
        """Points that cover the choices, each a value by name."""
        lists = {n: each for n, each in self.choices.items() if not isinstance(each, Between)}
        rows = [dict(zip(lists, each, strict=True)) for each in itertools.product(*lists.values())]
        return [
            {name: {**row, **own}[name] for name in self.choices}
            for row in rows
            for own in _covering(self.ranges)
        ]

    def costs(self, values: Values) -> dict[str, float]:
        """The amount of each resource that one performance takes."""
        given = self.cost(**values)
        if not isinstance(given, Mapping):
            raise TypeError(f"Argument `cost` must return a table, but it returns {given!r}.")
        found = {name: _amount(name, each) for name, each in given.items()}
        for name, each in found.items():
            if not 0 <= each < math.inf:
                raise ValueError(f"The cost `{name}` must be a number from 0 on, but is {each}.")
        if found.get(PERFORMANCES, 1.0) != 1:
            raise ValueError(
                f"Each performance takes one of the `{PERFORMANCES}`, but the cost says "
                f"{found[PERFORMANCES]:g}: call the resource by another name."
            )
        return {PERFORMANCES: 1.0} | found


def _amount(name: str, given: object) -> float:
    check_number(name, given)
    return float(np.asarray(given))


def _covering(ranges: Mapping[str, Between]) -> list[dict[str, float]]:
    """Points that cover some ranges: a grid of one or two, a Sobol sequence of more."""
    low = np.array([each.low for each in ranges.values()])
    high = np.array([each.high for each in ranges.values()])
    if len(ranges) in _STEPS:
        axis = np.linspace(0.0, 1.0, _STEPS[len(ranges)])
        unit = np.array(list(itertools.product(axis, repeat=len(ranges))))
    elif ranges:
        from scipy.stats import qmc

        unit = qmc.Sobol(len(ranges), scramble=False).random(_POINTS)
    else:
        return [{}]
    return [dict(zip(ranges, row, strict=True)) for row in (low + (high - low) * unit).tolist()]
