"""Runs of the package: values, forward and reverse derivatives, a batch at a time."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

import impactjax as ij

from .classes import Class, model

ROWS = 128  # of the impact log
DISCRETE = ("count", "stop", "complete")
LOG = tuple(field.name for field in dataclasses.fields(ij.ImpactLog) if field.name not in DISCRETE)
EXTREMES = ("deepest_penetration", "peak_force")  # of each impact
COLUMNS = (*LOG, *EXTREMES)
Outputs = dict[str, Array]


def program(each: Class, tolerance: float, with_derivatives: bool) -> Callable[..., Any]:
    """A compiled function of parameters, times, direction and cotangents, each with a batch axis.

    It returns values, what is not differentiable, derivatives along the direction, and the product
    of the reverse derivative with the direction.
    """

    def values(p: Array, ts: Array) -> tuple[Outputs, Any]:
        whole, start = model(each, p)
        run = ij.simulate(
            whole,
            start,
            ts,
            t0=0.0,
            tolerance=tolerance,
            max_steps=each.steps,
            max_impacts=ROWS,
        )
        log = {name: getattr(run.impacts, name) for name in LOG}
        smooth = {
            "position": run.position,
            "velocity": run.velocity,
            "rests.begin": run.rests.begin,
            "rests.end": run.rests.end,
            "nearest_miss": run.nearest_miss,
            **log,
            **{name: getattr(run, name) for name in EXTREMES},
        }
        rest = {
            "count": run.impacts.count,
            "stop": run.impacts.stop,
            "complete": run.impacts.complete,
            "rests.count": run.rests.count,
            "rests.stop": run.rests.stop,
            "rests.released": run.rests.released,
            "result": run.result._value,
            "steps": run.stats.steps,
        }
        return smooth, rest

    def one(p: Array, ts: Array, direction: Array, cotangents: Outputs) -> tuple[PyTree, ...]:
        if not with_derivatives:
            return values(p, ts)
        smooth, along, rest = jax.linearize(lambda p: values(p, ts), p, has_aux=True)
        (gradient,) = jax.linear_transpose(along, p)(cotangents)
        return smooth, rest, along(direction), jnp.dot(gradient, direction)

    return jax.jit(jax.vmap(one))


def cotangents(rng: np.random.Generator, count: int, samples: int) -> dict[str, np.ndarray]:
    """Random cotangents."""
    shapes = dict.fromkeys(COLUMNS, (ROWS,)) | {
        "position": (samples,),
        "velocity": (samples,),
        "rests.begin": (ROWS,),
        "rests.end": (ROWS,),
        "nearest_miss": (),
    }
    return {name: rng.normal(size=(count, *shape)) for name, shape in shapes.items()}
