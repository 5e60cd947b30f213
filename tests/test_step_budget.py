"""Steps that `prepare` expects a simulation to need."""

import numpy as np

import impactjax as ij

GRAVITY, HEIGHT, R = 9.80665, 0.8, 0.75
TS = np.arange(240) / 60


def heights():
    """A ball that falls, bounces by the closed form, and rests after 2.8 s; seen by a camera."""
    fall = np.sqrt(2 * HEIGHT / GRAVITY)
    speeds = np.sqrt(2 * GRAVITY * HEIGHT) * R ** np.arange(1, 30)
    begins = fall + np.concatenate([[0.0], np.cumsum(2 * speeds / GRAVITY)])
    flight = np.searchsorted(begins, TS, side="right") - 1
    speed = np.append(speeds, 0.0)[np.minimum(flight, 29)]
    since = TS - begins[flight]
    falling = HEIGHT - GRAVITY * TS**2 / 2
    rising = np.where(speed > 0, speed * since - GRAVITY * since**2 / 2, 0.0)
    noise = 3e-3 * np.random.default_rng(1).standard_normal(len(TS))
    return np.where(flight < 0, falling, rising) + noise


def test_ball_that_comes_to_rest_in_a_compliant_stop_has_enough_steps():
    record = ij.Recording(TS, heights(), ij.Displacement())
    experiment = ij.prepare(record, laws=["kelvin-voigt"]).experiments["kelvin-voigt"]
    stiff = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.KelvinVoigt(8500.0, 0.0911)))
    steps = experiment.simulation.max_steps
    run = ij.simulate(stiff, ij.InitialState(HEIGHT), TS, max_steps=steps)
    assert run.result == ij.RESULTS.successful
    fallen = ij.Recording(TS[:90], heights()[:90], ij.Displacement())
    short = ij.prepare(fallen, laws=["kelvin-voigt"]).experiments["kelvin-voigt"]
    assert short.simulation.max_steps < steps
