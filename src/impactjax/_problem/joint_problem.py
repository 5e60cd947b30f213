"""The least-squares problem of several recordings, whose systems share parameters."""

from collections.abc import Sequence
from typing import NoReturn

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Key

from impactjax._known import AnyArray, namespace
from impactjax._optimise.linearisation import Matrix, Vector
from impactjax._parameter import plain
from impactjax._problem.abstract_problem import AbstractProblem, Answer, Assumed, Number
from impactjax._problem.loss import AbstractLoss, Residuals
from impactjax._problem.noise import AbstractNoise, Jacobian, Scores
from impactjax._problem.parameters import Handle
from impactjax._problem.prior import Normal
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import Valid
from impactjax._simulate.impact_log import ImpactLog
from impactjax._types import Flag, Scalar


class JointProblem(AbstractProblem):
    """Residuals of several problems, each divided by its noise, and those of prior knowledge.

    - `problems`: the problems, each with its own names.
    - `places`: for each problem, the indices of its parameters among the joint `names`.
    - `sizes`: standard deviation of each problem's noise, in its recording's SI unit.
    - `priors`, `asked`: prior distributions, and the indices of their parameters.
    """

    problems: tuple[Problem, ...]
    sizes: tuple[Number, ...]
    priors: tuple[Normal, ...]
    names: tuple[str, ...] = eqx.field(static=True)
    places: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    asked: tuple[int, ...] = eqx.field(static=True)

    @property
    def recording(self) -> NoReturn:
        """Raises `ValueError`, since there are several."""
        raise _several()

    @property
    def system(self) -> NoReturn:
        """Raises `ValueError`, since there are several."""
        raise _several()

    def system_with(self, values: Vector) -> NoReturn:
        """Raises `ValueError`, since there are several."""
        del values
        raise _several()

    def assumed(self) -> Assumed:
        """The assumptions of each problem; residuals of priors are independent and normal."""
        losses = tuple(each.loss for each in self.problems)
        noises = tuple(each.noise for each in self.problems)
        counts = tuple(each.observations for each in self.problems)
        return Assumed(
            _JointLoss(losses, self.sizes, self._lengths),
            _JointNoise(noises, counts, self._lengths),
        )

    @property
    def _lengths(self) -> tuple[int, ...]:
        return tuple(each.valid.shape[-1] for each in self.problems)

    def each_recording(self) -> list[tuple[Problem, tuple[int, ...]]]:
        return list(zip(self.problems, self.places, strict=True))

    def handles(self) -> dict[str, Handle]:
        found: dict[str, Handle] = {}
        for problem, places in zip(self.problems, self.places, strict=True):
            for place, handle in zip(places, problem.handles().values(), strict=True):
                found[self.names[place]] = handle
        return {name: found[name] for name in self.names}

    @property
    def valid(self) -> Valid:
        parts = [*(plain(each.valid) for each in self.problems), np.ones(len(self.priors), bool)]
        return namespace(*parts).concatenate(parts)

    def first(self, share: float) -> Valid:
        known = np.ones(len(self.priors), bool)
        parts = [each.first(share) for each in self.problems]
        return namespace(*parts).concatenate([*parts, known])

    def variance(self) -> Number | None:
        return np.ones(()) if self.sizes_found == 0 else None

    def is_classical(self) -> bool:
        return all(each.is_classical() for each in self.problems)

    def shifted(self, rows: Float[Array, " observations"]) -> "JointProblem":
        """The problem with rows subtracted from the recordings and from the means of the priors."""
        *parts, known = _blocks(rows, self._lengths)
        problems = [
            each.shifted(part * size)
            for each, part, size in zip(self.problems, parts, self.sizes, strict=True)
        ]
        priors = [
            Normal(each.mean - each.sigma * known[i], each.sigma)
            for i, each in enumerate(self.priors)
        ]
        return eqx.tree_at(
            lambda each: (each.problems, each.priors), self, (tuple(problems), tuple(priors))
        )

    def known_before(self) -> dict[str, Normal]:
        return {self.names[i]: prior for i, prior in zip(self.asked, self.priors, strict=True)}

    def misfit(self, residuals: Float[AnyArray, " observations"]) -> Number:
        """The largest misfit of all recordings."""
        each = [problem.misfit(self.share(i, residuals)) for i, problem in enumerate(self.problems)]
        xp = namespace(each)
        return xp.max(xp.stack(each))

    def exceeds_noise(
        self, residuals: Float[AnyArray, " observations"], impacts: ImpactLog
    ) -> Bool[AnyArray, ""]:
        """True if those of one recording do."""
        logs = [jax.tree.map(lambda x, i=i: x[i], impacts) for i in range(len(self.problems))]
        each = [
            problem.exceeds_noise(self.share(i, residuals), log)
            for i, (problem, log) in enumerate(zip(self.problems, logs, strict=True))
        ]
        xp = namespace(each)
        return xp.any(xp.stack(each))

    @property
    def log_units(self) -> Number:
        each = [
            problem.observations.astype(size.dtype) * namespace(size).log(size)
            for problem, size in zip(self.problems, self.sizes, strict=True)
        ]
        return sum(each, np.zeros(()))

    @property
    def sizes_found(self) -> int:
        return sum(each.sizes_found for each in self.problems)

    def density_variance(self, most_likely: Scalar) -> Scalar:
        """One: residuals and prior knowledge are in units of their standard deviations."""
        return jnp.ones_like(most_likely)

    def starting_values(self) -> list[Scalar]:
        found: dict[int, Scalar] = {}
        for problem, places in zip(self.problems, self.places, strict=True):
            for place, value in zip(places, problem.starting_values(), strict=True):
                found.setdefault(place, value)
        return [found[place] for place in range(len(self.names))]

    def residuals(self, values: Vector) -> Residuals:
        rows = [
            problem.residuals(values[jnp.array(own)]) / size
            for problem, own, size in zip(self.problems, self.places, self.sizes, strict=True)
        ]
        known = [
            ((values[index] - prior.mean) / prior.sigma)[None]
            for prior, index in zip(self.priors, self.asked, strict=True)
        ]
        return jnp.concatenate([*rows, *known])

    def answer(self, values: Vector, logged: Flag | None = None) -> Answer:
        """Residuals and Jacobian of all problems. Impact logs are padded to the same length."""
        each = [values[jnp.array(own)] for own in self.places]
        return self.joined(values, _answers(self.problems, each, logged))

    def joined(self, values: Vector, answers: Sequence[Answer]) -> Answer:
        """The answer of all problems, from that of each."""
        xp, dtype = namespace(values, *answers), values.dtype
        count, rows, columns = len(self.names), [], []
        for answer, places, size in zip(answers, self.places, self.sizes, strict=True):
            assert answer.jacobian is not None
            own = xp.asarray(np.eye(count)[list(places)], dtype)
            rows.append(answer.residuals / size)
            columns.append(answer.jacobian @ own / size)
        for prior, index in zip(self.priors, self.asked, strict=True):
            rows.append(((values[index] - prior.mean) / prior.sigma)[None])
            columns.append(xp.asarray(np.eye(count)[[index]], dtype) / prior.sigma)
        logs = _stacked([answer.impacts for answer in answers])
        return Answer(xp.concatenate(rows), logs, xp.concatenate(columns))

    def share(self, index: int, rows: Float[AnyArray, "observations ..."]) -> AnyArray:
        return _blocks(rows, self._lengths)[index] * self.sizes[index]


def _several() -> ValueError:
    return ValueError(
        "This estimate is of several recordings: take that of one of them, by "
        "`of_experiment(estimate, index)`."
    )


class _JointLoss(AbstractLoss):
    losses: tuple[AbstractLoss, ...]
    sizes: tuple[Number, ...]
    lengths: tuple[int, ...] = eqx.field(static=True)

    def cost(self, residuals: Residuals) -> Residuals:
        *own, known = _blocks(residuals, self.lengths)
        costs = [
            loss.cost(block * size) / size**2
            for loss, size, block in zip(self.losses, self.sizes, own, strict=True)
        ]
        return namespace(known, costs).concatenate([*costs, known**2 / 2])


class _JointNoise(AbstractNoise):
    noises: tuple[AbstractNoise, ...]
    counts: tuple[Int[AnyArray, ""], ...]
    lengths: tuple[int, ...] = eqx.field(static=True)

    def order(self, scores: Scores, count: Number) -> Int[AnyArray, ""]:
        del count
        own = _blocks(scores, self.lengths)
        each = [
            noise.order(block, n.astype(scores.dtype))
            for noise, n, block in zip(self.noises, self.counts, own, strict=False)
        ]
        xp = namespace(each)
        return xp.max(xp.stack(each))

    def lasts(self, scores: Scores, count: Number) -> Bool[AnyArray, ""]:
        del count
        lasting = [
            noise.lasts(block, n.astype(scores.dtype))
            for noise, n, block in zip(
                self.noises, self.counts, _blocks(scores, self.lengths), strict=False
            )
        ]
        xp = namespace(lasting)
        return xp.any(xp.stack(lasting))

    def spread(self, scores: Scores, count: Number, jacobian: Jacobian) -> Matrix:
        del count
        own = _blocks(scores, self.lengths)
        *rows, known = _blocks(jacobian, self.lengths)
        each = [
            noise.spread(block, n.astype(scores.dtype), slopes)
            for noise, n, block, slopes in zip(self.noises, self.counts, own, rows, strict=False)
        ]
        return sum(each, known.T @ known)

    def drawn(self, key: Key[Array, ""], scores: Scores, count: Number) -> Scores:
        del count
        *own, known = _blocks(scores, self.lengths)
        keys = jax.random.split(key, len(own) + 1)
        each = [
            noise.drawn(own_key, block, n.astype(scores.dtype))
            for noise, own_key, n, block in zip(
                self.noises, keys[:-1], self.counts, own, strict=True
            )
        ]
        return jnp.concatenate([*each, jax.random.normal(keys[-1], known.shape, scores.dtype)])


def _blocks(rows: AnyArray, lengths: Sequence[int]) -> list[AnyArray]:
    """The rows of each problem, and last those of the priors."""
    return namespace(rows).split(rows, np.cumsum(lengths))


def _answers(
    problems: Sequence[Problem], values: Sequence[Vector], logged: Flag | None
) -> list[Answer]:
    """The answer of each problem. Problems with equal shapes form one batch and share a program."""
    kinds: dict[object, list[int]] = {}
    for i, problem in enumerate(problems):
        leaves, structure = jax.tree.flatten(problem)
        shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
        kinds.setdefault((structure, shapes), []).append(i)
    found: dict[int, Answer] = {}
    for indices in kinds.values():
        own = jax.tree.map(lambda *each: jnp.stack(each), *[problems[i] for i in indices])
        batch = jax.vmap(lambda problem, at: problem.answer(at, logged))(
            own, jnp.stack([values[i] for i in indices])
        )
        for row, i in enumerate(indices):
            found[i] = jax.tree.map(lambda x, row=row: x[row], batch)
    return [found[i] for i in range(len(problems))]


def _stacked(logs: Sequence[ImpactLog]) -> ImpactLog:
    most, xp = max(log.time.shape[0] for log in logs), namespace(*logs)

    def filled(x: AnyArray) -> AnyArray:
        return x if x.ndim == 0 else xp.pad(x, (0, most - x.shape[0]))

    return jax.tree.map(lambda *each: xp.stack([filled(x) for x in each]), *logs)
