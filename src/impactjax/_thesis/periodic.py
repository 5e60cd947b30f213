"""Figures 4.1, 4.2, 4.3 and 4.7: steady motions of the shaken pendulum and their spectra."""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import impactjax as ij
from impactjax._thesis.claim import Claim, judged
from impactjax._thesis.constants import (
    AT_4_HZ,
    AT_8_HZ,
    AT_10_HZ,
    AT_15_HZ,
    RECORD,
    Case,
    damping_of,
    restitution_of,
)
from impactjax._thesis.drawing import RECORDED, RIGID, SOFT, Made, named, panels, zero
from impactjax._thesis.hybrid import soft_system
from impactjax._thesis.motions import PERIODS, Lane, Motion, period, rigid, runs, soft, strobe
from impactjax._thesis.record import LOST, recorded
from impactjax._thesis.spectrum import exact_peak, peak, power
from impactjax._thesis.stuck import stuck_from

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


def steady(model: ij.ImpactOscillator, case: Case) -> Steady:
    """The steady motion that follows from rest at 0.2 rad."""
    lanes = [Lane(model, 0.2, SHOWN[0], _EVERY), strobe(model, case.omega)]
    return Steady(*runs(lanes))


def figure_4_1() -> Made:
    """Forced response at 4.2 Hz."""
    made = _compared(AT_4_HZ)
    back = restitution_of(0.14)
    return made.drawn(
        *made.periods("4.1", 1),
        *made.peaks("4.1"),
        _harmonics(made.soft),
        Claim(
            "4.1",
            "γ = 0.14 and r = 0.65 of the caption",
            "the same",
            f"γ = {damping_of(0.65):.3f} for r = 0.65, r = {back:.3f} for γ = 0.14",
            judged(round(damping_of(0.65), 2) == 0.14),
        ),
    )


def figure_4_2() -> Made:
    """Forced response at 8 Hz."""
    made = _compared(AT_8_HZ)
    back = restitution_of(0.165)
    return made.drawn(
        *made.periods("4.2", 2),
        *made.peaks("4.2"),
        Claim(
            "4.2",
            "γ = 0.165 and r = 0.60 of the caption",
            "the same",
            f"γ = {damping_of(0.6):.4f} for r = 0.60, r = {back:.3f} for γ = 0.165",
            judged(round(damping_of(0.6), 3) == 0.165),
            "the printed γ belongs to another r",
        ),
    )


def figure_4_3() -> Made:
    """Forced response at 15 Hz."""
    made = _compared(AT_15_HZ)
    turns = _turns_in_flight(made.soft)
    speeds = made.rigid.whole.late(made.rigid.whole.impacts.approach_speed)
    at = stuck_from(made.rigid.record)
    return made.drawn(
        *made.periods("4.3", 4),
        *made.peaks("4.3"),
        Claim(
            "4.3",
            "the angle turns during free flight",
            "turns",
            f"{turns:.0f} maxima for each impact above 5 mm/s",
            judged(turns > 1),
        ),
        Claim(
            "4.3",
            "secondary impacts of low velocity",
            "present",
            f"from {1e3 * speeds.max():.0f} mm/s down to {1e3 * np.sort(speeds)[0]:.1g} mm/s",
            judged(bool(speeds.min() < 0.2 * speeds.max())),
        ),
        Claim(
            "4.3",
            "the restitution model of the thesis, which stays at rest, moves",
            "moves",
            f"at rest for ever from {at:.2f} s on",
            judged(math.isinf(at)),
            "its impacts come to an end in every fourth period; the figure moves, so that its "
            "program cannot have stopped there",
        ),
    )


def figure_4_7() -> Made:
    """Forced response at 10 Hz."""
    made = _compared(AT_10_HZ)
    exponent, error = _exponent(AT_10_HZ)
    rigid_period = made.rigid.period
    return made.drawn(
        Claim(
            "4.7",
            "chaos with the Kelvin-Voigt contact",
            "chaotic, from a broad spectrum",
            f"largest Lyapunov exponent {exponent:.2f} ± {error:.2f} /s",
            judged(exponent > 3 * error and made.soft.period == 0),
        ),
        Claim(
            "4.7",
            "chaos with restitution",
            "chaotic, from a broad spectrum",
            f"period {rigid_period}" if rigid_period else "no period up to 20",
            judged(rigid_period == 0),
            "the motion repeats after eight periods of the base with the printed r0 = 0.6, "
            "α = 0.05 s/m",
        ),
        Claim(
            "4.7",
            "the two laws predict this motion equally well",
            "equally valid",
            "one chaotic, one periodic",
            judged((rigid_period == 0) == (made.soft.period == 0)),
            "it does not hold for the printed parameters",
        ),
        Claim(
            "4.7",
            "largest line of the spectrum",
            "3.1333 and 3.3333 Hz",
            f"{made.peak(made.rigid):.4f} and {made.peak(made.soft):.4f} Hz",
            judged(False),
            "the printed values are lines of a 15 s record, 47/15 and 50/15 Hz; a chaotic motion "
            "has no line that repeats from record to record",
        ),
    )


class _Compared(NamedTuple):
    """A case with both laws."""

    case: Case
    rigid: Steady
    soft: Steady

    def peak(self, each: Steady) -> float:
        return peak(each.record.position, _EVERY)

    def drawn(self, *claims: Claim) -> Made:
        """The four panels of the thesis's figures, and the claims."""
        drawn, (first, second, third, fourth) = panels(2, 2, 5.6)
        measured = recorded(self.soft.record)
        pairs = ((first, self.rigid, "restitution", RIGID), (second, self.soft, "K.-Voigt", SOFT))
        for ax, each, name, colour in pairs:
            _draw_time(ax, measured, each, name, colour)
        _draw_spectrum(third, measured, self.case, RECORDED, LOST)
        for each, colour, name in (
            (self.rigid, RIGID, "restitution"),
            (self.soft, SOFT, "K.-Voigt"),
        ):
            _draw_spectrum(fourth, each.record.position, self.case, colour, name)
        return Made(drawn, claims)

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
        found = [self.peak(each) for each in (self.rigid, self.soft)]
        true = exact_peak(np.asarray(self.soft.whole.position), self.case.omega, PERIODS)
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


def _compared(case: Case) -> _Compared:
    return _Compared(case, steady(rigid(case), case), steady(soft(case), case))


def _draw_time(ax: "Axes", measured: np.ndarray, each: Steady, name: str, colour: str) -> None:
    ts = each.record.ts
    shown = ts <= SHOWN[1]
    ax.plot(ts[shown], np.degrees(measured)[shown], ".", color=RECORDED, markersize=2, label=LOST)
    ax.plot(ts[shown], np.degrees(each.record.position)[shown], color=colour, lw=1, label=name)
    ax.set(xlim=SHOWN, xlabel="time t [s]", ylabel="angle θ [deg]")
    ax.set(ylim=(None, 1.3 * np.degrees(np.max(measured))))
    zero(ax)
    named(ax, ncols=2, loc="upper right")


def _draw_spectrum(ax: "Axes", angle: np.ndarray, case: Case, colour: str, name: str) -> None:
    frequencies, density = power(np.degrees(angle), _EVERY)
    near = (frequencies > 0) & (frequencies <= 5 * case.omega / (2 * math.pi))
    ax.semilogy(frequencies[near], density[near], color=colour, linewidth=0.8, label=name)
    ax.set(xlabel="frequency [Hz]", ylabel="power density [deg²/Hz]", xlim=(0, None))
    named(ax, loc="upper right")


def _harmonics(each: Steady) -> Claim:
    """Share of the power of the motion at multiples of the frequency of the base."""
    angle = each.whole.position
    lines = np.abs(np.fft.rfft(angle - angle.mean())) ** 2
    share = lines[::PERIODS].sum() / lines.sum()
    return Claim(
        "4.1",
        "harmonics at multiples of the frequency of the base",
        "at integer multiples",
        f"{100 * share:.4f} % of the power",
        judged(bool(share > 0.9999)),
    )


def _turns_in_flight(each: Steady) -> float:
    """Maxima of the angle for each impact that is not slow."""
    angle = each.whole.position
    turns = np.sum((angle[1:-1] > angle[:-2]) & (angle[1:-1] >= angle[2:]) & (angle[1:-1] > 1e-3))
    return float(turns / np.sum(each.whole.late(each.whole.impacts.approach_speed) > 5e-3))


def _exponent(case: Case) -> tuple[float, float]:
    """The largest Lyapunov exponent with the Kelvin-Voigt contact and its standard error [1/s]."""
    system, start = soft_system(case)
    interval = 2 * math.pi / case.omega
    found = ij.lyapunov(system, start, interval, count=4000, settle=200, tolerance=1e-6)
    return float(found.values[0]), float(found.errors[0])
