"""The four mechanisms of `mechanism_equations.py` as the package takes them, and their runs."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import impactjax as ij
from impactjax._model.law import AbstractLaw

from .mechanism_equations import LAWS, SYSTEMS, G

MAX_STEPS, MAX_EVENTS = 4096, 384


class _Two(ij.AbstractMechanism):
    p: dict[str, Array]
    laws: tuple[AbstractLaw, ...]

    def mass_matrix(self, q):
        return jnp.diag(self.p["masses"])

    def potential(self, t, q):
        return jnp.sum(self.p["stiffness"] * q * q) / 2 + jnp.sum(self.p["push"] * q)

    def force(self, t, q, v):
        return -self.p["damping"] * v

    def contacts(self):
        between, wall = self.p["gaps"]
        return [
            ij.Contact(lambda q: q[1] - q[0] + between, self.laws[0]),
            ij.Contact(lambda q: q[0] + wall, self.laws[1]),
        ]


class _CartPendulum(ij.AbstractMechanism):
    p: dict[str, Array]
    laws: tuple[AbstractLaw, ...]

    def mass_matrix(self, q):
        (cart, bob), length = self.p["masses"], self.p["length"]
        mixed = bob * length * jnp.cos(q[1])
        return jnp.stack(
            [jnp.stack([cart + bob, mixed]), jnp.stack([mixed, bob * length * length])]
        )

    def potential(self, t, q):
        return -G * self.p["masses"][1] * self.p["length"] * jnp.cos(q[1]) - self.p["push"] * q[0]

    def force(self, t, q, v):
        return -self.p["damping"] * v

    def contacts(self):
        left, right = self.p["walls"]
        return [
            ij.Contact(lambda q: q[0] + left, self.laws[0]),
            ij.Contact(lambda q: right - q[0], self.laws[1]),
        ]


class _DoublePendulum(ij.AbstractMechanism):
    p: dict[str, Array]
    laws: tuple[AbstractLaw, ...]

    def mass_matrix(self, q):
        (m1, m2), (l1, l2) = self.p["masses"], self.p["lengths"]
        mixed = m2 * l1 * l2 * jnp.cos(q[0] - q[1])
        return jnp.stack(
            [jnp.stack([(m1 + m2) * l1 * l1, mixed]), jnp.stack([mixed, m2 * l2 * l2])]
        )

    def potential(self, t, q):
        (m1, m2), (l1, l2) = self.p["masses"], self.p["lengths"]
        return -G * ((m1 + m2) * l1 * jnp.cos(q[0]) + m2 * l2 * jnp.cos(q[1]))

    def force(self, t, q, v):
        return -self.p["damping"] * v

    def contacts(self):
        def gap(q):
            return jnp.sum(self.p["lengths"] * jnp.sin(q)) + self.p["wall"]

        return [ij.Contact(gap, self.laws[0])]


class _Chain(ij.AbstractMechanism):
    p: dict[str, Array]
    laws: tuple[AbstractLaw, ...]

    def mass_matrix(self, q):
        return jnp.diag(self.p["masses"])

    def potential(self, t, q):
        stretch = q[1:] - q[:-1]
        springs = jnp.sum(self.p["stiffness"] * stretch * stretch) / 2
        return springs + self.p["gravity"] * jnp.sum(self.p["masses"] * q)

    def force(self, t, q, v):
        pull = self.p["damping"] * (v[1:] - v[:-1])
        none = jnp.zeros_like(v[:1])
        return jnp.concatenate([pull, none]) - jnp.concatenate([none, pull])

    def contacts(self):
        wall, between = self.p["gaps"]
        return [
            ij.Contact(lambda q: q[0] + wall, self.laws[0]),
            ij.Contact(lambda q: q[7] - q[6] + between, self.laws[1]),
        ]


MECHANISMS = {
    "two-masses": _Two,
    "cart-pendulum": _CartPendulum,
    "double-pendulum": _DoublePendulum,
    "chain": _Chain,
}


class Found(NamedTuple):
    """Outcome of a run of the package.

    - `total`: number of events.
    - `t`, `transition`, `before`, `after`: times, numbers and phases of the events.
    - `event_q`, `event_v`: states before them.
    """

    result: ij.RESULTS
    total: Array
    t: Array
    transition: Array
    before: Array
    after: Array
    event_q: Array
    event_v: Array
    q: Array
    v: Array
    modes: Array


def law(kind: str, parameters: Array) -> AbstractLaw:
    """A law by its name."""
    a, b, n = parameters
    if kind == "restitution":
        return ij.Restitution(a)
    if kind == "hunt-crossley":
        return ij.HuntCrossley(a, b, n)
    separation = ij.AtZeroForce() if kind == "at-zero-force" else ij.AtZeroPenetration()
    return ij.KelvinVoigt(a, b, separation=separation)


def program(name: str, kinds: str, tolerance: float) -> Callable[..., Found]:
    """A function of batches of parameters, law parameters, coordinates, rates and times."""

    def run(p: dict[str, Array], laws: Array, q: Array, v: Array, ts: Array) -> Found:
        own = [law(kind, row) for kind, row in zip(LAWS[kinds], laws, strict=False)]
        system = ij.MechanicalSystem(MECHANISMS[name](p, tuple(own)), longest_sum=1e-7)
        found = ij.solve(
            system,
            system.start(0.0, q, v),
            ts,
            tolerance=tolerance,
            max_steps=MAX_STEPS,
            max_events=MAX_EVENTS,
        )
        log = found.events
        return Found(
            found.result,
            log.count,
            log.t,
            log.transition,
            log.mode_before,
            log.mode_after,
            log.before.q,
            log.before.v,
            found.ys.q,
            found.ys.v,
            found.modes,
        )

    return jax.jit(jax.vmap(run))


def contact_of(name: str, kinds: str) -> list[int]:
    """The contact that each transition belongs to."""
    found: list[int] = []
    count = SYSTEMS[name].gaps(*SYSTEMS[name].draw(np.random.default_rng(0))[:2]).size
    for number, kind in enumerate(LAWS[kinds][:count]):
        found += [number, number] if kind == "at-zero-force" else [number]
    return found
