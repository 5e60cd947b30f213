"""Penetration and force of contacts in the report, against those of the simulated motion."""

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from impactjax._report.contacts import contacts_of

STIFF = ij.KelvinVoigt(700.0, 0.2)


def simulated(lower, upper=None):
    pendulum = ij.Pendulum(13.47, 0.0017, length=0.071, mass=0.02)
    model = ij.ImpactOscillator(pendulum, lower, upper)
    run = ij.simulate(model, ij.InitialState(0.2), jnp.linspace(0.01, 1.5, 5), t0=0.0)
    assert int(run.impacts.count) >= 3
    return model, jax.device_get(run)


def test_penetration_and_force_of_a_stiff_stop_are_those_of_the_motion():
    """The weight is small beside the force of the contact."""
    model, run = simulated(ij.Stop(STIFF))
    found, some = contacts_of(model, run.impacts), run.impacts.happened
    assert found.soft[some].all()
    np.testing.assert_allclose(found.penetration[some], run.deepest_penetration[some], rtol=0.01)
    np.testing.assert_allclose(found.force[some], run.peak_force[some], rtol=0.01)
    assert np.isnan(found.penetration[~some]).all()


def test_stop_of_each_impact_decides():
    model, run = simulated(ij.Stop(ij.Restitution(0.7), gap=0.05), ij.Stop(STIFF, gap=0.05))
    found, some = contacts_of(model, run.impacts), run.impacts.happened
    assert {*run.impacts.stop[some].tolist()} == {0, 1}
    np.testing.assert_array_equal(found.soft[some], run.impacts.stop[some] == 1)
    np.testing.assert_array_equal(np.isfinite(found.force[some]), run.impacts.stop[some] == 1)


def test_law_without_closed_form_has_neither():
    model, run = simulated(ij.Stop(ij.HertzDashpot(4e6, 6.0)))
    found, some = contacts_of(model, run.impacts), run.impacts.happened
    assert found.soft[some].all()
    assert np.isnan(found.penetration).all()
    assert np.isnan(found.force).all()
