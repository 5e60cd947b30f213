"""Figures 4.1 to 4.3: periodic motions of the shaken pendulum and their spectra."""

import math

import numpy as np

from impactjax._thesis.claim import Claim, judged
from impactjax._thesis.constants import AT_4_HZ, AT_8_HZ, AT_15_HZ, damping_of, restitution_of
from impactjax._thesis.drawing import Made
from impactjax._thesis.motions import PERIODS
from impactjax._thesis.steady import Steady, compared
from impactjax._thesis.stuck import stuck_from


def figure_4_1() -> Made:
    """Forced response at 4.2 Hz."""
    made = compared(AT_4_HZ)
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
    made = compared(AT_8_HZ)
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
    made = compared(AT_15_HZ)
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
            judged(speeds.min() < 0.2 * speeds.max()),
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
        judged(share > 0.9999),
    )


def _turns_in_flight(each: Steady) -> float:
    """Maxima of the angle for each impact that is not slow."""
    angle = each.whole.position
    turns = np.sum((angle[1:-1] > angle[:-2]) & (angle[1:-1] >= angle[2:]) & (angle[1:-1] > 1e-3))
    return float(turns / np.sum(each.whole.late(each.whole.impacts.approach_speed) > 5e-3))
