"""Lyapunov exponents of impact oscillators, against an identity and mechanisms."""

import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.figure import Figure

import impactjax as ij
from tiers import mostly_thorough

OMEGA, ZETA, R = 13.47, 0.0017, 0.6
COUNT, SETTLE = 64, 30
SERIES = ij.TaylorStep(order=8)  # compiles faster than the usual one
RIGID, COMPLIANT = ij.Restitution(R), ij.KelvinVoigt(725.0, 0.16)
START = ij.InitialState(0.3)


def forced(law, hertz, amplitude=3e-3):
    base = ij.HarmonicMotion(amplitude, 2 * np.pi * hertz)
    pendulum = ij.Pendulum(OMEGA, zeta=ZETA, length=0.071, base=base)
    return ij.ImpactOscillator(pendulum, ij.Stop(law))


def frequency(model):
    return model.oscillator.base.frequency


def period(model):
    return 2 * np.pi / frequency(model)


def exponents(model, settle=SETTLE):
    return ij.lyapunov(
        model, START, period, count=COUNT, settle=settle, tolerance=1e-11, step=SERIES
    )


def simulated(model, ts):
    return ij.simulate(model, START, ts, t0=0.0, step=SERIES, max_steps=8192, max_impacts=2048)


@pytest.mark.parametrize("hertz", mostly_thorough([9.0, 4.9], 9.0))
def test_sum_of_exponents_of_impacts(hertz):
    """Areas shrink at the rate 2 ζ ω, and by r² at each impact: the rest is a whole number."""
    model = forced(RIGID, hertz)
    found = exponents(model)
    assert found.result == ij.RESULTS.successful
    time = COUNT / hertz
    impacts = (found.sum.item() + 2 * ZETA * OMEGA) * time / (2 * np.log(R))
    run = simulated(model, [time + SETTLE / hertz])
    times = np.asarray(run.impacts.time)[: int(run.impacts.count)]
    counted = np.sum((times > SETTLE / hertz) & (times < (SETTLE + COUNT) / hertz))
    assert impacts == pytest.approx(int(counted), abs=1e-6)


@pytest.mark.parametrize(
    "law",
    mostly_thorough([RIGID, COMPLIANT], RIGID),
    ids=lambda law: type(law).__name__,
)
def test_exponents_are_those_of_the_mechanism(law):
    model = forced(law, 9.0)
    system = ij.MechanicalSystem(ij.OscillatorMechanism(model))
    found = exponents(model)
    start = system.start(0.0, [0.3], [0.0])
    other = ij.lyapunov(system, start, 1 / 9, count=COUNT, settle=SETTLE)
    np.testing.assert_allclose(found.sum, other.sum, rtol=1e-6)
    np.testing.assert_allclose(found.values, other.values, atol=0.05)  # directions still turn


def test_disturbances_die_out_at_rest():
    """At 1 Hz the pendulum rests on its stop in every period, and then forgets all before."""
    found = exponents(forced(RIGID, 1.0, 33.2e-3))
    np.testing.assert_array_equal(found.values, -np.inf)
    assert np.all(np.isnan(found.errors))


def test_figure_of_exponents():
    """Exponents of −∞ leave gaps."""
    values = jnp.array([[1.0, -2.0], [-np.inf, -np.inf], [0.5, -3.0]])
    unused = jnp.zeros((3, 2))
    found = ij.Exponents(values, unused, unused[:, None], ij.Start(0.0, {}), ij.RESULTS.successful)
    ax = Figure().subplots()
    ij.plot.exponents(ax, found, np.arange(3.0))
    np.testing.assert_array_equal(np.asarray(ax.lines[2].get_ydata()), [1.0, np.nan, 0.5])
    np.testing.assert_array_equal(np.asarray(ax.lines[1].get_ydata()), [-2.0, np.nan, -3.0])


def test_exponents_over_frequencies_are_those_of_each():
    """Motions that have settled, whatever the rounding of the start."""
    model, settle = forced(COMPLIANT, 9.0), 120
    omegas = 2 * np.pi * np.array([8.5, 9.0])
    found = ij.lyapunov_diagram(
        model,
        START,
        period,
        frequency,
        omegas,
        count=COUNT,
        settle=settle,
        tolerance=1e-11,
        step=SERIES,
    )
    assert found.values.shape == found.errors.shape == (2, 2)
    assert found.growth.shape == (2, COUNT, 2)
    alone = exponents(model, settle)
    np.testing.assert_allclose(found.values[1], alone.values, rtol=1e-7)


def test_end_of_the_motion_goes_on():
    model = forced(RIGID, 9.0)
    final = exponents(model).final
    assert not isinstance(final, ij.Start)
    end = (SETTLE + COUNT) / 9
    ts = jnp.array([end + 0.05])
    later = ij.simulate(model, final, ts, step=SERIES)
    whole = simulated(model, ts)
    np.testing.assert_allclose(later.position, whole.position, atol=1e-9)
