"""Figures 4.3 (second), 4.4, 4.5 and 4.6: chatter, rest and release at 1 Hz."""

import math

import numpy as np

import impactjax as ij
from impactjax._thesis.claim import Claim, judged
from impactjax._thesis.constants import AT_1_HZ, LENGTH, RECORD, Case
from impactjax._thesis.drawing import OTHER, RECORDED, RIGID, SOFT, Made, named, panels, zero
from impactjax._thesis.motions import REST, SAMPLES, Lane, Motion, rigid, runs, soft
from impactjax._thesis.record import DELAY, LOST, recorded
from impactjax._thesis.steady import SHOWN
from impactjax._thesis.stuck import stuck_for_ever, stuck_from

SAME_R0 = AT_1_HZ._replace(soft=(725.0, *AT_1_HZ.rigid))
"""The case with the restitution's r0 = 0.6 in both laws."""
TENFOLD = 33.2e-3  # amplitude, if the printed one lacks a factor of ten [m]
IN_RADIANS = AT_1_HZ._replace(amplitude=TENFOLD, soft=(725.0, 0.65, 0.05 / LENGTH))
"""Ten times the amplitude and α = 0.05 in s/rad: r = r0 − α |θ̇|."""
LARGE = 50.5e-3  # amplitude that gives the angles of the figures [m]


def motion(model: ij.ImpactOscillator, begin: float = SHOWN[0], seconds: float = 15.0) -> Lane:
    """A motion from 0.2 rad, sampled some time later."""
    return Lane(model, 0.2, begin, seconds / SAMPLES)


def figure_4_3_at_1_hz() -> Made:
    """Chatter, rest and release at 1 Hz; the thesis gives this figure the number 4.3 again."""
    bases = AT_1_HZ.amplitude, TENFOLD, LARGE
    models = [rigid(AT_1_HZ._replace(amplitude=each)) for each in bases]
    ours = runs([motion(model) for model in models])
    printed, same, radians = runs([motion(soft(each)) for each in (AT_1_HZ, SAME_R0, IN_RADIANS)])
    drawn, (above, below) = panels(2, 1, 4.8)
    ts = ours[0].ts
    above.plot(ts - DELAY, np.degrees(recorded(same)), ".", color=RECORDED, ms=2, label=LOST)
    for ax, angle, style, colour, label in (
        (above, ours[0].position, "-", RIGID, "restitution"),
        (above, stuck_for_ever(ours[0]), "--", SOFT, "stuck for ever (thesis)"),
        (below, ours[0].position, "-", RIGID, "restitution, r0 = 0.60"),
        (below, printed.position, "-", SOFT, "Kelvin-Voigt, r0 = 0.65 (thesis)"),
        (below, same.position, "-", OTHER, "Kelvin-Voigt, r0 = 0.60"),
    ):
        ax.plot(ts, np.degrees(angle), style, color=colour, lw=1.1, label=label)
        ax.set(ylabel="angle θ [deg]")
        zero(ax)
        named(ax, ncols=3, loc="upper right")
    above.set(xlim=SHOWN, ylim=(-0.7, 2.3))
    below.set(xlabel="time t [s]", xlim=(20.4, 20.9), ylim=(-0.01, 0.19))
    return Made(
        drawn,
        (
            _height(*(math.degrees(each.position.max()) for each in ours)),
            _restitution_rests(ours[0]),
            *_contacts_rest(printed, same, radians),
            *_stuck(ours[0]),
        ),
    )


def _height(printed: float, tenfold: float, large: float) -> Claim:
    return Claim(
        "4.3 (1 Hz)",
        "largest angle for A = 3.32 mm",
        "about 15 deg",
        f"{printed:.2f} deg; {tenfold:.2f} deg for 33.2 mm, {large:.1f} deg for 50.5 mm",
        judged(abs(printed - 15) < 1, misprint=abs(large - 15) < 1),
        "the amplitude is printed too small, by ten or more",
    )


def _restitution_rests(ours: Motion) -> Claim:
    """Rest and release in each period, and the impacts before the series is summed."""
    begun = np.sum(ours.rest(ours.rests.begin) >= ours.ts[0]) / RECORD
    impacts = _impacts_before_rest(ours)
    return Claim(
        "4.3 (1 Hz)",
        "restitution: chatter, rest and release in each period",
        "motionless for ever",
        f"{begun:.0f} rest in each period, at the end of an infinite series of impacts, of which "
        f"{impacts:.0f} are followed one by one",
        judged(begun == 0),
        "the base lifts the mass off again; to stay is a property of the thesis's program",
    )


def _impacts_before_rest(each: Motion) -> float:
    """Impacts from one rest to the next."""
    begins = each.rest(each.rests.begin)[-10:]
    times = each.happened(each.impacts.time)
    return np.sum((times > begins[0]) & (times < begins[-1])) / (begins.size - 1)


def _contacts_rest(printed: Motion, same: Motion, radians: Motion) -> tuple[Claim, ...]:
    """Rest of the Kelvin-Voigt contact, which is one long contact."""
    longest = [float(each.late(each.impacts.duration).max()) for each in (printed, same, radians)]
    said = "chatter, rest and release in each period"
    return (
        Claim(
            "4.3 (1 Hz)",
            f"Kelvin-Voigt, r0 = 0.65, α = 0.05 s/m: {said}",
            "in each period",
            f"no rest: the longest contact takes {1e3 * longest[0]:.1f} ms",
            judged(longest[0] > REST, misprint=longest[2] > REST),
            "the base lifts the mass off before the impacts have come to an end; with 33.2 mm and "
            f"α = 0.05 s/rad the last contact is a rest of {1e3 * longest[2]:.0f} ms",
        ),
        Claim(
            "4.3 (1 Hz)",
            f"Kelvin-Voigt with the restitution's r0 = 0.60: {said}",
            "in each period",
            f"the last contact of each period is a rest of {1e3 * longest[1]:.0f} ms",
            judged(longest[1] > REST),
        ),
    )


def _stuck(ours: Motion) -> tuple[Claim, ...]:
    at = stuck_from(ours)
    left = np.abs(stuck_for_ever(ours)).max()
    return (
        Claim(
            "4.3 (1 Hz)",
            "a mass that is stuck for ever comes to rest after short transients",
            "at rest at 20 s",
            f"at rest from {at:.2f} s on, θ = {left:.0f} after 20 s",
            judged(at < 20 and left == 0),
        ),
    )


def figure_4_4() -> Made:
    """Simulated occurrence of chatter and rest."""
    case = SAME_R0._replace(amplitude=LARGE)
    found, printed = runs([motion(soft(each), 18.3, 0.5) for each in (case, SAME_R0)])
    drawn, (ax,) = panels(1, 1, 3.6)
    ts, angle = found.ts, np.degrees(found.position)
    ax.plot(ts, angle, color=SOFT, linewidth=1.2, label="Kelvin-Voigt, 50.5 mm, r0 = 0.60")
    tops = _tops(found)
    ax.plot(ts[tops], angle[tops], "o", color=RIGID, ms=4, label="peak between two impacts")
    zero(ax)
    ax.set(xlabel="time t [s]", ylabel="angle θ [deg]", xlim=(18.3, 18.8))
    named(ax)
    sizes, small = angle[tops], math.degrees(printed.position.max())
    ratios = sizes[1:] / sizes[:-1]
    said = ", ".join(f"{each:.3f}" for each in ratios[:4])
    return Made(
        drawn,
        (
            Claim(
                "4.4",
                "peaks between impacts approach zero rapidly",
                "rapidly",
                f"each is {said} of the one before; r² = {case.soft[1] ** 2:.2f}",
                judged(np.all(ratios < 0.5)),
            ),
            Claim(
                "4.4",
                "a peak of more than 4 deg between 18.3 and 18.8 s",
                "5 deg (axis)",
                f"{small:.2f} deg for 3.32 mm, {angle.max():.1f} deg for 50.5 mm",
                judged(small > 4, misprint=angle.max() > 4),
                "the amplitude that gives 15 deg in Figure 4.3 gives this peak as well",
            ),
        ),
    )


def _tops(found: Motion) -> np.ndarray:
    """Places of the largest sample of each flight."""
    angle = found.position
    inner = (angle[1:-1] > angle[:-2]) & (angle[1:-1] >= angle[2:]) & (angle[1:-1] > 1e-6)
    return np.flatnonzero(inner) + 1


def figure_4_5() -> Made:
    """Simulated response during rest."""
    cases = {"3.32 mm": SAME_R0, "50.5 mm": SAME_R0._replace(amplitude=LARGE)}
    found = runs([motion(soft(case), 20.69, 0.1) for case in cases.values()])
    drawn, axes = panels(1, 2, 3.4)
    for ax, name, each, colour in zip(axes, cases, found, (OTHER, SOFT), strict=True):
        deep = 1e3 * np.degrees(_static(cases[name], each.ts))
        ax.plot(each.ts, 1e3 * np.degrees(each.position), color=colour, linewidth=1, label=name)
        ax.plot(each.ts, deep, "--", color=RECORDED, linewidth=1, label="static penetration")
        ax.set(xlabel="time t [s]", xlim=(20.69, 20.78), ylim=(1.5 * deep[0], -2 * deep[0]))
        zero(ax)
        named(ax, loc="upper left")
    axes[0].set(ylabel="angle θ [10⁻³ deg]")
    inside = (found[0].ts > 20.73) & (found[0].ts < 20.755)  # the thesis's, until the release
    low, lower = (np.degrees(each.position[inside]) for each in found)
    return Made(
        drawn,
        (
            Claim(
                "4.5",
                "the pendulum penetrates the stop during its rest",
                "penetrates",
                f"{-low.max():.0e} to {-low.min():.0e} deg, always below zero",
                judged(low.max() < 0),
            ),
            Claim(
                "4.5",
                "size of the penetration from 20.73 s on",
                "up to 0.0015 deg (axis)",
                f"{-low.min():.0e} deg for 3.32 mm, {-lower.min():.0e} deg for 50.5 mm",
                judged(-low.min() > 2e-4, misprint=-lower.min() > 2e-4),
                "again only an amplitude of more than 33 mm gives the order of magnitude",
            ),
        ),
    )


def _static(case: Case, ts: np.ndarray) -> np.ndarray:
    """Angle at which the contact balances the inertia of the base [rad]."""
    return push(case, ts) / case.soft[0] ** 2


def push(case: Case, ts: np.ndarray) -> np.ndarray:
    """Free acceleration of a mass on the stop [rad/s²]."""
    return case.amplitude / LENGTH * case.omega**2 * np.cos(case.omega * ts)


def figure_4_6() -> Made:
    """Comparison of chatter with acceleration."""
    (hard,) = runs([motion(rigid(SAME_R0), 20.4, 0.5)])
    (found,) = runs([motion(soft(SAME_R0), 20.4, 0.5)])
    ts = found.ts
    drawn, (above, below) = panels(2, 1, 4.4)
    above.plot(ts, np.degrees(hard.position), color=RIGID, linewidth=1.2, label="restitution")
    above.plot(ts, np.degrees(found.position), color=SOFT, linewidth=1, label="Kelvin-Voigt")
    above.set(ylabel="angle θ [deg]")
    below.plot(
        ts, np.degrees(push(SAME_R0, ts)), color=OTHER, label="free acceleration on the stop"
    )
    below.set(ylabel="acceleration [deg/s²]", xlabel="time t [s]")
    ended = hard.rest(hard.rests.end)
    release = float(ended[(ended > 20.4) & (ended < 20.9)][0])
    for ax in (above, below):
        zero(ax)
        ax.axvline(release, color=RECORDED, linestyle=":", label="end of the rest")
        ax.set(xlim=(20.4, 20.9))
        named(ax)
    rises = (3 * math.pi / 2 + 20 * 2 * math.pi) / SAME_R0.omega
    by_sine, next_one = (periods * 2 * math.pi / SAME_R0.omega for periods in (20, 21))
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
                f"sin Ωt releases at {by_sine:.2f} or {next_one:.2f} s, cos Ωt at {rises:.2f} s",
                judged(20.4 < by_sine < 20.9, misprint=20.4 < rises < 20.9),
                "the figure shows the release between 20.4 and 20.9 s: the computation had the "
                "cosine of the text",
            ),
        ),
    )
