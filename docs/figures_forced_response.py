"""Makes the figures of the page on forced response: `python docs/figures_forced_response.py`."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from page_code import names_of

import impactjax as ij

HERE = Path(__file__).parent
PAGE = names_of("forced-response.md")
Mass, rest, amplitude = PAGE["Mass"], PAGE["rest"], PAGE["amplitude"]


def main() -> None:
    """Branches at two frequencies, the doublings at one of them, and a diagram over the same."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 3.0), layout="constrained")
    for frequency, first in ((0.81, 0.36), (0.799, 0.363)):
        mass = Mass(first, frequency)
        orbit = ij.periodic_orbit(mass, rest, Mass.period, multiple=2, settle=200)
        branch = ij.follow(orbit, amplitude, (0.34, 0.37), longest=0.02)
        draw(axes[0], branch)
        if frequency == 0.81:
            draw(axes[1], branch)
            (doubling,) = [each for each in branch.special if each.kind == "period doubling"]
            draw(axes[1], ij.follow(ij.doubled(doubling.orbit), amplitude, (0.34, 0.37)))
    axes[0].annotate("ω = 0.81", (0.3478, 0.29))
    axes[0].annotate("ω = 0.799", (0.3615, 0.16), ha="right")
    axes[0].set(ylim=(0, 0.4), xlim=(0.3445, 0.3645))
    axes[1].set(ylim=(0, 0.13), xlim=(0.3452, 0.3492))
    for ax in axes[:2]:
        ax.set(xlabel="amplitude A", ylabel="impact speed")
    values = np.linspace(0.3492, 0.3452, 800)
    found = ij.diagram(
        *(Mass(0.35, 0.81), rest, Mass.period, amplitude, values),
        sweep=ij.WithMemory(),
        keep=64,
        skip=300,
    )
    ij.plot.diagram(axes[2], found, found.states["x"])
    axes[2].set(xlabel="amplitude A", ylabel="x after each period", xlim=(0.3452, 0.3492))
    for ax in axes:
        ax.locator_params(axis="x", nbins=5)
    figure.savefig(HERE / "figures" / "forced-response.png", dpi=125)
    figure, axes = plt.subplots(2, 1, figsize=(7.2, 4.2), sharex=True, layout="constrained")
    draw_exponents(axes)
    figure.savefig(HERE / "figures" / "exponents.png", dpi=125)
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 2.8), layout="constrained")
    draw_records(axes)
    figure.savefig(HERE / "figures" / "from-a-record.png", dpi=125)
    figure, ax = plt.subplots(figsize=(5.4, 3.4), layout="constrained")
    draw_basins(ax)
    figure.savefig(HERE / "figures" / "basins.png", dpi=125)
    figure, ax = plt.subplots(figsize=(5.4, 3.0), layout="constrained")
    draw_borders(ax, PAGE["branch"], PAGE["double"])
    figure.savefig(HERE / "figures" / "borders.png", dpi=125)


def draw_records(axes: Sequence[Axes]) -> None:
    """Spectra of a motion of two periods of the force and of a chaotic one, and its divergence."""
    frequency = 0.81 / (2 * np.pi)
    every = ij.Every(1 / frequency / 32)
    for ax, force in zip(axes[:2], (0.36, 0.3465), strict=True):
        mass = Mass(force, 0.81)
        record = ij.section(mass, rest, every, skip=32 * 300, keep=32 * 128).after["x"]
        ij.plot.spectrum(ax, record, 1 / frequency / 32, frequency, 2)
        ax.set(xlim=(0, 6 * frequency), ylim=(1e-12, 1e3))
    ij.plot.divergence(axes[2], PAGE["told"])


def draw_exponents(axes: Sequence[Axes]) -> None:
    """The angles of the page's first pendulum over the frequency, and its exponents."""
    model, hertz = PAGE["system"].mechanism.model, np.linspace(4.5, 11.0, 800)
    swept = PAGE["begin"], PAGE["period"], PAGE["rate"], 2 * np.pi * hertz
    found = ij.diagram(model, *swept, keep=100, skip=200)
    axes[0].plot(hertz, found.states["position"], ",", color="0.2")
    axes[0].set(ylabel="angle [rad]")
    ij.plot.exponents(axes[1], ij.lyapunov_diagram(model, *swept), hertz)
    axes[1].set(xlabel="frequency [Hz]", ylabel="exponents [1/s]", ylim=(-30, 8))


def draw_basins(ax: Axes) -> None:
    """The basins of the page's pendulum, on a finer grid."""
    angle, velocity = np.meshgrid(np.linspace(-0.19, 1.5, 150), np.linspace(-15, 15, 150))
    starts = ij.InitialState(angle.ravel(), velocity.ravel())
    found = ij.basins(PAGE["model"], starts, 1 / 9)
    ij.plot.basins(ax, found, angle.ravel(), velocity.ravel())
    ax.set(xlabel="angle [rad]", ylabel="velocity [rad/s]")


def draw_borders(ax: Axes, branch: ij.Branch, double: ij.Orbit) -> None:
    """The amplitudes of two period doublings above that of grazing, over the frequency."""
    again = ij.follow(double, amplitude, (0.34, 0.37))
    for own, periods in ((branch, 2), (again, 4)):
        special = next(each for each in own.special if each.kind == "period doubling")
        border = ij.special_curve(special, PAGE["frequency"], (0.79, 0.83), (0.2, 0.5))
        grazing = np.hypot(1 - border.second**2, 0.04 * border.second)
        ax.plot(border.second, 1e3 * (border.first - grazing), label=f"{periods} to {2 * periods}")
    ax.axhline(0, color="0.4", lw=1, label="grazing")
    ax.legend(frameon=False, title="periods of the force")
    ax.set(xlabel="frequency ω", ylabel="1000 (A − A of grazing)")


def draw(ax: Axes, branch: ij.Branch) -> None:
    """The speeds of all impacts of a branch."""
    for column in branch.before["v"].T:
        ij.plot.branch(ax, branch, column)


if __name__ == "__main__":
    main()
