"""Arguments of a wrong kind end in one sentence with an example of the right one."""

PROGRAM = """
import numpy as np
import impactjax as ij

ts = np.linspace(0.0, 1.0, 20)
pendulum, law = ij.Pendulum(13.0, 0.002), ij.KelvinVoigt(600.0, 0.2)
model, start = ij.ImpactOscillator(pendulum, ij.Stop(law)), ij.InitialState(0.7)
recording = ij.Recording(ts, np.cos(13 * ts), ij.Angle())
experiment = ij.Experiment(model, recording, start)
bounded = lambda bounds: ij.build_problem(
    ij.Experiment(model, recording, start, bounds={"gamma": bounds})
)
anything = ij.Candidates(lambda model: experiment)
cases = {
    "simulate initial": lambda: ij.simulate(model, 0.78, ts),
    "simulate model": lambda: ij.simulate(pendulum, start, ts),
    "stop and law": lambda: ij.ImpactOscillator(pendulum, law),
    "law": lambda: ij.Stop(pendulum),
    "starts": lambda: ij.fit(experiment, starts=16),
    "optimiser": lambda: ij.fit(experiment, optimiser="lm"),
    "fit a model": lambda: ij.fit(model),
    "fit together": lambda: ij.fit_together([model]),
    "fit in segments": lambda: ij.fit_in_segments(model, 4),
    "learn": lambda: ij.learn(model),
    "fitted data": lambda: ij.fit_data(3.0, law, ts),
    "fitted part": lambda: ij.fit_data(lambda law: law.force, 3.0, ts),
    "loss of data": lambda: ij.fit_data(lambda law: law.force, law, ts, loss="cauchy"),
    "prior of data": lambda: ij.fit_data(lambda law: law.force, law, ts, priors={"gamma": 0.1}),
    "no data": lambda: ij.fit_data(lambda law: None, law, ts),
    "batch of parts": lambda: ij.fit_data(lambda law: None, ij.KelvinVoigt([6.0, 7.0], 0.2), ts),
    "posterior": lambda: ij.posterior(experiment),
    "low_pass": lambda: ij.Sensor(low_pass=50.0),
    "quantity": lambda: ij.Recording(ts, ts, "angle"),
    "experiment": lambda: ij.Experiment(model, recording, 0.78),
    "sensor": lambda: ij.Experiment(model, recording, start, 50.0),
    "names": lambda: ij.Experiment(model, recording, start, free="mass"),
    "prior": lambda: ij.Experiment(model, recording, start, priors={"zeta": 0.1}),
    "list": lambda: ij.simulate(ij.ImpactOscillator(ij.Pendulum([1.0, 2.0])), start, ts),
    "degrees": lambda: ij.simulate(model, ij.InitialState(45.0), ts),
    "law name": lambda: ij.prepare(recording, laws=["hertzz"]),
    "law class": lambda: ij.prepare(recording, laws=[ij.Hertz]),
    "record": lambda: ij.prepare(3),
    "compare": lambda: ij.compare(["hertz"]),
    "held out": lambda: ij.compare({"mine": experiment}, holdout="another.csv"),
    "candidates": lambda: ij.design([start], model, ij.AOptimal(), budget={"performances": 1}),
    "models": lambda: ij.design(anything, [1.0], ij.AOptimal(), budget={"performances": 1}),
    "criterion": lambda: ij.design(anything, model, "A", budget={"performances": 1}),
    "criterion name": lambda: ij.DOptimal("k"),
    "accuracy": lambda: ij.couplings(model, start, ts, accuracy=1e-3),
    "forced": lambda: ij.couplings(model, start, ts, forced=26.4),
    "sensor of couplings": lambda: ij.couplings(model, start, ts, sensor=50.0),
    "simulation": lambda: ij.couplings(model, start, ts, simulation=1024),
    "falling bounds": lambda: bounded((0.3, 0.1)),
    "bounds elsewhere": lambda: bounded((0.3, 0.4)),
    "study function": lambda: ij.study(3.0, ij.Grid(x=[1.0]), "nowhere"),
    "study design": lambda: ij.study(lambda x: x, {"x": [1.0]}, "nowhere"),
    "sobol indices": lambda: ij.sobol_indices({"y": 1.0}, "y"),
    "bounds out of range": lambda: bounded((-0.3, 0.4)),
}
"""

SENTENCES = {
    "simulate initial": "TypeError: Argument `initial` must be an InitialState, such as "
    "`InitialState(0.78)` or `trajectory.final`, but it is 0.78 (float).",
    "simulate model": "TypeError: Argument `model` must be an ImpactOscillator, such as ",
    "stop and law": "TypeError: Argument `lower` must be a Stop, such as `Stop(Restitution(0.7))`, "
    "but it is KelvinVoigt(omega0=600.0, gamma=0.2) (KelvinVoigt).",
    "law": "TypeError: Argument `law` must be a Law, such as `Restitution(0.7)`, but it is ",
    "starts": "TypeError: Argument `starts` must be a Starts, such as `Starts(16)`, but it is 16 ",
    "optimiser": "TypeError: Argument `optimiser` must be a LevenbergMarquardt, such as ",
    "fit a model": "TypeError: Argument `experiment` must be an Experiment, such as ",
    "fit in segments": "TypeError: Argument `experiment` must be an Experiment, such as ",
    "fit together": "TypeError: Argument `experiments` must be an Experiment, such as ",
    "learn": "TypeError: Argument `experiment` must be an Experiment, such as ",
    "fitted data": "TypeError: Argument `data` must be a function, but it is 3.0",
    "fitted part": "TypeError: Argument `part` must be a Module, such as `TwoMasses(...)`, but it ",
    "loss of data": "TypeError: Argument `loss` must be a Loss, such as `Cauchy(0.01)`, but it is ",
    "prior of data": "TypeError: Argument `priors['gamma']` must be a Normal, such as ",
    "batch of parts": "ValueError: `omega0` must be one number, but its shape is (2,).",
    "no data": "TypeError: Argument `data` must return an array, but it returns a NoneType",
    "posterior": "TypeError: Argument `estimate` must be an Estimate, such as `fit(experiment)`, ",
    "low_pass": "TypeError: Argument `low_pass` must be a LowPass, such as `Butterworth(50.0)`, ",
    "quantity": "TypeError: Argument `quantity` must be a Quantity, such as `Angle()`, but it is ",
    "experiment": "TypeError: Argument `initial` must be an InitialState, such as ",
    "sensor": "TypeError: Argument `sensor` must be a Sensor, such as ",
    "names": "TypeError: Argument `free` must be a list of names: ['mass'].",
    "prior": "TypeError: Argument `priors` must be a Normal, such as ",
    "list": "ValueError: `omega_n` of Pendulum has shape (2,), but a run takes one number: ",
    "degrees": "ValueError: An initial angle of 45 rad is more than a turn; are degrees meant?",
    "law name": "ValueError: There is no law `hertzz`; did you mean `hertz`?",
    "law class": "TypeError: A law must be a name or an object such as `Restitution(0.7)`, but ",
    "record": "TypeError: Argument `record` must be a Recording, such as ",
    "compare": "TypeError: Argument `experiments` must be what `prepare` made, or experiments by ",
    "held out": "TypeError: Argument `holdout` must be a share of the observations or what ",
    "candidates": "TypeError: Argument `candidates` must be a Candidates, such as ",
    "models": "TypeError: Argument `models` must be an ImpactOscillator, such as ",
    "criterion": "TypeError: Argument `criterion` must be a Criterion, such as ",
    "criterion name": "TypeError: Argument `names` must be a list of names: ['k'].",
    "accuracy": "TypeError: Argument `accuracy` must be an Accuracy, such as `Accuracy(speed=",
    "forced": "TypeError: Argument `forced` must be a HarmonicMotion, such as ",
    "sensor of couplings": "TypeError: Argument `sensor` must be a Sensor, such as ",
    "simulation": "TypeError: Argument `simulation` must be a Simulation, such as ",
    "falling bounds": "ValueError: The bounds of `gamma` must rise, but they are 0.3 and 0.1.",
    "bounds elsewhere": "ValueError: `gamma` starts at 0.2, outside its bounds 0.3 and 0.4.",
    "study function": "TypeError: Argument `function` must be a function, but it is 3.0.",
    "study design": "TypeError: Argument `design` must be a Design, such as `Grid(gamma=[0.1, 0.2",
    "sobol indices": "TypeError: Argument `study` must be a Study, such as `study(function, Salt",
    "bounds out of range": "ValueError: The bounds of `gamma`, -0.3 and 0.4, must lie within ",
}
