"""Every way a lane may end is reached, is said in words, and disturbs no other lane."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

import impactjax as ij
from impactjax._series.crossing import Crossing
from impactjax._simulate import taylor_step
from systems import Own

TIMES = np.linspace(0.0, 1.0, 6)
RESULTS = ij.RESULTS

# One lane of each kind in one batch: omega_n, r0, alpha, gap, x0, v0, tolerance, last time.
LANES = {
    "successful": (13.0, 0.6, 0.1, 0.0, 0.2, 0.1, 1e-8, 1.0),
    "max_steps_reached": (4000.0, 1.0, 0.0, 0.0, 0.2, 0.1, 1e-8, 1.0),
    "max_impacts_reached": (40.0, 0.9, 0.0, 0.0, 0.2, 0.1, 1e-5, 1.0),
    "starts_inside_stop": (13.0, 0.6, 0.1, 0.0, -0.2, 0.1, 1e-8, 1.0),
    "times_out_of_order": (13.0, 0.6, 0.1, 0.0, 0.2, 0.1, 1e-8, 0.1),
    "impossible_parameters": (13.0, 1.6, 0.1, 0.0, 0.2, 0.1, 1e-8, 1.0),
    "restitution_out_of_range": (13.0, 0.6, 0.5, 0.0, 0.2, 0.1, 1e-8, 1.0),
    "time_too_coarse": (60.0, 0.6, 0.1, 1.0, 0.2, 0.1, 1e-14, 1.0),
    "tolerance_too_small": (13.0, 0.6, 0.1, 0.0, 0.2, 0.1, 1e-16, 1.0),
    "non_finite": (13.0, 0.6, 0.1, 0.0, 0.2, np.inf, 1e-8, 1.0),
}


@jax.jit
@jax.vmap
def run_lanes(lane):
    omega_n, r0, alpha, gap, position, velocity, tolerance, last = lane
    model = ij.ImpactOscillator(
        ij.LinearOscillator(omega_n), ij.Stop(ij.LinearRestitution(r0, alpha), gap)
    )
    return ij.simulate(
        model,
        ij.InitialState(position, velocity),
        jnp.asarray(TIMES).at[-1].set(last),
        t0=0.0,
        tolerance=tolerance,
        max_steps=128,
        max_impacts=8,
    )


def one_of_each():
    return run_lanes(jnp.array(list(LANES.values())))


def lane(run, i):
    return jax.tree.map(lambda x: x[i], run)


def test_lanes_have_result_codes():
    run = one_of_each()
    for i, name in enumerate(LANES):
        result = lane(run.result, i)
        assert result == getattr(RESULTS, name), (name, RESULTS[result])


def test_failing_lanes_do_not_change_others():
    good = LANES["successful"]
    among_good = run_lanes(jnp.array([good] * len(LANES)))
    among_bad = one_of_each()
    for alone, among in zip(
        jax.tree.leaves(lane(among_good, 0)), jax.tree.leaves(lane(among_bad, 0)), strict=True
    ):
        np.testing.assert_array_equal(alone, among)


def test_samples_after_failure_are_nan():
    run = one_of_each()
    names = list(LANES)
    right = run.position[names.index("successful")]
    unharmed = names.index("max_impacts_reached")
    assert np.all(np.isfinite(run.position[unharmed]))
    failed = names.index("restitution_out_of_range")
    assert np.all(np.isnan(run.position[failed][1:]))
    assert run.position[failed][0] == right[0]
    for name in ("starts_inside_stop", "impossible_parameters", "tolerance_too_small"):
        assert np.all(np.isnan(run.position[names.index(name)][1:]))


def test_tunnelling_gives_result_code(monkeypatch):
    def nothing(coefficients, settle, margin=0.0):
        return Crossing(jnp.full_like(coefficients[0], jnp.inf), jnp.zeros_like(settle))

    monkeypatch.setattr(taylor_step, "first_crossing", nothing)
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.5)))
    run = ij.simulate(model, ij.InitialState(0.1), TIMES, step=ij.TaylorStep(order=9))
    assert run.result == RESULTS.stopped_through
    assert np.all(np.isnan(run.position[-2:]))


def test_divergence_gives_step_too_small():
    """x″ = 6 x²: from x = 1, x′ = 2 it is (1 − t)⁻², infinite at t = 1."""
    model = ij.ImpactOscillator(Own(law=lambda t, x, v: 6 * x**2))
    run = ij.simulate(model, ij.InitialState(1.0, 2.0), 2 * TIMES, max_steps=4096)
    assert run.result == RESULTS.step_too_small
    np.testing.assert_allclose(run.position[:3], 1 / (1 - 2 * TIMES[:3]) ** 2, rtol=1e-6)
    assert np.all(np.isnan(run.position[-2:]))


def test_all_result_codes_occur_and_name_a_remedy():
    of_hybrid_systems = ["max_events_reached", "event_repeats"]
    of_orbits = ["no_orbit_found", "another_itinerary"]
    reached = [*LANES, "stopped_through", "step_too_small", *of_hybrid_systems, *of_orbits]
    messages = {RESULTS[getattr(RESULTS, name)] for name in reached}
    assert len(messages) == len(RESULTS)
    for message in messages - {"successful"}:
        assert message.endswith(".")
        assert len(message.split()) > 8


def test_samples_before_start_are_nan():
    """Known times would raise before the run; here they are traced."""

    def go(t0):
        model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.8)))
        return ij.simulate(model, ij.InitialState(0.2), jnp.asarray(TIMES), t0=t0)

    run = jax.jit(go)(5.0)
    assert run.result == RESULTS.times_out_of_order
    assert jnp.all(jnp.isnan(run.position))


def test_non_numeric_model_part_is_named():
    class Shaped(ij.AbstractImpactLaw):
        shape: Callable[[Array], Array]

        def restitution(self, speed: Array) -> Array:
            return self.shape(speed)

    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(Shaped(jnp.tanh)))
    with pytest.raises(ValueError, match=r"`.*lower.law.shape` .* static field"):
        ij.simulate(model, ij.InitialState(0.2), TIMES)
