"""Figures 4.3 (second), 4.4, 4.5 and 4.6: chatter, rest and release at 1 Hz."""

import math

import numpy as np

import impactjax as ij
from impactjax._thesis.claim import Claim, Verdict, judged
from impactjax._thesis.constants import AT_1_HZ, LENGTH, Case
from impactjax._thesis.drawing import OTHER, RECORDED, RIGID, SOFT, Made, named, panels, zero
from impactjax._thesis.motions import SAMPLES, Lane, happened, rigid, runs, soft
from impactjax._thesis.periodic import SHOWN
from impactjax._thesis.record import LOST, recorded
from impactjax._thesis.stuck import stuck_for_ever, stuck_from

SAME_R0 = AT_1_HZ._replace(soft=(725.0, *AT_1_HZ.rigid))
"""The case with the restitution's r0 = 0.6 in both laws."""
TENFOLD = AT_1_HZ._replace(amplitude=33.2e-3)
_REST = 0.02  # a contact that lasts longer is a rest on the stop [s]


def motion(model: ij.ImpactOscillator, begin: float = SHOWN[0], seconds: float = 15.0) -> Lane:
    """A motion from 0.2 rad, sampled some time later."""
    return Lane(model, 0.2, begin, seconds / SAMPLES)


def figure_4_3_at_1_hz() -> Made:
    """Chatter, rest and release at 1 Hz; the thesis gives this figure the number 4.3 again."""
    ours, tenfold = runs([motion(rigid(AT_1_HZ)), motion(rigid(TENFOLD))])
    printed, same, _ = runs([motion(soft(each)) for each in (AT_1_HZ, SAME_R0, TENFOLD)])
    drawn, (above, below) = panels(2, 1, 4.8)
    ts = np.asarray(ours.ts)
    shown = ts <= SHOWN[1]
    every = slice(None, None, 2)
    measured = np.degrees(recorded(soft(SAME_R0), same))
    for ax in (above, below):
        ax.plot(ts[shown][every], measured[shown][every], ".", color=RECORDED, ms=2, label=LOST)
        ax.set(xlim=SHOWN, ylabel="angle θ [deg]", ylim=(-0.7, 2.3))
        zero(ax)
    above.plot(ts[shown], np.degrees(ours.position)[shown], color=RIGID, lw=1.2, label="restitution")
    stuck = np.degrees(stuck_for_ever(ours))[shown]
    above.plot(ts[shown], stuck, "--", color=SOFT, lw=1.2, label="stuck for ever (thesis)")
    for each, label, colour in (
        (printed, "Kelvin-Voigt, r0 = 0.65 (thesis)", SOFT),
        (same, "Kelvin-Voigt, r0 = 0.60", OTHER),
    ):
        below.plot(ts[shown], np.degrees(each.position)[shown], color=colour, lw=1, label=label)
    for ax in (above, below):
        named(ax, ncols=3, loc="upper right")
    below.set(xlabel="time t [s]")
    high, higher = (np.degrees(np.max(each.position)) for each in (ours, tenfold))
    return Made(
        drawn,
        (
            Claim(
                "4.3 (1 Hz)",
                "largest angle for A = 3.32 mm",
                "about 15 deg",
                f"{high:.2f} deg; {higher:.2f} deg for 33.2 mm",
                judged(bool(high > 10), misprint=bool(higher > 9)),
                f"the amplitude is too small by ten or more; 15 deg needs "
                f"{33.2 * 15 / higher:.0f} mm",
            ),
            *_rests(ours, printed, same),
            *_stuck(ours),
        ),
    )


def _rests(ours: ij.Trajectory, printed: ij.Trajectory, same: ij.Trajectory) -> tuple[Claim, ...]:
    """Rest and release in each period."""
    begun = in_window(np.asarray(ours.rests.begin)[: int(ours.rests.count)], ours)
    impacts = in_window(happened(ours, ours.impacts.time), ours)
    coarse = _impacts_at(1e-6)
    without, with_rest = (_long_contacts(each) for each in (printed, same))
    return (
        Claim(
            "4.3 (1 Hz)",
            "restitution: chatter, rest and release in each period",
            "motionless for ever",
            f"{begun / 15:.0f} rest in each period; {impacts / 15:.0f} impacts before the rest of "
            f"the infinite series is summed ({coarse:.0f} at a tolerance of 1e-6)",
            judged(begun == 0),
            "the base lifts the mass off again; to stay is a property of the thesis's program",
        ),
        Claim(
            "4.3 (1 Hz)",
            "Kelvin-Voigt, r0 = 0.65: chatter, rest and release",
            "in each period",
            f"longest contact {1e3 * without:.1f} ms",
            judged(without > _REST, misprint=with_rest > _REST),
            f"with r0 = 0.65 the impacts have not come to an end when the base lifts the mass off; "
            f"with r0 = 0.60 the last contact is a rest of {1e3 * with_rest:.0f} ms",
        ),
    )


def _impacts_at(tolerance: float) -> float:
    """Impacts a period with restitution that are simulated one by one at a tolerance."""
    begin, seconds = SHOWN[0], 5.0
    found = ij.simulate(
        rigid(AT_1_HZ),
        ij.InitialState(0.2),
        np.linspace(begin, begin + seconds, 2),
        t0=0.0,
        tolerance=tolerance,
        max_steps=8192,
        max_impacts=2048,
    )
    return np.sum(happened(found, found.impacts.time) >= begin) / seconds


def _stuck(ours: ij.Trajectory) -> tuple[Claim, ...]:
    at = stuck_from(ours)
    left = np.abs(stuck_for_ever(ours)).max()
    return (
        Claim(
            "4.3 (1 Hz)",
            "a mass that is stuck for ever comes to rest after short transients",
            "at rest at 20 s",
            f"at rest from {at:.2f} s on, θ = {left:.0f} after 20 s",
            judged(bool(at < 20 and left == 0)),
        ),
    )


def in_window(times: np.ndarray, run: ij.Trajectory) -> int:
    """Number of times within the samples of a motion."""
    return int(np.sum((times >= run.ts[0]) & (times < run.ts[-1])))


def _long_contacts(run: ij.Trajectory) -> float:
    """Duration of the longest contact within the samples of a motion [s]."""
    begins = happened(run, run.impacts.time)
    return float(np.max(happened(run, run.impacts.duration)[begins >= run.ts[0]]))


def figure_4_4() -> Made:
    """Simulated occurrence of chatter and rest."""
    case = SAME_R0._replace(amplitude=TENFOLD.amplitude)
    (found,) = runs([motion(soft(case), 18.3, 0.5)])
    drawn, (ax,) = panels(1, 1, 3.6)
    ts, angle = np.asarray(found.ts), np.degrees(found.position)
    ax.plot(ts, angle, color=SOFT, linewidth=1.2, label="Kelvin-Voigt, 33.2 mm, r0 = 0.60")
    tops = _tops(found)
    ax.plot(ts[tops], angle[tops], "o", color=RIGID, ms=4, label="peak between two impacts")
    zero(ax)
    ax.set(xlabel="time t [s]", ylabel="angle θ [deg]", xlim=(18.3, 18.8))
    named(ax)
    sizes = angle[tops]
    ratios = sizes[1:] / sizes[:-1]
    said = ", ".join(f"{each:.3f}" for each in ratios[:4])
    return Made(
        drawn,
        (
            Claim(
                "4.4",
                "peaks between impacts approach zero rapidly",
                "rapidly",
                f"each is {said} of the one before; r² = 0.36",
                judged(bool(np.all(ratios < 0.5))),
            ),
            Claim(
                "4.4",
                "peaks of more than 4 deg between 18.3 and 18.8 s",
                "up to 5 deg",
                f"{angle.max():.1f} deg for 33.2 mm, {angle.max() / 10:.2f} deg for 3.32 mm",
                judged(bool(angle.max() / 10 > 2), misprint=bool(angle.max() > 2)),
                "again the amplitude is too small by about ten",
            ),
        ),
    )


def _tops(found: ij.Trajectory) -> np.ndarray:
    """Places of the largest sample of each flight."""
    angle = np.asarray(found.position)
    inner = (angle[1:-1] > angle[:-2]) & (angle[1:-1] >= angle[2:]) & (angle[1:-1] > 1e-6)
    return np.flatnonzero(inner) + 1


def figure_4_5() -> Made:
    """Simulated response during rest."""
    cases = {"3.32 mm": SAME_R0, "33.2 mm": SAME_R0._replace(amplitude=TENFOLD.amplitude)}
    found = runs([motion(soft(case), 20.68, 0.12) for case in cases.values()])
    drawn, axes = panels(1, 2, 3.4)
    for ax, name, each, colour in zip(axes, cases, found, (OTHER, SOFT), strict=True):
        ax.plot(each.ts, 1e3 * np.degrees(each.position), color=colour, linewidth=1, label=name)
        ax.set(xlabel="time t [s]", xlim=(20.68, 20.8))
        deep = 1e3 * math.degrees(_static(cases[name]))
        ax.axhline(-deep, color=RECORDED, linestyle="--", linewidth=0.8, label="static penetration")
        ax.set(ylim=(-2.5 * deep, 4 * deep))
        zero(ax)
        named(ax, loc="upper left")
    axes[0].set(ylabel="angle θ [10⁻³ deg]")
    depths = [-np.degrees(np.min(each.position)) for each in found]
    return Made(
        drawn,
        (
            Claim(
                "4.5",
                "the pendulum penetrates the stop during its rest",
                "about 0.001 deg",
                f"{depths[0]:.1e} deg for 3.32 mm, {depths[1]:.1e} deg for 33.2 mm",
                judged(bool(2.5e-4 < depths[0] < 4e-3), misprint=bool(2.5e-4 < depths[1] < 4e-3)),
                "again an amplitude ten times as large agrees",
            ),
            Claim(
                "4.5",
                "depth of the rest, the inertia over the stiffness A Ω²/(ω0² L)",
                "none printed",
                f"{math.degrees(_static(SAME_R0)):.1e} deg for 3.32 mm",
                Verdict.LOST,
                "the figure has no data",
            ),
        ),
    )


def _static(case: Case) -> float:
    """Penetration at which the contact balances the largest inertia of the base [rad]."""
    return case.amplitude * case.omega**2 / (case.soft[0] ** 2 * LENGTH)


def figure_4_6() -> Made:
    """Comparison of chatter with acceleration."""
    (hard,), (found,) = runs([motion(rigid(SAME_R0), 20.4, 0.5)]), runs(
        [motion(soft(SAME_R0), 20.4, 0.5)]
    )
    ts = np.asarray(found.ts)
    push = SAME_R0.amplitude / LENGTH * SAME_R0.omega**2 * np.cos(SAME_R0.omega * ts)
    drawn, (above, below) = panels(2, 1, 4.4)
    above.plot(ts, np.degrees(hard.position), color=RIGID, linewidth=1.2, label="restitution")
    above.plot(ts, np.degrees(found.position), color=SOFT, linewidth=1, label="Kelvin-Voigt")
    above.set(ylabel="angle θ [deg]")
    below.plot(ts, np.degrees(push), color=OTHER, label="free acceleration on the stop")
    below.set(ylabel="acceleration [deg/s²]", xlabel="time t [s]")
    ended = np.asarray(hard.rests.end)[: int(hard.rests.count)]
    release = float(ended[(ended > 20.4) & (ended < 20.9)][0])
    for ax in (above, below):
        zero(ax)
        ax.axvline(release, color=RECORDED, linestyle=":", label="end of the rest")
        ax.set(xlim=(20.4, 20.9))
        named(ax)
    rises = (3 * math.pi / 2 + 20 * 2 * math.pi) / SAME_R0.omega
    by_sine = 20 * 2 * math.pi / SAME_R0.omega
    return Made(
        drawn,
        (
            Claim(
                "4.6",
                "the rest ends when the free acceleration becomes positive",
                "when it becomes positive",
                f"release at {release:.4f} s, acceleration zero at {rises:.4f} s",
                judged(abs(release - rises) < 1e-4),
            ),
            Claim(
                "4.6",
                "the base moves the pendulum by sin Ωt, equation 2.10",
                "sin Ωt",
                f"sin Ωt releases at {by_sine:.2f} or 21.02 s, cos Ωt at {rises:.2f} s",
                judged(20.4 < by_sine < 20.9, misprint=20.4 < rises < 20.9),
                "the figure shows the release between 20.4 and 20.9 s: the computation had the "
                "cosine of the text",
            ),
        ),
    )
