"""Recorded motions with scatter from impact to impact, from a closed form, and their fits."""

import functools

import numpy as np

import impactjax as ij

R, SPEED, OMEGA, NOISE = 0.9, 6.0, 12.0, 2e-3


def record(seed, scatter, noise=NOISE, count=1200, law=lambda speed: R):
    """A linear oscillator that bounces off a stop at its equilibrium: half periods of a sine, each
    with 0.9 times the speed of the one before, and a factor.
    """
    rng = np.random.default_rng(seed)
    ts = np.arange(count) / 400
    number = np.floor(ts / (np.pi / OMEGA)).astype(int)
    speeds = [SPEED]
    for factor in np.exp(scatter * rng.standard_normal(number[-1])):
        speeds.append(law(speeds[-1]) * speeds[-1] * factor)
    shown = np.array(speeds)[number] / OMEGA * np.abs(np.sin(OMEGA * ts))
    return ij.Recording(ts, shown + noise * rng.standard_normal(count), ij.Displacement())


def drawn(seed, scatter):
    """The logarithms of the factors in a record."""
    return scatter * np.random.default_rng(seed).standard_normal(11)


def experiment(recording, **more):
    oscillator = ij.LinearOscillator(OMEGA, 0.0)
    contact = more.pop("contact", ij.Restitution(R))
    model = ij.ImpactOscillator(oscillator, ij.Stop(contact))
    fixed = more.pop("fixed", ["x0", "zeta"])
    steps, impacts = more.pop("max_steps", 128), more.pop("max_impacts", 64)
    simulation = ij.Simulation(max_steps=steps, max_impacts=impacts)
    start = ij.InitialState(0.0, SPEED)
    return ij.Experiment(model, recording, start, fixed=fixed, simulation=simulation, **more)


@functools.cache
def plain(scatter):
    return ij.fit(experiment(record(1, scatter)))


@functools.cache
def compared():
    return ij.compare({"own": experiment(record(1, 0.02))}, starts=ij.Starts(1))


def holds(estimate, truth=R):
    return estimate["r"].low < truth < estimate["r"].high
