"""Makes the figures of these pages: `python docs/figures.py`."""

import math
from pathlib import Path

import jax
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
RECORDED, FITTED, MASS = "#8fa3b5", "#b3261e", "#1f4e79"
DEGREES = 180 / math.pi


def main() -> None:
    """A recording of a pendulum at a Kelvin-Voigt stop, its fit, and the residuals."""
    recording = ij.io.read_recording(HERE.parent / "data" / "kelvin_voigt.csv").recording
    assert isinstance(recording, ij.Recording)
    model = ij.ImpactOscillator(
        ij.Pendulum(omega_n=13.0, zeta=0.002, length=0.071), ij.Stop(ij.KelvinVoigt(600.0, 0.2))
    )
    sensor = ij.Sensor(low_pass=ij.Butterworth(50.0))
    estimate = ij.fit(ij.Experiment(model, recording, ij.InitialState(0.78), sensor=sensor))

    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, (above, below) = plt.subplots(
        2, 1, figsize=(9, 4.6), height_ratios=[3.2, 1], sharex=True, layout="constrained"
    )
    ts, angle = np.asarray(recording.ts), np.asarray(recording.values)
    fitted = angle + np.asarray(estimate.residuals)
    above.plot(ts, angle * DEGREES, ".", color=RECORDED, markersize=4, label="recorded")
    above.plot(ts, fitted * DEGREES, color=FITTED, linewidth=1, label="fitted")
    above.axhline(0, color="black", linewidth=0.5)
    above.set(ylabel="angle from the stop [deg]", xlim=(0, 1.4), ylim=(-3, 48))
    above.legend(loc="lower left", bbox_to_anchor=(0.1, 0.84), frameon=False, ncols=2)
    draw_contact(above.inset_axes((0.56, 0.4, 0.42, 0.58)), recording, estimate)

    below.plot(ts, (angle - fitted) * DEGREES, ".", color=FITTED, markersize=2)
    below.axhline(0, color="black", linewidth=0.5)
    below.set(xlabel="time [s]", ylabel="residual [deg]", ylim=(-0.85, 0.85))
    figure.savefig(HERE / "figures" / "fit.png", dpi=125)


def draw_contact(ax: Axes, recording: ij.Recording, estimate: ij.Estimate) -> Axes:
    """The first contact: the motion of the mass, before and after the low-pass filter."""
    begin = float(estimate.impacts.time[0])
    end = begin + float(estimate.impacts.duration[0])
    ts = np.asarray(recording.ts)
    near = (ts > begin - 0.012) & (ts < begin + 0.024)
    fine = np.linspace(ts[near][0], ts[near][-1], 400)
    system = estimate.system
    motion = ij.simulate(system.model, system.initial, fine, t0=float(system.start.t0))
    shown = np.asarray(recording.values + estimate.residuals)
    ax.axvspan(begin * 1e3, end * 1e3, color="#f3e3c3", linewidth=0)
    ax.axhline(0, color="black", linewidth=0.5)
    ax.plot(ts[near] * 1e3, np.asarray(recording.values)[near] * DEGREES, "o", color=RECORDED, ms=4)
    ax.plot(ts[near] * 1e3, shown[near] * DEGREES, color=FITTED, linewidth=1)
    ax.plot(fine * 1e3, np.asarray(motion.position) * DEGREES, "--", color=MASS, linewidth=1)
    ax.text(begin * 1e3 - 11, 1.6, "motion of\nthe mass", color=MASS, va="center")
    ax.text(fine[-1] * 1e3, -0.85, "after the low-pass", color=FITTED, va="center", ha="right")
    ax.text((begin + end) * 5e2, 7.6, f"{(end - begin) * 1e3:.1f} ms", ha="center", va="top")
    ax.set(xlim=(fine[0] * 1e3, fine[-1] * 1e3), ylim=(-1.5, 8), xlabel="time [ms]")
    return ax


if __name__ == "__main__":
    main()
