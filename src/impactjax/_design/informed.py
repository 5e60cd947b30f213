"""Information of candidates about the parameters of the models, and its sums."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from impactjax._design.candidates import Candidates, Values
from impactjax._design.criterion import scale_of
from impactjax._identify.directions import without
from impactjax._identify.experiment_information import informed_by
from impactjax._identify.information import Information
from impactjax._known import AnyArray, known
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._problem.experiment import Experiment
from impactjax._problem.prior import Normal
from impactjax._refusal import check_kind

Matrices = Float[AnyArray, "models parameters parameters"]


@dataclasses.dataclass
class Informed:
    """Information about the parameters of the models in performances of candidates.

    The parameters of initial state, release and sensor are estimated from the same data. Matrices
    are those of relative errors; for a parameter at zero, of errors in its unit.

    - `models`: the models that are thought possible, in one structure.
    - `length`: number of samples to which all recordings are padded.
    - `scatter`: standard deviation of the logarithm of the speed after each impact [1].
    - `names`, `units`, `positive`, `values`: names of all parameters found up to now, their units,
      whether they cannot be negative, and their values in each model.
    - `found`: information found up to now.
    """

    models: tuple[ImpactOscillator, ...]
    length: int
    scatter: float = 0.0
    names: list[str] = dataclasses.field(default_factory=list)
    units: dict[str, str] = dataclasses.field(default_factory=dict)
    positive: dict[str, bool] = dataclasses.field(default_factory=dict)
    values: list[dict[str, float]] = dataclasses.field(default_factory=list)
    found: dict[object, list[dict[tuple[str, str], float]]] = dataclasses.field(
        default_factory=dict
    )

    def of(self, candidates: Candidates, values: Values) -> Matrices:
        """Information in one performance; NaN if a motion cannot be simulated."""
        key = (id(candidates), *values.items())
        if key not in self.found:
            posed = [recordings(candidates, model, values) for model in self.models]
            self.found[key] = [self._table(i, each) for i, each in enumerate(posed)]
        return self._matrices(self.found[key])

    def check_alike(self, candidates: Candidates, values: Values) -> None:
        """Raises `ValueError` if the models do not have the same parameters."""
        self.of(candidates, values)
        for other in self.values[1:]:
            if other.keys() != self.values[0].keys():
                first, second = (", ".join(each) for each in (self.values[0], other))
                raise ValueError(f"The models have different parameters: {first}; {second}.")

    def of_priors(self, priors: Mapping[str, Normal]) -> Matrices:
        """Prior knowledge, each an observation of one parameter."""
        check_kind("priors", priors, Mapping, "{'length': Normal(0.071, 0.001)}")
        count = len(self.names)
        total = np.zeros((len(self.models), count, count))
        for name, prior in priors.items():
            check_kind("priors", prior, Normal, "Normal(0.071, 0.001)")
            if name not in self.names:
                raise ValueError(
                    f"`priors` speak of `{name}`, which is not fitted; {', '.join(self.names)} are."
                )
            at = self.names.index(name)
            for i, values in enumerate(self.values):
                total[i, at, at] += (scale_of(values[name]) / float(prior.sigma)) ** 2
        return total

    def _table(self, model: int, several: Sequence[Experiment]) -> dict[tuple[str, str], float]:
        """Entries of one model's matrix by two names."""
        told = informed_by([self.padded(each) for each in several], self.scatter)
        own = np.array(told.of_model)
        names = [name for name, asked in zip(told.names, told.of_model, strict=True) if asked]
        self._learn(model, names, told)
        values = np.asarray(known(told.values))[own]
        rows = np.asarray(told.sensitivities / told.scale)
        left = without(rows[:, own], rows[:, ~own]) * [scale_of(float(value)) for value in values]
        square = left.T @ left
        return {(a, b): square[i, j] for i, a in enumerate(names) for j, b in enumerate(names)}

    def padded(self, experiment: Experiment) -> Experiment:
        """An experiment with a recording of the common length, so that all share a program."""
        return dataclasses.replace(experiment, recording=experiment.recording.padded(self.length))

    def _learn(self, model: int, names: list[str], told: Information) -> None:
        while len(self.values) <= model:
            self.values.append({})
        for name in names:
            if name not in self.names:
                self.names.append(name)
            at = told.names.index(name)
            value = float(told.values[at])
            if self.values[model].setdefault(name, value) != value:
                raise ValueError(
                    f"`{name}` is to be found, so that it cannot be chosen: the candidates have "
                    f"it at {self.values[model][name]:.6g} and {value:.6g}."
                )
            self.units[name], self.positive[name] = told.units[at], told.positive[at]

    def _matrices(self, tables: Sequence[Mapping[tuple[str, str], float]]) -> Matrices:
        return np.array(
            [[[t.get((a, b), 0.0) for b in self.names] for a in self.names] for t in tables]
        )


def recordings(candidates: Candidates, model: ImpactOscillator, values: Values) -> list[Experiment]:
    """The recordings of one performance, of one motion."""
    posed = candidates.experiment(model, **values)
    several = [posed] if isinstance(posed, Experiment) else posed
    if not isinstance(several, Sequence) or not several:
        raise TypeError(
            "The function of the candidates must return an Experiment, or several of one motion, "
            f"but it returned {posed!r}."
        )
    for each in several:
        check_kind("experiment", each, Experiment, "Experiment(model, planned(...), initial)")
        if each.priors:
            raise ValueError("Prior knowledge counts once: give it to `design`, as `priors`.")
    return list(several)
