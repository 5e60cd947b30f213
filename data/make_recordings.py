"""Makes the recordings of this folder: `python data/make_recordings.py`.

A pendulum like the thesis's, released at rest from 45 degrees; its angle passes a 50 Hz low-pass of
second order and is sampled at 1 kHz with 0.2 degrees of white noise. The truth goes into the
sidecars, where the fit does not look.
"""

import math
from pathlib import Path

import jax
import numpy as np

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
LENGTH, MASS = 0.071, 0.020
NOISE = math.radians(0.2)

LAWS: dict[str, tuple[ij.AbstractImpactLaw | ij.AbstractForceLaw | None, dict[str, float]]] = {
    "free_decay": (None, {}),
    "restitution": (ij.Restitution(0.577), {"r": 0.577}),
    "linear_restitution": (ij.LinearRestitution(0.68, 0.28), {"r0": 0.68, "alpha": 0.28}),
    "kelvin_voigt": (ij.KelvinVoigt(727.5, 0.18), {"omega0": 727.5, "gamma": 0.18}),
}


def main() -> None:
    """Writes a recording and a sidecar for each law."""
    generator = np.random.default_rng(2005)
    for name, (law, parameters) in LAWS.items():
        seconds = 5.0 if law is None else 1.4
        ts = np.arange(round(1000 * seconds) + 1) / 1000
        model = ij.ImpactOscillator(
            ij.Pendulum(13.47, 0.0017, length=LENGTH, mass=MASS),
            None if law is None else ij.Stop(law),
        )
        start = ij.InitialState(math.radians(45))
        trajectory = ij.simulate(model, start, ts, tolerance=1e-12)
        sensor = ij.Sensor(low_pass=ij.Butterworth(50.0, order=2))
        shown = np.asarray(sensor.shown(model, trajectory, ij.Angle()))
        write(name, ts, shown + NOISE * generator.standard_normal(len(ts)), parameters)


def write(name: str, ts: np.ndarray, angle: np.ndarray, law: dict[str, float]) -> None:
    """One recording and its sidecar."""
    rows = [f"{t:.3f}, {math.degrees(a):.3f}" for t, a in zip(ts, angle, strict=True)]
    (HERE / f"{name}.csv").write_text("\n".join(["time [s], angle [deg]", *rows]) + "\n")
    truth = {"omega_n": 13.47, "zeta": 0.0017, "theta0": math.radians(45), "theta_dot0": 0.0, **law}
    lines = [
        "[system]",
        'oscillator = "pendulum"',
        "dry_friction = false",
        *(['separation = "zero-penetration"'] if law else []),
        "",
        "[fixed]",
        f"length = {LENGTH}",
        f"mass = {MASS}",
        "",
        "[sensor]",
        "cutoff = 50.0",
        "order = 2",
        "gain = 1.0",
        "offset = 0.0",
        "",
        "[truth]  # what the recording was made from; the fit does not read it",
        *(f"{key} = {value:.17g}" for key, value in truth.items()),
    ]
    (HERE / f"{name}.toml").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
