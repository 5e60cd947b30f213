"""Steady motions of the shaken pendulum by both laws, and the figures that compare them."""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import impactjax as ij
from impactjax._thesis.claim import Claim, judged
from impactjax._thesis.constants import RECORD, Case
from impactjax._thesis.drawing import RECORDED, RIGID, SOFT, Made, panels, shared, zero
from impactjax._thesis.motions import PERIODS, Lane, Motion, period, rigid, runs, soft, strobe
from impactjax._thesis.record import DELAY, LOST, recorded
from impactjax._thesis.spectrum import exact_peak, peak, power

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = 20.0, 22.0  # the window of the thesis's figures [s]
_EVERY = 1e-3  # interval of the records [s]


class Steady(NamedTuple):
    """A steady motion by one law.

    - `record`: 15 s from 20 s on, at 1 kHz.
    - `whole`: the same motion over whole periods of the base.
    """

    record: Motion
    whole: Motion

    @property
    def period(self) -> int:
        """Periods of the base after which it repeats; 0 if it does not."""
        return period(self.whole)

    @property
    def peak(self) -> float:
        """Frequency of the largest line in a record of 15 s [Hz]."""
        return peak(self.record.position, _EVERY)


def steady(model: ij.ImpactOscillator, case: Case) -> Steady:
    """The steady motion that follows from rest at 0.2 rad."""
    return Steady(*runs([Lane(model, 0.2, SHOWN[0], _EVERY), strobe(model, case.omega)]))


class Compared(NamedTuple):
    """A case of chapter 4 with both laws."""

    case: Case
    rigid: Steady
    soft: Steady

    def drawn(self, *claims: Claim) -> Made:
        """The four panels of the thesis's figures, and the claims."""
        drawn, (first, second, third, fourth) = panels(2, 2, 5.8)
        measured = recorded(self.soft.record)
        both = ("restitution", self.rigid, RIGID, first), ("Kelvin-Voigt", self.soft, SOFT, second)
        for name, each, colour, ax in both:
            _draw_time(ax, measured, self._aligned(each, measured), colour, name)
            self._draw_spectrum(fourth, each.record.position, colour, name)
        self._draw_spectrum(third, measured, RECORDED, LOST)
        shared(drawn, (first, second))
        return Made(drawn, claims)

    def _aligned(self, each: Steady, measured: np.ndarray) -> np.ndarray:
        """The angle of a motion, earlier by the whole number of periods of the base with which it
        follows the record best: a subharmonic motion exists at each of them.
        """
        count = max(each.period, 1) if self.soft.period else 1  # nothing follows chaos
        step = 2 * math.pi / self.case.omega / _EVERY
        size = measured.size - round(count * step)
        starts = [round(k * step) for k in range(count)]
        moved = [each.record.position[start : start + size] for start in starts]
        return min(moved, key=lambda angle: np.std(angle - measured[:size]))

    def _draw_spectrum(self, ax: "Axes", angle: np.ndarray, colour: str, name: str) -> None:
        frequencies, density = power(np.degrees(angle), _EVERY)
        near = (frequencies > 0) & (frequencies <= 5 * self.case.omega / (2 * math.pi))
        ax.semilogy(frequencies[near], density[near], color=colour, linewidth=0.8, label=name)
        ax.set(xlabel="frequency [Hz]", ylabel="power density [deg²/Hz]", xlim=(0, None))

    def periods(self, figure: str, thesis: int) -> tuple[Claim, ...]:
        """A claim for each law on the period, in periods of the base."""
        pairs = ("restitution", self.rigid), ("Kelvin-Voigt", self.soft)
        return tuple(
            Claim(
                figure,
                f"period of the motion, {name}",
                f"{thesis} of the base",
                f"{each.period} of the base",
                judged(each.period == thesis),
                "" if each.period == thesis else "the steady motion repeats otherwise",
            )
            for name, each in pairs
        )

    def peaks(self, figure: str) -> tuple[Claim, ...]:
        """The largest line of a 15 s record, and of the motion itself."""
        found = [each.peak for each in (self.rigid, self.soft)]
        true = exact_peak(self.soft.whole.position, self.case.omega, PERIODS)
        line = 1 / RECORD
        agrees = all(abs(each - self.case.peak) < line / 2 for each in found)
        exact = abs(true - self.case.peak) < 5e-3
        return (
            Claim(
                figure,
                "largest line of the spectrum of 15 s",
                f"{self.case.peak:g} Hz",
                f"{found[0]:.4f} and {found[1]:.4f} Hz",
                judged(agrees),
                "" if agrees else "another line is the largest",
            ),
            Claim(
                figure,
                "frequency of the largest line of the motion itself",
                f"{self.case.peak:g} Hz",
                f"{true:.4f} Hz",
                judged(exact),
                "" if exact else f"the printed value is the nearest line of a {RECORD:g} s record",
            ),
        )


def compared(case: Case) -> Compared:
    """A case with both laws."""
    return Compared(case, steady(rigid(case), case), steady(soft(case), case))


def _draw_time(ax: "Axes", measured: np.ndarray, angle: np.ndarray, colour: str, name: str) -> None:
    ts = SHOWN[0] + _EVERY * np.arange(angle.size)
    shown = (ts >= SHOWN[0]) & (ts <= SHOWN[1] + DELAY)
    record = np.degrees(measured[: angle.size])[shown]
    ax.plot(ts[shown] - DELAY, record, ".", color=RECORDED, markersize=2, label=LOST)
    ax.plot(ts[shown], np.degrees(angle)[shown], color=colour, linewidth=1, label=name)
    ax.set(xlim=SHOWN, xlabel="time t [s]", ylabel="angle θ [deg]")
    ax.locator_params(axis="x", nbins=5)
    zero(ax)
