"""Wrong arguments of information, profiles, posteriors, designs and studies end in one sentence."""

PROGRAM = """
import tempfile
import jax, jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure
import impactjax as ij

ts, law = np.linspace(0.0, 1.0, 31), ij.LinearRestitution(0.7, 0.1)
recording = ij.Recording(ts, 0.3 + 0.7 * ts + 0.01 * np.sin(37 * ts), ij.Displacement())
few = ij.Simulation(max_steps=32, max_impacts=8)
free = ij.ImpactOscillator(ij.FreeMass())
line = ij.Experiment(free, recording, ij.InitialState(0.0), ij.Sensor(sigma=0.01), simulation=few)
estimate = ij.fit(line, starts=ij.Starts(1))
model, start = ij.ImpactOscillator(ij.Pendulum(13.0), ij.Stop(law)), ij.InitialState(0.7)
plan = ij.Experiment(model, ij.planned(ts, ij.Angle()), start, ij.Sensor(sigma=0.01))
told = ij.information_in(lambda law: law.restitution(ts), law, 0.01)
ax, nan, criterion = Figure().add_subplot(), float("nan"), ij.AOptimal()

def held(quantity=lambda system: system.initial.velocity, **named):
    return ij.predicted(estimate, quantity, **named)

def drawn(**named):
    return ij.posterior(estimate, **named)

def informed(data=lambda law: law.restitution(jnp.array([0.1, 0.5])), part=law, sigma=0.1, **named):
    return ij.information_in(data, part, sigma, **named)

def chosen(experiment=lambda model: plan, choices={}, cost=lambda: {}):
    return ij.Candidates(experiment, choices, cost)

def designed(candidates=chosen(), **named):
    return ij.design(candidates, model, criterion, **{"budget": {"performances": 1}, **named})

def studied(design=ij.Grid(x=[1.0, 2.0]), **named):
    with tempfile.TemporaryDirectory() as store:
        return ij.study(lambda **point: sum(point.values()), design, store, **named)

cases = {
    "points": lambda: ij.profiles(estimate, points=nan),
    "few points": lambda: ij.profiles(estimate, points=4),
    "profiled": lambda: ij.profiles(line),
    "refits": lambda: ij.profiles(estimate, optimiser="lm"),
    "known": lambda: ij.profiles(estimate, known=3),
    "name of a profile": lambda: ij.profiles(estimate, 3),
    "points of a ridge": lambda: ij.ridge(estimate, "x0", "x_dot0", points=7),
    "part of points": lambda: ij.ridge(estimate, "x0", "x_dot0", points=(7, 9.5)),
    "quantity": lambda: held("r"),
    "no quantity": lambda: held(lambda system: None),
    "several quantities": lambda: held(lambda system: jnp.ones(2)),
    "points of a prediction": lambda: held(points=None),
    "progress": lambda: drawn(progress=None),
    "draws": lambda: drawn(draws=nan),
    "chains": lambda: drawn(chains=1),
    "seed": lambda: drawn(seed=0.5),
    "part of one fit": lambda: ij.of_experiment(estimate, 0),
    "part of nothing": lambda: ij.of_experiment(line, 5),
    "key": lambda: ij.synthetic(plan, 0),
    "no scatter": lambda: ij.synthetic(plan, jax.random.key(0), scatter="a"),
    "times": lambda: ij.planned("now", ij.Angle()),
    "scatter": lambda: ij.information(plan, scatter=-1.0),
    "experiment": lambda: ij.information(model),
    "sigma": lambda: informed(sigma=np.ones(3)),
    "no sigma": lambda: informed(sigma=None),
    "data": lambda: informed(3),
    "no data": lambda: informed(lambda law: None),
    "several data": lambda: informed(lambda law: (law.r0, law.alpha)),
    "part": lambda: informed(part=0.7),
    "batch": lambda: informed(part=ij.LinearRestitution(np.array([0.6, 0.7]), 0.1)),
    "free": lambda: informed(free=3),
    "fixed": lambda: informed(fixed={"r0": 0.7}),
    "random points": lambda: ij.structure(plan, points=2.5),
    "random seed": lambda: ij.structure_in(lambda law: law.r0, law, 0.1, seed=-1),
    "parts": lambda: ij.joint_information(3),
    "estimates": lambda: ij.joint_information([estimate]),
    "shared": lambda: ij.joint_information([told, told], shared=3),
    "identifiability": lambda: ij.identifiability(line),
    "coupling": lambda: ij.coupling(estimate),
    "residuals": lambda: ij.residual_diagnostics(line),
    "band": lambda: ij.restitution_band(estimate, [0.1]),
    "collinearity": lambda: told.collinearity("r0"),
    "times of couplings": lambda: ij.couplings(model, start, "now"),
    "accuracy": lambda: ij.couplings(model, start, ts, accuracy=ij.Accuracy(speed="low")),
    "range": lambda: ij.Between("low", 1.0),
    "function of candidates": lambda: chosen(3),
    "arguments of candidates": lambda: chosen(choices={"theta0": [0.7]}),
    "choices": lambda: chosen(choices=["theta0"]),
    "choice": lambda: chosen(lambda model, a: plan, {"a": ["low"]}, lambda a: {}),
    "cost": lambda: designed(chosen(cost=lambda: None)),
    "cost of a resource": lambda: designed(chosen(cost=lambda: {"s": "long"})),
    "cost of performances": lambda: designed(chosen(cost=lambda: {"performances": 5.0})),
    "no experiment": lambda: designed(chosen(lambda model: 3)),
    "performed": lambda: designed(performed=plan),
    "priors": lambda: designed(priors=3),
    "number of refits": lambda: designed(refits=2.5),
    "tell": lambda: designed(tell=None),
    "goal": lambda: ij.Within({3: 0.05}),
    "names": lambda: ij.DOptimal(3),
    "lane": lambda: studied(ij.Grid(lane=[1.0, 2.0])),
    "axis": lambda: studied(ij.Saltelli({"block": (0.0, 1.0)}, 4)),
    "name of a range": lambda: ij.LatinHypercube({3: (0.0, 1.0)}, 4),
    "size": lambda: ij.LatinHypercube({"x": (0.0, 1.0)}, 4.0),
    "logarithmic range": lambda: ij.LogUniform("low", 2.0),
    "no cost": lambda: studied(cost=lambda x: None),
    "told": lambda: studied(progress=True),
    "units": lambda: studied(units={"x": 3}),
    "profile figure": lambda: ij.plot.profile(ax, {}),
    "ridge figure": lambda: ij.plot.ridge(ax, {}),
    "design figure": lambda: ij.plot.design(ax, plan),
    "couplings figure": lambda: ij.plot.couplings(ax, told),
    "repeats figure": lambda: ij.plot.repeats(ax, [0.1, 0.2]),
    "directions figure": lambda: ij.plot.directions(ax, estimate),
    "sensitivities figure": lambda: ij.plot.sensitivities(ax, told, ts),
    "fit figure": lambda: ij.plot.fit(ax, line),
    "restitution figure": lambda: ij.plot.restitution(ax, estimate),
}
"""

SENTENCES = {
    "points": "TypeError: Argument `points` must be a whole number, but it is nan.",
    "few points": "ValueError: Argument `points` must be at least 5, but it is 4.",
    "profiled": "TypeError: Argument `estimate` must be an Estimate, such as `fit(experiment)`, ",
    "refits": "TypeError: Argument `optimiser` must be a LevenbergMarquardt, such as ",
    "known": "TypeError: Argument `known` must be a Mapping, such as ",
    "name of a profile": "ValueError: `3` was not fitted; x0, x_dot0 were.",
    "points of a ridge": "TypeError: Argument `points` must be a pair, such as (100, 100), not 7.",
    "part of points": "TypeError: Argument `points` must be a whole number, but it is 9.5.",
    "quantity": "TypeError: Argument `quantity` must be a function, but it is 'r'.",
    "no quantity": "TypeError: Argument `quantity` must return one number, but it returns a ",
    "several quantities": "ValueError: Argument `quantity` must return one number, but its shape ",
    "points of a prediction": "TypeError: Argument `points` must be a whole number, but it is ",
    "progress": "TypeError: Argument `progress` must be a function, but it is None.",
    "draws": "TypeError: Argument `draws` must be a whole number, but it is nan.",
    "chains": "ValueError: Argument `chains` must be at least 2, but it is 1.",
    "seed": "TypeError: Argument `seed` must be a whole number, but it is 0.5.",
    "part of one fit": "TypeError: Argument `estimate` must be one of `fit_together`, but it is ",
    "part of nothing": "TypeError: Argument `estimate` must be an Estimate, such as ",
    "key": "TypeError: Argument `key` must be a random key, such as `jax.random.key(0)`, but it ",
    "no scatter": "ValueError: Argument `scatter` must be a number from 0 on, but it is a.",
    "times": "TypeError: A number must be real, but it is 'now'.",
    "scatter": "ValueError: Argument `scatter` must be a number from 0 on, but it is -1.0.",
    "experiment": "TypeError: Argument `experiment` must be an Experiment, such as ",
    "sigma": "ValueError: Argument `sigma` must be one number or one for each datum, but its ",
    "no sigma": "TypeError: Argument `sigma` must be a number, or several, but it is None.",
    "data": "TypeError: Argument `data` must be a function, but it is 3.",
    "no data": "TypeError: Argument `data` must return an array, but it returns a NoneType.",
    "several data": "TypeError: Argument `data` must return an array, but it returns a tuple.",
    "part": "TypeError: Argument `part` must be a Module, such as ",
    "batch": "ValueError: `r0` has shape (2,), but must be one number: use `vmap`.",
    "free": "TypeError: Argument `free` must be a list of names, but it is 3.",
    "fixed": "TypeError: Argument `fixed` must be a list of names: ['r0'].",
    "random points": "TypeError: Argument `points` must be a whole number, but it is 2.5.",
    "random seed": "ValueError: Argument `seed` must be at least 0, but it is -1.",
    "parts": "TypeError: Argument `parts` must be a Sequence, such as ",
    "estimates": "TypeError: Argument `parts` must be an Information, such as ",
    "shared": "TypeError: Argument `shared` must be a list of names, but it is 3.",
    "identifiability": "TypeError: Argument `estimate` must be an Estimate, such as ",
    "coupling": "TypeError: Argument `information` must be an Information, such as ",
    "residuals": "TypeError: Argument `estimate` must be an Estimate, such as ",
    "band": "TypeError: Argument `learned` must be a Learned, such as ",
    "collinearity": "TypeError: Argument `names` must be a list of names: ['r0'].",
    "times of couplings": "TypeError: A number must be real, but it is 'now'.",
    "accuracy": "TypeError: Argument `speed` must be a number, but it is 'low'.",
    "range": "TypeError: Argument `low` must be a number, but it is 'low'.",
    "function of candidates": "TypeError: Argument `experiment` must be a function, but it is 3.",
    "arguments of candidates": "TypeError: Argument `experiment` must take the parameters theta0 ",
    "choices": "TypeError: Argument `choices` must be a Mapping, such as ",
    "choice": "TypeError: Argument `a` must be a number, but it is 'low'.",
    "cost": "TypeError: Argument `cost` must return a table, but it returns None.",
    "cost of performances": "ValueError: Each performance takes one of the `performances`, but the "
    "cost says 5: call the resource by another name.",
    "cost of a resource": "TypeError: Argument `s` must be a number, but it is 'long'.",
    "no experiment": "TypeError: The function of the candidates must return an Experiment, or ",
    "performed": "TypeError: Argument `performed` must be a Sequence, such as ",
    "priors": "TypeError: Argument `priors` must be a Mapping, such as ",
    "number of refits": "TypeError: Argument `refits` must be a whole number, but it is 2.5.",
    "tell": "TypeError: Argument `tell` must be a function, but it is None.",
    "goal": "TypeError: Argument `asked` must be a str, such as ",
    "names": "TypeError: Argument `names` must be a list of names, but it is 3.",
    "lane": "ValueError: A parameter cannot be called `lane`, which numbers the lanes.",
    "axis": "ValueError: Parameter `block` has the name of an axis of the design, along which ",
    "name of a range": "TypeError: Argument `ranges` must be a str, such as ",
    "size": "TypeError: Argument `size` must be a whole number, but it is 4.0.",
    "logarithmic range": "TypeError: Argument `low` must be a number, but it is 'low'.",
    "no cost": "TypeError: Argument `cost` must return one number, but it returns a NoneType.",
    "told": "TypeError: Argument `progress` must be a function, but it is True.",
    "units": "TypeError: Argument `units` must be a str, such as ",
    "profile figure": "TypeError: Argument `found` must be a Profile, such as ",
    "ridge figure": "TypeError: Argument `found` must be a Ridge, such as ",
    "design figure": "TypeError: Argument `found` must be a Design, such as ",
    "couplings figure": "TypeError: Argument `found` must be a Couplings, such as ",
    "repeats figure": "TypeError: Argument `parameter` must be a RepeatedParameter, such as ",
    "directions figure": "TypeError: Argument `information` must be an Information, such as ",
    "sensitivities figure": "TypeError: Argument `recording` must be a Recording, such as ",
    "fit figure": "TypeError: Argument `estimate` must be an Estimate, such as ",
    "restitution figure": "TypeError: Argument `fits` must be the fits of a comparison, ",
}
