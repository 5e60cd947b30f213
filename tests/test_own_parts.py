"""Own oscillator, law and quantity go from a file to the report as the built-in ones do."""

import json
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

import impactjax as ij
from records import record_file
from reference import simulate_rigid
from tiers import quick

OMEGA, BETA, R, GAUGE = 20.0, 3e4, 0.7, 0.02
TS = np.arange(500) / 500


class Duffing(ij.AbstractOscillator):
    """A mass on a spring that hardens: x″ + ω_n² x + β x³ = 0."""

    omega_n: Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("rad/s", above=0))
    beta: Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("1/(m² s²)"))
    mass: Array = eqx.field(
        converter=ij.as_parameter, metadata=ij.parameter("kg", above=0, known=True), default=1.0
    )

    def acceleration(self, t, position, velocity):
        return -(self.omega_n**2) * position - self.beta * position**3

    def resistance(self, speed):
        return None

    def lever(self):
        return jnp.ones_like(self.mass)

    def is_angle(self):
        return False


class Constant(ij.AbstractImpactLaw):
    """The same restitution at every speed."""

    kept: Array = eqx.field(
        converter=ij.as_parameter, metadata=ij.parameter("1", at_least=0, at_most=1)
    )

    def restitution(self, speed):
        return self.kept * jnp.ones_like(speed)


class HardeningSpring(ij.AbstractMemorylessLaw):
    """F = k δ (1 + δ²/a²) + c δ′."""

    k: Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("N/m", above=0))
    a: Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("m", above=0))
    c: Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("N s/m", at_least=0))
    separation: ij.AbstractSeparation = ij.AtZeroForce()

    def force(self, penetration, rate, internal, mass):
        return self.k * penetration * (1 + (penetration / self.a) ** 2) + self.c * rate


class Strain(ij.AbstractQuantity):
    """The strain at the foot of the spring."""

    name: ClassVar[str] = "strain"
    units: ClassVar[dict[str, float]] = {"1": 1.0, "µm/m": 1e-6}
    shown: ClassVar[str] = "µm/m"
    of_angle: ClassVar[bool | None] = False

    def value(self, model, trajectory):
        return GAUGE * trajectory.position

    def coordinate(self, ts, values, oscillator):
        return values / GAUGE


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """A file with a sidecar, by SciPy."""

    def flow(t, y):
        return np.array([y[1], -(OMEGA**2) * y[0] - BETA * y[0] ** 3])

    place = simulate_rigid(flow, [0.05, 0.0], TS, lambda speed: R).position
    values = 1e6 * GAUGE * place + 2.0 * np.random.default_rng(6).standard_normal(len(TS))
    sidecar = '[system]\noscillator = "duffing"\nlaws = ["constant"]\n'
    path = tmp_path_factory.mktemp("own") / "strain.csv"
    return record_file(path, "strain [µm/m]", TS, values, sidecar)


def test_parts_in_the_tables_are_found_by_name(record, tmp_path, monkeypatch):
    monkeypatch.setitem(ij.QUANTITIES, "strain", Strain())
    monkeypatch.setitem(ij.OSCILLATORS, "duffing", lambda: Duffing(omega_n=19.0, beta=2.5e4))
    monkeypatch.setitem(ij.LAWS, "constant", lambda look: Constant(look.restitution))
    prepared = ij.prepare(record)
    assert list(prepared.experiments) == ["constant"]
    comparison = ij.compare(prepared, starts=ij.Starts(3))
    estimate = comparison.best.estimate
    for name, truth in (("omega_n", OMEGA), ("beta", BETA), ("kept", R)):
        each = estimate[name]
        assert each.verdict is ij.Verdict.IDENTIFIED
        assert abs(each.value - truth) < 4 * each.standard_error, name
    assert float(estimate.rms) == pytest.approx(2e-6, rel=0.2)
    ij.io.write_report(tmp_path / "report", comparison)
    found = json.loads((tmp_path / "report" / "fit.json").read_text())
    assert found["fits"][0]["law"] == "constant"
    assert "µm/m" in (tmp_path / "report" / "report.html").read_text()
    with pytest.raises(FileExistsError):
        ij.io.write_report(tmp_path / "report", comparison)


def test_arguments_by_position_and_lists_of_numbers():
    """A script in the documented style, also for the type checker, to which a list is no array."""
    heavy = Duffing(OMEGA, BETA, 0.02)
    assert (float(heavy.omega_n), float(heavy.beta), float(heavy.mass)) == (OMEGA, BETA, 0.02)
    assert float(Duffing(OMEGA, beta=BETA).mass) == 1
    spring = HardeningSpring(1e4, 1e-3, 2.0)
    assert (float(spring.a), float(spring.c)) == (1e-3, 2.0)
    assert isinstance(spring.separation, ij.AtZeroForce)
    pulling = HardeningSpring(1e4, 1e-3, 2.0, ij.AtZeroPenetration())
    assert isinstance(pulling.separation, ij.AtZeroPenetration)

    model = ij.ImpactOscillator(Duffing(OMEGA, 0.0), ij.Stop(Constant(R)))
    run = ij.simulate(model, ij.InitialState(0.05), [0.0, 0.03, 0.06])
    np.testing.assert_allclose(run.position, 0.05 * np.cos([0.0, 0.6, 1.2]), rtol=1e-7)
    recording = ij.Recording([0, 1], [0.5, 0.4], ij.Displacement(), valid=[True, False])
    np.testing.assert_array_equal(recording.valid, [True, False])
    assert ij.ImpactTimes([0.1, 0.5, 0.8]).times.shape == (3,)
    elastic = ij.Hertz(1e6).equivalents([0.1, 0.7], 0.02)
    np.testing.assert_allclose(elastic.restitution, [1.0, 1.0], rtol=1e-12)


@quick
@pytest.mark.parametrize(
    ("declared", "words"),
    [
        ({"above": 0, "power": 0}, "must be finite and not zero"),
        ({"above": 0, "power": np.inf}, "must be finite and not zero"),
        ({"power": -1}, "with the power -1 must not be negative"),
        ({"above": 0, "fades": True, "power": -0.5}, "must be left out beside `fades`"),
    ],
)
def test_power_that_no_parameter_has_is_refused(declared, words):
    with pytest.raises(ValueError, match=words):
        ij.parameter("N/m", **declared)
