"""The integrators of the heyoka rival: events with callbacks, variational equations, batches.

The saltation of the tangents is derived by hand: with dt = −∂θ/θ̇ the change of the impact's time, a
tangent (X, V) becomes (−θ̇⁺ dt, ∂θ̇⁺ − θ̈⁺ dt), where ∂θ̇⁺ is the change of the law's outcome.
"""
# pyright: reportMissingImports=false

from collections.abc import Callable

import heyoka as hy
import numpy as np

from . import tasks

TOLERANCE = 1e-8
EXACT = 2.2204460492503131e-16
BATCH = 8
X, V = hy.make_vars("x", "v")
OMEGA_N, ZETA, GAMMA, OMEGA0, FREE, PUSH, FREQUENCY = (hy.par[i] for i in range(7))
FLIGHT = -2.0 * ZETA * OMEGA_N * V - OMEGA_N**2 * hy.sin(X)
CONTACT = -2.0 * GAMMA * OMEGA0 * V - OMEGA0**2 * X
FORCE = PUSH * hy.sin(FREQUENCY * hy.time) * hy.cos(X)
BOUNCE = {
    tasks.RESTITUTION: [(X, V), (V, FLIGHT)],
    tasks.KELVIN_VOIGT: [(X, V), (V, FREE * FLIGHT + (1.0 - FREE) * CONTACT)],
}
DRIVEN = [(X, V), (V, FREE * FLIGHT + (1.0 - FREE) * CONTACT + FORCE)]
# θ̇(0) stands for r, which is in no equation: its tangent starts at 0 and only the impacts drive it
TANGENTS = {
    tasks.RESTITUTION: [OMEGA_N, ZETA, V, X],
    tasks.KELVIN_VOIGT: [OMEGA_N, ZETA, GAMMA, OMEGA0, X],
}
Simulate = Callable[[np.ndarray], np.ndarray]


def _direction(law: str) -> hy.event_direction:
    one_way = law == tasks.RESTITUTION
    return hy.event_direction.negative if one_way else hy.event_direction.any


def _set_parameters(pars: np.ndarray, law: str, values: np.ndarray) -> None:
    """`values` has a row a parameter (and a column a lane, in a batch)."""
    if law == tasks.RESTITUTION:
        pars[:2] = values[:2]
    else:
        pars[:4] = values[:4]
        pars[4] = 1.0


def single(law: str, tolerance: float = TOLERANCE) -> Simulate:
    """Parameters to the samples of T1."""
    r = [0.0]

    def bounce(ta: hy.taylor_adaptive_dbl, _sign: int) -> bool:
        state = ta.state
        state[0] = 0.0
        state[1] *= -r[0]
        return True

    def switch(ta: hy.taylor_adaptive_dbl, _sign: int) -> bool:
        ta.pars[4] = 1.0 - ta.pars[4]
        ta.state[0] = 0.0
        return True

    restitution = law == tasks.RESTITUTION
    event = hy.t_event(X, callback=bounce if restitution else switch, direction=_direction(law))
    ta = hy.taylor_adaptive(BOUNCE[law], [1.0, 0.0], tol=tolerance, t_events=[event])

    def simulate(values: np.ndarray) -> np.ndarray:
        r[0] = values[2]
        _set_parameters(ta.pars, law, values)
        ta.state[:] = (values[-1], 0.0)
        ta.time = 0.0
        ta.reset_cooldowns()
        return ta.propagate_grid(tasks.TIMES)[-1][:, 0]

    return simulate


def batch(law: str, tolerance: float = TOLERANCE) -> Simulate:
    """Parameters of `BATCH` lanes (a column each) to their samples (a row each)."""
    r = np.zeros(BATCH)

    def bounce(ta: hy.taylor_adaptive_batch_dbl, _sign: int, lane: int) -> bool:
        state = ta.state
        state[0, lane] = 0.0
        state[1, lane] *= -r[lane]
        return True

    def switch(ta: hy.taylor_adaptive_batch_dbl, _sign: int, lane: int) -> bool:
        ta.pars[4, lane] = 1.0 - ta.pars[4, lane]
        ta.state[0, lane] = 0.0
        return True

    callback = bounce if law == tasks.RESTITUTION else switch
    event = hy.t_event_batch(X, callback=callback, direction=_direction(law))
    ta = hy.taylor_adaptive_batch(
        BOUNCE[law], np.zeros((2, BATCH)), tol=tolerance, t_events=[event], force_avx512=True
    )
    grid = np.ascontiguousarray(np.repeat(tasks.TIMES[:, None], BATCH, axis=1))

    def simulate(values: np.ndarray) -> np.ndarray:
        r[:] = values[2]
        _set_parameters(ta.pars, law, values)
        ta.state[:] = 0.0
        ta.state[0] = values[-1]
        ta.set_time(0.0)
        ta.reset_cooldowns()
        return ta.propagate_grid(grid)[-1][:, 0].T

    return simulate


def _saltate_bounce(state: np.ndarray, values: np.ndarray) -> None:
    """The impact by restitution with its tangents; `state` is one lane's."""
    r, damping, before = values[2], 2.0 * values[0] * values[1], state[1]
    after = -r * before
    x, v = state[2:6], state[6:10]
    dt = x / -before
    change = -r * (v - damping * before * dt)
    change[2] -= before
    v[:] = change + damping * after * dt
    x[:] = -after * dt
    state[:2] = 0.0, after


def _saltate_switch(state: np.ndarray, pars: np.ndarray) -> None:
    """The switch of the Kelvin-Voigt mode with its tangents; `state` and `pars` are one lane's."""
    flight, contact = 2.0 * pars[0] * pars[1], 2.0 * pars[2] * pars[3]
    gain = contact - flight if pars[4] == 1.0 else flight - contact
    state[7:12] -= gain * state[2:7]
    pars[4] = 1.0 - pars[4]
    state[0] = 0.0


def tangent(law: str, tolerance: float = TOLERANCE) -> Simulate:
    """Parameters to the angle and its derivatives at the samples (a row each)."""
    current = np.zeros(5)

    def event_callback(ta: hy.taylor_adaptive_dbl, _sign: int) -> bool:
        if law == tasks.RESTITUTION:
            _saltate_bounce(ta.state, current)
        else:
            _saltate_switch(ta.state, ta.pars)
        return True

    count = len(TANGENTS[law])
    system = hy.var_ode_sys(BOUNCE[law], TANGENTS[law], order=1)
    event = hy.t_event(X, callback=event_callback, direction=_direction(law))
    ta = hy.taylor_adaptive(system, [1.0, 0.0], tol=tolerance, t_events=[event])

    def simulate(values: np.ndarray) -> np.ndarray:
        current[: values.size] = values
        _set_parameters(ta.pars, law, values)
        ta.state[:] = 0.0
        ta.state[0] = values[-1]
        ta.state[1 + count] = 1.0
        ta.time = 0.0
        ta.reset_cooldowns()
        states = ta.propagate_grid(tasks.TIMES)[-1]
        return states[:, [0, *range(2, 2 + count)]].T

    return simulate


def tangent_batch(law: str, tolerance: float = TOLERANCE) -> Simulate:
    """Parameters of `BATCH` lanes (a column each) to derivatives (lane, parameter, sample)."""
    current = np.zeros((5, BATCH))

    def event_callback(ta: hy.taylor_adaptive_batch_dbl, _sign: int, lane: int) -> bool:
        if law == tasks.RESTITUTION:
            _saltate_bounce(ta.state[:, lane], current[:, lane])
        else:
            _saltate_switch(ta.state[:, lane], ta.pars[:, lane])
        return True

    count = len(TANGENTS[law])
    system = hy.var_ode_sys(BOUNCE[law], TANGENTS[law], order=1)
    event = hy.t_event_batch(X, callback=event_callback, direction=_direction(law))
    ta = hy.taylor_adaptive_batch(
        system, np.zeros((2, BATCH)), tol=tolerance, t_events=[event], force_avx512=True
    )
    grid = np.ascontiguousarray(np.repeat(tasks.TIMES[:, None], BATCH, axis=1))

    def simulate(values: np.ndarray) -> np.ndarray:
        current[: len(values)] = values
        _set_parameters(ta.pars, law, values)
        ta.state[:] = 0.0
        ta.state[0] = values[-1]
        ta.state[1 + count] = 1.0
        ta.set_time(0.0)
        ta.reset_cooldowns()
        return ta.propagate_grid(grid)[-1][:, 2 : 2 + count].transpose(2, 1, 0)

    return simulate


def driven(tolerance: float = TOLERANCE) -> Callable[[tasks.Forcing, np.ndarray], np.ndarray]:
    """Forcing and sample times to samples, Kelvin-Voigt at its nominal parameters."""
    values = tasks.parameters(tasks.KELVIN_VOIGT)

    def switch(ta: hy.taylor_adaptive_dbl, _sign: int) -> bool:
        ta.pars[4] = 1.0 - ta.pars[4]
        ta.state[0] = 0.0
        return True

    event = hy.t_event(X, callback=switch)
    ta = hy.taylor_adaptive(DRIVEN, [1.0, 0.0], tol=tolerance, t_events=[event])

    def simulate(forcing: tasks.Forcing, times: np.ndarray) -> np.ndarray:
        _set_parameters(ta.pars, tasks.KELVIN_VOIGT, values)
        ta.pars[5:] = forcing.ratio * forcing.frequency**2, forcing.frequency
        ta.state[:] = (values[-1], 0.0)
        ta.time = 0.0
        ta.reset_cooldowns()
        ta.propagate_until(times[0])
        return ta.propagate_grid(times)[-1][:, 0]

    return simulate


def driven_batch(
    tolerance: float = TOLERANCE,
) -> Callable[[list[tasks.Forcing], np.ndarray], np.ndarray]:
    """Forcings and sample times of `BATCH` lanes (a row each) to samples (a row each)."""
    values = tasks.parameters(tasks.KELVIN_VOIGT)

    def switch(ta: hy.taylor_adaptive_batch_dbl, _sign: int, lane: int) -> bool:
        ta.pars[4, lane] = 1.0 - ta.pars[4, lane]
        ta.state[0, lane] = 0.0
        return True

    event = hy.t_event_batch(X, callback=switch)
    ta = hy.taylor_adaptive_batch(
        DRIVEN, np.zeros((2, BATCH)), tol=tolerance, t_events=[event], force_avx512=True
    )

    def simulate(forcings: list[tasks.Forcing], times: np.ndarray) -> np.ndarray:
        _set_parameters(ta.pars, tasks.KELVIN_VOIGT, values[:, None])
        ta.pars[5] = [f.ratio * f.frequency**2 for f in forcings]
        ta.pars[6] = [f.frequency for f in forcings]
        ta.state[:] = 0.0
        ta.state[0] = values[-1]
        ta.set_time(0.0)
        ta.reset_cooldowns()
        ta.propagate_until(times[:, 0].tolist())
        return ta.propagate_grid(np.ascontiguousarray(times.T))[-1][:, 0].T

    return simulate
