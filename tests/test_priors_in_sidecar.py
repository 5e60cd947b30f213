"""Values measured before, in the table [priors] of a sidecar."""

import pytest

import impactjax as ij
from command import impactjax

TIMES = "impact time [s]\n0.0\n0.5\n0.95\n1.35\n1.71\n2.03\n"


def with_sidecar(folder, text):
    path = folder / "bounces.csv"
    path.write_text(TIMES)
    path.with_suffix(".toml").write_text(text)
    return path


def test_sidecar_states_a_prior(tmp_path):
    path = with_sidecar(tmp_path, "[priors]\nr = [0.9, 0.0005]\nmass = [0.02, 0.001]\n")
    own = ij.prepare(path, laws=["restitution"]).experiment
    assert {name: (float(x.mean), float(x.sigma)) for name, x in own.priors.items()} == {
        "r": (0.9, 0.0005),
        "mass": (0.02, 0.001),
    }
    assert "mass" in own.free
    assert float(own.model.oscillator.mass) == 0.02
    other = ij.prepare(path, laws=["restitution"], fixed={"r": 0.8, "mass": 0.02}).experiment
    assert not other.priors
    told = ij.prepare(path, laws=["restitution"], priors={"r": ij.Normal(0.8, 0.1)}).experiment
    assert float(told.priors["r"].mean) == 0.8


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[priors]\nrr = [0.9, 0.1]", "line 2: there is no parameter `rr`"),
        ("[priors]\nr = 0.9", "line 2: `priors.r` cannot be used"),
        ("[priors]\nr = [0.9]", "line 2: `priors.r` cannot be used"),
        ("[priors]\nr = [0.9, 0.0]", "line 2: `priors.r[1]` cannot be used"),
        ("[fixed]\nr = 0.9\n[priors]\nr = [0.9, 0.1]", "`r` is in both `priors` and `fixed`"),
    ],
)
def test_sidecar_with_impossible_priors_is_one_sentence(tmp_path, text, says):
    path = with_sidecar(tmp_path, text + "\n")
    run = impactjax("fit", path, "--law", "restitution")
    assert run.status == 2
    assert says in " ".join(run.stderr.split())
