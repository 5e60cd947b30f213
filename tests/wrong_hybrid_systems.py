"""Arguments of hybrid systems that are wrong end in one sentence."""

PROGRAM = """
import diffrax
import jax.numpy as jnp
import impactjax as ij

class Ball(ij.HybridSystem):
    made: object

    def flow(self, t, y, mode):
        return {"x": y["v"], "v": -9.81}

    def transitions(self):
        return [self.made]

def rates(system, wrong):
    class Wrong(Ball):
        def flow(self, t, y, mode):
            return wrong
    return Wrong(system.made)

fall = ij.Transition(lambda t, y, mode: y["x"], lambda t, y, mode: ({**y, "v": -y["v"]}, mode))
ball, y, ts = Ball(fall), {"x": 1.0, "v": 0.0}, [0.1, 0.2]
start, term = ij.Start(0.0, y), diffrax.ODETerm(lambda t, y, args: -y)
end = ij.solve(ball, start, ts).final
wide = ij.Transition(lambda t, y, mode: jnp.ones(2), fall.jump)
lost = ij.Transition(fall.guard, lambda t, y, mode: ({"x": 0.0}, mode))

def events(*given, solver=diffrax.Tsit5(), **named):
    return ij.solve_events(term, solver, 0.0, 1.0, 1.0, events=list(given), **named)

cases = {
    "system": lambda: ij.solve(term, start, ts),
    "start": lambda: ij.solve(ball, (0.0, y), ts),
    "step": lambda: ij.solve(ball, start, ts, step=diffrax.Tsit5()),
    "mode": lambda: ij.solve(ball, ij.Start(0.0, y, 0.5), ts),
    "times": lambda: ij.solve(ball, start, [0.2, 0.1]),
    "scale": lambda: ij.solve(ball, start, ts, scale={"x": 1.0}),
    "negative scale": lambda: ij.solve(ball, start, ts, scale={"x": 1.0, "v": -1.0}),
    "max_steps": lambda: ij.solve(ball, start, ts, max_steps=2**40),
    "structure": lambda: ij.solve(rates(ball, [1.0]), start, ts),
    "shape": lambda: ij.solve(rates(ball, {"x": jnp.ones(3), "v": 0.0}), start, ts),
    "transition": lambda: ij.solve(Ball(lambda t, y, mode: y["x"]), start, ts),
    "guard": lambda: ij.solve(Ball(wide), start, ts),
    "jump": lambda: ij.solve(Ball(lost), start, ts),
    "keep": lambda: ij.section(ball, start, ij.AtTransition(0), keep=0),
    "skip": lambda: ij.section(ball, start, ij.AtTransition(0), keep=1, skip=-1),
    "surface": lambda: ij.section(ball, start, 0, keep=1),
    "number": lambda: ij.section(ball, start, ij.AtTransition(3), keep=1),
    "period": lambda: ij.Every(0.0),
    "other run": lambda: ij.section(ball, end, ij.AtTransition(0), keep=1),
    "solver": lambda: events(solver=diffrax.Kvaerno5()),
    "event": lambda: events(fall),
    "events": lambda: ij.solve_events(term, ij.TaylorStep(), 0.0, 1.0, 1.0, events=ij.ResetAt([1])),
    "dense": lambda: events(saveat=diffrax.SaveAt(dense=True)),
    "solver state": lambda: events(saveat=diffrax.SaveAt(t1=True, solver_state=True)),
    "term": lambda: events(term=1),
    "term of an event": lambda: events(ij.Reset(lambda t, y, args: y, term=2)),
    "mechanism": lambda: ij.MechanicalSystem(ball),
}
"""

SENTENCES = {
    "system": "TypeError: Argument `system` must be a HybridSystem, such as ",
    "start": "TypeError: Argument `start` must be a Start, such as `Start(t=0.0, y=y0)`, but it ",
    "step": "TypeError: Argument `step` must be a Method, such as `TaylorStep()`, but it is ",
    "mode": "TypeError: The mode of a start must be made of whole numbers, but it holds 0.5.",
    "times": "ValueError: Argument `ts` must increase strictly, but ts[1] = 0.1 follows 0.2.",
    "scale": "ValueError: `scale` gives a tree of the structure ",
    "structure": "ValueError: `flow` gives a tree of the structure ",
    "shape": "ValueError: `flow` gives an array of shape (3,) at `['x']`, but it must be ().",
    "transition": "TypeError: Argument `transitions` must be a Transition, such as ",
    "guard": "ValueError: The guard of transition 0 must be one number, but its shape is (2,).",
    "jump": "ValueError: `jump` gives a tree of the structure ",
    "negative scale": "ValueError: Argument `scale` must hold sizes of at least 0, but it is "
    "{'x': 1.0, 'v': -1.0}.",
    "max_steps": "ValueError: Argument `max_steps` must be at most 2147483647, but it is "
    "1099511627776.",
    "keep": "ValueError: Argument `keep` must be at least 1, but it is 0.",
    "skip": "ValueError: Argument `skip` must be at least 0, but it is -1.",
    "surface": "TypeError: Argument `surface` must be a Surface, such as `Every(period)`, but it ",
    "number": "ValueError: The system has no transition 3: it has 1, from 0.",
    "period": "ValueError: Argument `period` must be positive, but it is 0.0.",
    "other run": "ValueError: Argument `start` is the end of another kind of run: begin a section ",
    "solver": "TypeError: Argument `solver` must be an explicit Runge-Kutta method with an ",
    "event": "TypeError: Argument `events` must be a Reset, such as `Reset(cond_fn, reset)`, but ",
    "events": "TypeError: Argument `events` must be a list of events.",
    "dense": "ValueError: Argument `saveat` must not ask for `steps` or `dense`: give `ts`.",
    "solver state": "ValueError: Argument `saveat` must not ask for states of the solver.",
    "term": "ValueError: Argument `term` must number one of 1 terms, but it is 1.",
    "term of an event": "ValueError: An event names term 2, but there are 1, from 0.",
    "mechanism": "TypeError: Argument `mechanism` must be a Mechanism, such as ",
}
