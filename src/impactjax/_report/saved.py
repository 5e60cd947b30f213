"""Estimates saved to files."""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._fit.scatter_found import Scatter
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem
from impactjax._problem.scatter import NormalScatter, NoScatter
from impactjax._simulate.impact_log import ImpactLog

_LOG, _SCATTER = "impacts.", "scatter."


def save(path: str | Path, estimate: Estimate[Problem]) -> None:
    """Writes the numbers of an estimate, or of many under `vmap`, to a NumPy `.npz` file.

    The experiment is code and is not written; `load` needs it as an argument.

    **Raises** `ValueError` for an estimate of several recordings.
    """
    if not isinstance(estimate.problem, Problem):
        raise ValueError(
            "An estimate is saved if `fit` has fitted one recording: of several, save one, "
            "`of_experiment(...)`."
        )
    arrays = {name: getattr(estimate, name) for name in _numbers()}
    arrays |= {_LOG + name: getattr(estimate.impacts, name) for name in _columns(ImpactLog)}
    if estimate.scatter is not None:
        scatter = estimate.scatter
        arrays |= {_SCATTER + name: getattr(scatter, name) for name in _columns(Scatter)}
    arrays |= _recorded(estimate.problem)
    content: dict[str, Any] = {name: np.asarray(x) for name, x in arrays.items()}
    with Path(path).open("wb") as file:
        np.savez(file, names=np.array(estimate.names), **content)


def load(path: str | Path, experiment: Experiment) -> Estimate[Problem]:
    """An estimate from a file that `save` wrote.

    **Arguments:**

    - `path`: path of the file.
    - `experiment`: experiment that was fitted.

    Scatter from impact to impact is part of it if the file has it: a comparison may have added it.

    **Raises** `ValueError` for a file with other parameters, of another recording, or with scatter
    where the experiment excludes it, or without where the experiment has it.
    """
    problem = build_problem(experiment)
    with np.load(Path(path), allow_pickle=False) as file:
        names = tuple(str(name) for name in file["names"])
        if names != problem.names:
            raise ValueError(
                f"{path} holds {', '.join(names)}, but the experiment fits "
                f"{', '.join(problem.names)}."
            )
        numbers = {name: jnp.asarray(file[name]) for name in _numbers()}
        log = ImpactLog(**{name: jnp.asarray(file[_LOG + name]) for name in _columns(ImpactLog)})
        scatter = None
        if _SCATTER + "size" in file:
            scatter = Scatter(
                **{name: jnp.asarray(file[_SCATTER + name]) for name in _columns(Scatter)}
            )
        if experiment.scatter is not None and problem.scatter.scatters != (scatter is not None):
            has = "no scatter" if scatter is None else "scatter"
            raise ValueError(f"{path} has {has} from impact to impact, unlike the experiment.")
        problem = dataclasses.replace(
            problem, scatter=NoScatter() if scatter is None else NormalScatter()
        )
        for name, own in _recorded(problem).items():
            if not np.array_equal(file[name], own, equal_nan=True):
                raise ValueError(f"{path} is of another recording than that of the experiment.")
    return Estimate(problem=problem, impacts=log, scatter=scatter, **numbers)


def _recorded(problem: Problem) -> dict[str, np.ndarray]:
    """The arrays of a recording."""
    leaves = jax.tree.leaves(problem.recording)
    return {f"recording.{i}": np.asarray(leaf) for i, leaf in enumerate(leaves)}


def _numbers() -> list[str]:
    fields = (field.name for field in dataclasses.fields(Estimate))
    return [name for name in fields if name not in ("problem", "impacts", "scatter")]


def _columns(kind: type[ImpactLog] | type[Scatter]) -> list[str]:
    return [field.name for field in dataclasses.fields(kind)]
