"""Random runs of mechanisms with contacts beside those of SciPy.

    python -m benchmarks.fuzz.mechanisms --system two-masses --first 0 --count 500

Run number n of a system has its own parameters, start and laws, drawn with n as seed. Compared are
the events (which, in which order, their times) and the states at 40 random times. What may differ:

    100 (tolerance + change), where change is what becomes of a relative change of the size
    `tolerance` of all parameters and of the start, in an own run of SciPy.

A run is left out, and counted, if the changed run (1e-8 instead of `tolerance`) has other events:
a contact is met by a hair, or two events change places. Impacts at a rigid contact slower than
1e-4 m/s are left out of the comparison of events, since they may be summed, and so are states
closer than 2e-5 s to an event.

Prints one row in Markdown for each law, and each run that is wrong. Ends with status 1 if there is
one.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the matrices are small
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parents[2] / ".jax_cache"))

import jax
import jax.numpy as jnp
import numpy as np

from impactjax import RESULTS

from .mechanism_equations import LAWS, SYSTEMS, Parameters, Vector, drawn_laws
from .mechanism_package import Found, contact_of, program
from .mechanism_reference import FREE, RESTING, RTOL, Event, Run, Simulation, simulated

SAMPLES = 40
SLOW = 1e-4  # m/s
BESIDE = 2e-5  # s
CHANGE = 1e-8  # of parameters and start, for the conditioning
FACTOR = 100.0
BATCH = 50


class Case(NamedTuple):
    """A drawn run."""

    number: int
    p: Parameters
    kinds: tuple[str, ...]
    laws: Vector
    q: Vector
    v: Vector
    times: Vector


class Errors(NamedTuple):
    """The largest errors of a run, absolute, and in units of what is allowed."""

    time: float
    q: float
    v: float
    ratio: float


class Verdict(NamedTuple):
    """Verdict of a comparison: `right`, `wrong`, `ill-conditioned` or a failure."""

    number: int
    said: str
    errors: Errors | None
    events: int
    rests: bool


def drawn(system: str, number: int) -> tuple[str, Case]:
    """The name of the laws of a run, and its numbers."""
    equations = SYSTEMS[system]
    rng = np.random.default_rng([number, *system.encode()])
    name = equations.laws[number % len(equations.laws)]
    p, q, v = equations.draw(rng)
    kinds = LAWS[name][: equations.gaps(p, q).size]
    times = np.sort(rng.uniform(0, equations.end, SAMPLES))
    return name, Case(number, p, kinds, drawn_laws(rng, kinds), q, v, times)


def _referred(system: str, case: Case, rtol: float = RTOL) -> Run:
    simulation = Simulation(SYSTEMS[system], case.p, case.kinds, case.laws, rtol)
    return simulated(simulation, case.q, case.v, case.times)


def _changed(case: Case) -> Case:
    rng = np.random.default_rng(case.number)

    def near(x: Vector) -> Vector:
        return np.asarray(x) * (1 + CHANGE * rng.uniform(-1, 1, np.shape(x)))

    p = {name: near(value) for name, value in case.p.items()}
    return case._replace(p=p, laws=near(case.laws), q=near(case.q), v=near(case.v))


def _seen(events: list[Event], kinds: tuple[str, ...]) -> list[Event]:
    """Events without the slow impacts at rigid contacts."""
    return [
        each
        for each in events
        if not (kinds[each.contact] == "restitution" and each.before == FREE)
        or abs(each.speed) > SLOW
    ]


def _kinds_of(events: list[Event], kinds: tuple[str, ...]) -> list[tuple[int, int, int]]:
    return [
        (each.contact, each.before, FREE if kinds[each.contact] == "restitution" else each.after)
        for each in events
    ]


def _ours(system: str, case: Case, names: list[int], found: Found) -> list[Event]:
    events, equations = [], SYSTEMS[system]
    for i in range(min(int(found.total), found.t.size)):
        contact = names[int(found.transition[i])]
        rate = equations.normals(case.p, np.asarray(found.event_q[i]))[contact] @ found.event_v[i]
        before, after = int(found.before[i][contact]), int(found.after[i][contact])
        events.append(Event(float(found.t[i]), contact, before, after, float(rate)))
    return events


def judged(system: str, case: Case, names: list[int], found: Found, tolerance: float) -> Verdict:
    """The verdict on one run, `found` being its lane."""
    exact, near = _referred(system, case), _referred(system, _changed(case), 1e-11)
    if exact.events is None or near.events is None:
        return Verdict(case.number, "too many events", None, 0, False)
    rests = bool(np.any(exact.modes == RESTING))
    count = len(exact.events)
    seen, other = _seen(exact.events, case.kinds), _seen(near.events, case.kinds)
    said = _kinds_of(seen, case.kinds)
    if said != _kinds_of(other, case.kinds):
        return Verdict(case.number, "ill-conditioned", None, count, rests)
    result = next(
        name for name, item in RESULTS._name_to_item.items() if item._value == found.result._value
    )
    if result != "successful":
        return Verdict(case.number, result, None, count, rests)
    mine = _seen(_ours(system, case, names, found), case.kinds)
    if said != _kinds_of(mine, case.kinds):
        return Verdict(case.number, "wrong events", None, count, rests)
    errors = _errors(exact, near, [each.t for each in seen], [each.t for each in other],
                     [each.t for each in mine], case, found, tolerance)  # fmt: skip
    return Verdict(case.number, "right" if errors.ratio < 1 else "wrong", errors, count, rests)


def _errors(
    exact: Run,
    near: Run,
    times: list[float],
    near_times: list[float],
    mine: list[float],
    case: Case,
    found: Found,
    tolerance: float,
) -> Errors:
    assert exact.events is not None
    assert near.events is not None
    all_times = np.array([each.t for each in (*exact.events, *near.events)])
    clear = np.all(np.abs(case.times[:, None] - all_times) > BESIDE, axis=1)
    worst, ratio = [], 0.0
    for a, b, own in (
        (np.array(times), np.array(near_times), np.array(mine)),
        (exact.q[clear], near.q[clear], np.asarray(found.q)[clear]),
        (exact.v[clear], near.v[clear], np.asarray(found.v)[clear]),
    ):
        error = np.abs(own - a)
        size = np.max(np.abs(a), initial=1e-3)
        allowed = FACTOR * tolerance * (size + np.abs(a - b) / CHANGE)
        error = np.where(np.isnan(error), np.inf, error)
        worst.append(float(np.max(error, initial=0.0)))
        ratio = max(ratio, float(np.max(error / allowed, initial=0.0)))
    return Errors(worst[0], worst[1], worst[2], ratio)


def campaign(
    system: str, first: int, count: int, tolerance: float, laws: str | None = None
) -> Iterator[tuple[str, list[Verdict]]]:
    """The verdicts on runs for each kind of laws."""
    cases: dict[str, list[Case]] = {}
    for number in range(first, first + count):
        name, case = drawn(system, number)
        if laws in (None, name):
            cases.setdefault(name, []).append(case)
    for name, own in cases.items():
        run, verdicts = program(system, name, tolerance), []
        names = contact_of(system, name)
        size = min(BATCH, len(own))
        for begin in range(0, len(own), size):
            batch = own[begin : begin + size]
            lanes = (batch * size)[:size]  # as many as before, so that nothing is compiled again
            columns = [[getattr(each, part) for each in lanes] for part in Case._fields]
            p = jax.tree.map(lambda *x: jnp.stack(jnp.asarray(x)), *columns[1])
            found = run(p, *(jnp.asarray(np.array(x)) for x in columns[3:]))
            found = jax.tree.map(np.asarray, found)
            for lane, case in enumerate(batch):
                mine = jax.tree.map(lambda x, lane=lane: x[lane], found)
                verdicts.append(judged(system, case, names, mine, tolerance))
        yield name, verdicts


def row(system: str, laws: str, verdicts: list[Verdict], seconds: float) -> str:
    """A row of the table."""
    fine = [each for each in verdicts if each.said == "right"]
    counts = {
        said: sum(each.said == said for each in verdicts) for said in ("right", "ill-conditioned")
    }
    wrong = len(verdicts) - sum(counts.values())
    errors = [each.errors for each in fine if each.errors]
    worst = [max((each[k] for each in errors), default=0.0) for k in range(4)]
    rests, events = sum(each.rests for each in fine), sum(each.events for each in fine)
    return (
        f"| {system} | {laws} | {len(verdicts)} | {counts['right']} | {wrong} | "
        f"{counts['ill-conditioned']} | {events} | {rests} | "
        + " | ".join(f"{each:.1e}" for each in worst)
        + f" | {seconds:.0f} |"
    )


HEAD = (
    "| system | laws | runs | right | wrong | ill-conditioned | events | with rest | time [s] | "
    "q | v | share of allowed | s |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|"
)


def main() -> int:
    """Compare and print."""
    parser = argparse.ArgumentParser(description="Random runs of mechanisms beside SciPy's.")
    parser.add_argument("--system", choices=SYSTEMS, action="append")
    parser.add_argument("--laws", choices=LAWS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--tolerance", type=float, default=1e-11)
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    print(HEAD)
    wrong = 0
    for system in chosen.system or SYSTEMS:
        began = time.perf_counter()
        for laws, verdicts in campaign(
            system, chosen.first, chosen.count, chosen.tolerance, chosen.laws
        ):
            now = time.perf_counter()
            print(row(system, laws, verdicts, now - began), flush=True)
            began = now
            for each in verdicts:
                if each.said not in ("right", "ill-conditioned"):
                    wrong += 1
                    print(f"  {system} {each}", flush=True)
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
