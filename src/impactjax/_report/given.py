"""Assumptions of a fit in words and numbers, for table, page and `fit.json`."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from impactjax._compare.comparison import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._number_format import interval, with_error, with_unit
from impactjax._problem.assumptions import Assumption, Rest, assumptions, given_words, rests
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem
from impactjax._sensor.low_pass import AbstractLowPass, Butterworth, Resonance


class OwnValue(NamedTuple):
    """A value divided by the assumed ones to which it is proportional, so that it does not depend
    on them.

    - `name`: the quotient or product as text, "alpha·length".
    - `value`, `error`, `unit`: value, standard error and unit.
    - `shown`: the value with its error as text, or a bound.
    """

    name: str
    value: float
    error: float
    unit: str
    shown: str


class Given(NamedTuple):
    """Assumptions of a fit.

    - `assumed`: assumptions that the user did not state.
    - `rests`: dependences of fitted values on them, by parameter.
    - `own`: values that do not depend on them, by parameter.
    """

    assumed: list[Assumption]
    rests: dict[str, Rest]
    own: dict[str, OwnValue]

    def words(self, name: str) -> str:
        """Words after the verdict on a parameter: ", given length"; empty without assumptions."""
        return given_words(self.rests.get(name))


def given(fitted: Fitted) -> Given:
    """The assumptions of a fit."""
    estimate = fitted.estimate
    assumed, found = _at(estimate, np.asarray(estimate.values), fitted.stated)
    own = _own_values(estimate, fitted.stated, found) if found else {}
    return Given(assumed, found, own)


def given_sentences(fitted: Fitted) -> list[str]:
    """Sentences on the values that depend on assumptions, and on the values without them."""
    known = given(fitted)
    found = []
    for on in dict.fromkeys(rest.on for rest in known.rests.values()):
        names = [name for name, rest in known.rests.items() if rest.on == on]
        what = " and ".join(each.sentence for each in known.assumed if each.name in on)
        keys = " and ".join(f"`{name}`" for name in on)
        said = f"{listed(names)} {'rest' if len(names) > 1 else 'rests'} on {what}; state {keys}"
        own = [known.own[name] for name in names if name in known.own]
        told = ", ".join(f"{each.name}: {with_unit(each.shown, each.unit)}" for each in own)
        found.append(f"{said} to be sure." + (f" The record itself tells {told}." if own else ""))
    return found


def taken(fitted: Fitted) -> list[str]:
    """Sentences on all assumptions of a fit: lengths, masses, positions, exponents, the sensor."""
    known, system, stated = given(fitted), fitted.estimate.system, fitted.stated
    found = []
    for each in known.assumed:
        names = [name for name, rest in known.rests.items() if each.name in rest.on]
        found.append(f"{each.sentence}. On it rests: {listed(names) if names else 'no value'}.")
    fixed = {
        name: with_unit(
            f"{name} = {float(np.asarray(handle.get(system))):.4g}", handle.allowed.unit
        )
        for name, handle in handles(system).items()
        if name not in {*fitted.estimate.names, *stated, *(each.name for each in known.assumed)}
    }
    places = handles(system)
    for name, said in fixed.items():
        if places[name].path[0] == "model":
            found.append(f"{said} (neither fitted nor stated).")
    sensor = [said for name, said in fixed.items() if places[name].path[0] == "sensor"]
    found.append(f"Of the sensor: {', '.join([*sensor, _low_pass(system.sensor.low_pass)])}.")
    return found


def _low_pass(stated: AbstractLowPass | None) -> str:
    if isinstance(stated, Butterworth):
        return f"a Butterworth low-pass of order {stated.order}"
    if isinstance(stated, Resonance):
        return "a resonance of the instrument"
    return "no low-pass" if stated is None else "the low-pass that was measured"


def is_assumed(fitted: Fitted, name: str) -> bool:
    """True if a model parameter that was not fitted has a value that the user did not state."""
    path = handles(fitted.estimate.system)[name].path
    return name not in fitted.stated and path[0] == "model"


def speeds_rest_on(known: Given) -> str:
    """The assumptions behind speeds in m/s and depths, in words; empty if there are none."""
    return " and ".join(each.sentence for each in known.assumed if each.unit in ("m", "m/s²"))


def listed(names: list[str]) -> str:
    """Names as in a sentence: "a, b and c"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _at(
    estimate: Estimate[Problem], values: np.ndarray, stated: tuple[str, ...]
) -> tuple[list[Assumption], dict[str, Rest]]:
    system = estimate.problem.system_with(jnp.asarray(values))
    assumed = assumptions(system, estimate.names, stated)
    return assumed, rests(system, estimate.problem.recording, estimate.names, assumed)


def _own_values(
    estimate: Estimate[Problem], stated: tuple[str, ...], found: dict[str, Rest]
) -> dict[str, OwnValue]:
    """Values divided by the assumed ones to which they are proportional, with errors by the delta
    method, since an assumed lever may depend on a fitted frequency.
    """
    names = [name for name, rest in found.items() if rest.powers is not None]
    values = np.asarray(estimate.values, float)

    def factors(values: np.ndarray) -> np.ndarray:
        assumed, own = _at(estimate, values, stated)
        sizes = {each.name: each.value for each in assumed}
        powers = [own[name].powers or {} for name in names]
        return np.array([math.prod(sizes[a] ** -e for a, e in each.items()) for each in powers])

    if not names:
        return {}
    at = np.array([estimate.names.index(name) for name in names])
    factor = factors(values)
    slopes = np.zeros((len(names), len(values)))
    for j, step in enumerate(_steps(estimate)):
        move = step * np.eye(len(values))[j]
        slopes[:, j] = (factors(values + move) - factors(values - move)) / (2 * step)
    slopes *= values[at][:, None]
    slopes[np.arange(len(names)), at] += factor
    covariance = np.asarray(estimate.covariance)
    return {
        name: _own_value(estimate, name, found[name], factor[i], slopes[i], covariance)
        for i, name in enumerate(names)
    }


def _steps(estimate: Estimate[Problem]) -> np.ndarray:
    """Steps of the parameters for central differences."""
    values = np.asarray(estimate.values)
    share = float(np.cbrt(np.finfo(values.dtype).eps))
    return np.where(values == 0, share, share * np.abs(values)).astype(float)


def _own_value(
    estimate: Estimate[Problem],
    name: str,
    rest: Rest,
    factor: float,
    slopes: np.ndarray,
    covariance: np.ndarray,
) -> OwnValue:
    i = estimate.names.index(name)
    value = float(estimate.values[i]) * factor
    felt = slopes != 0
    error = float(np.sqrt(slopes[felt] @ covariance[np.ix_(felt, felt)] @ slopes[felt]))
    if "±" in estimate.quoted(name):
        shown = with_error(value, error)
    else:
        low, high = (float(end) * factor for end in (estimate.low[i], estimate.high[i]))
        shown = interval(low, high, error)
    return OwnValue(rest.own_name(name), value, error, rest.unit, shown)
