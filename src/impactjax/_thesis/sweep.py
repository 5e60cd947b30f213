"""Figures 4.8 to 4.10: the frequency sweep, and the bifurcation diagrams of both laws."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

import impactjax as ij
from impactjax._thesis.claim import Claim, judged
from impactjax._thesis.constants import AT_4_HZ, AT_8_HZ, AT_10_HZ, AT_15_HZ, SWEEP
from impactjax._thesis.drawing import OTHER, RIGID, SOFT, Made, named, panels
from impactjax._thesis.motions import PERIODS, REST, SAMPLES, against, period, runs, strobe
from impactjax._thesis.stuck import stuck_from

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Law: TypeAlias = ij.AbstractImpactLaw | ij.AbstractForceLaw

_FREQUENCIES = np.linspace(3.0, 15.0, 384)  # [Hz]
_CASES = (AT_4_HZ, AT_8_HZ, AT_10_HZ, AT_15_HZ)


def amplitude(hertz: float | np.ndarray) -> np.ndarray:
    """Amplitude of the base in the sweep [m]."""
    return np.asarray(10 ** np.polyval(SWEEP, hertz))


def figure_4_8() -> Made:
    """Relationship between forcing frequency and amplitude."""
    drawn, (ax,) = panels(1, 1, 3.4)
    ax.plot(_FREQUENCIES, 1e3 * amplitude(_FREQUENCIES), color=RIGID, label="the thesis's fit")
    at = [each.omega / (2 * np.pi) for each in _CASES]
    sizes = [1e3 * each.amplitude for each in _CASES]
    ax.plot(at, sizes, "o", color=SOFT, ms=5, label="motions of Figures 4.1 to 4.7")
    ax.set(xlabel="frequency of the base [Hz]", ylabel="amplitude A [mm]", xlim=(3, 15.2))
    ax.set(ylim=(0, 35))
    named(ax)
    first, last = (1e3 * float(amplitude(each)) for each in (3.0, 15.0))
    return Made(
        drawn,
        (
            Claim(
                "4.8",
                "amplitude at 3 Hz",
                "about 33 mm (axis to 35 mm)",
                f"{first:.1f} mm",
                judged(30 < first < 35),
            ),
            Claim(
                "4.8",
                "amplitudes of the base in the experiments",
                "1 to 5 mm",
                f"{last:.2f} to {first:.1f} mm",
                judged(first < 5.5),
                "the sweep goes beyond the range stated in chapter 2",
            ),
        ),
    )


class _Diagram(NamedTuple):
    """Steady motions over the frequency.

    - `angle`: angle after each period of the base, (frequencies, periods) [rad].
    - `rests`: true where the mass rests on the stop in the steady motion.
    - `longest`: duration of the longest contact [s].
    - `stuck`: time from which a mass that stays for ever is at rest [s].
    """

    angle: np.ndarray
    rests: np.ndarray
    longest: np.ndarray
    stuck: np.ndarray


def _diagram(law: Law) -> _Diagram:
    """The steady motions at all frequencies of the sweep."""
    omegas = 2 * np.pi * _FREQUENCIES
    sizes = amplitude(_FREQUENCIES)
    models = [against(law, float(a), float(w)) for a, w in zip(sizes, omegas, strict=True)]
    found = runs([strobe(model, float(w)) for model, w in zip(models, omegas, strict=True)])
    return _Diagram(
        np.stack([each.position[:: SAMPLES // PERIODS] for each in found]),
        np.array([np.any(each.rest(each.rests.end) > each.ts[0]) for each in found]),
        np.array([np.max(each.late(each.impacts.duration), initial=0.0) for each in found]),
        np.array([stuck_from(each) for each in found]),
    )


def _draw(ax: "Axes", found: _Diagram, colour: str) -> None:
    shape = found.angle.shape
    at = np.broadcast_to(_FREQUENCIES[:, None], shape)
    ax.plot(at.ravel(), np.degrees(found.angle).ravel(), ".", ms=2, mew=0, color=colour)
    ax.set(xlabel="frequency of the base [Hz]", ylabel="angle after each period [deg]")
    ax.set(xlim=(3, 15))


def figure_4_9() -> Made:
    """Bifurcation diagram with the coefficient of restitution."""
    law = ij.LinearRestitution(0.6, 0.0)
    found = _diagram(law)
    drawn, (ax,) = panels(1, 1, 4.4)
    _draw(ax, found, RIGID)
    stuck = np.isfinite(found.stuck)
    flat, low = np.zeros(stuck.sum()), np.full(found.rests.sum(), -3.0)
    ax.plot(_FREQUENCIES[stuck], flat, "s", ms=3, color=OTHER, label="stuck for ever (thesis)")
    ax.plot(
        _FREQUENCIES[found.rests], low, "|", ms=6, color=SOFT, label="rests in the steady motion"
    )
    named(ax, loc="upper right")
    only, still = stuck & ~found.rests, np.sum(found.angle.max(axis=1) < 1e-3)
    return Made(
        drawn,
        (
            Claim(
                "4.9",
                "solutions stuck at θ = 0",
                "many, in chaotic ranges",
                f"at {stuck.sum()} of {stuck.size} frequencies for a mass that stays for ever, at "
                f"{still} for one that is lifted off",
                judged(not stuck.any()),
                f"they are false: at {only.sum()} of them the mass rests in its transient only, at "
                f"{found.rests.sum()} in the steady motion, from which it is lifted off",
            ),
            _parallel("4.9", law, "parallel motions", lambda number: number > 1),
        ),
    )


def figure_4_10() -> Made:
    """Bifurcation diagram with the linear compliance model."""
    law = ij.KelvinVoigtLinearRestitution(725.0, 0.6, 0.0)
    found = _diagram(law)
    drawn, (ax,) = panels(1, 1, 4.4)
    _draw(ax, found, SOFT)
    rests = found.longest > REST
    ax.plot(
        _FREQUENCIES[rests],
        np.full(rests.sum(), -3.0),
        "|",
        ms=6,
        color=OTHER,
        label="a contact of more than 20 ms",
    )
    named(ax, loc="upper right")
    slow = rests & (_FREQUENCIES < 7)
    at, lasts = _FREQUENCIES[slow], 1e3 * found.longest[slow]
    return Made(
        drawn,
        (
            Claim(
                "4.10",
                "no chatter above 3 Hz",
                "none",
                f"contacts of {lasts.min():.0f} to {lasts.max():.0f} ms at {at.min():.2f} to "
                f"{at.max():.2f} Hz; rests at {rests.sum()} of {rests.size} frequencies",
                judged(not rests.any()),
                "the mass rests on its stop at the end of a series of impacts",
            ),
            _parallel("4.10", law, "no parallel motions", lambda number: number == 1),
        ),
    )


def _parallel(figure: str, law: Law, thesis: str, agrees: Callable[[int], bool]) -> Claim:
    """Steady motions at 13 Hz from many starts."""
    hertz = 13.0
    omega = 2 * np.pi * hertz
    lane = strobe(against(law, float(amplitude(hertz)), omega), omega)
    found = runs([lane._replace(angle=float(angle)) for angle in np.linspace(0.02, 0.8, 24)])
    kinds = {(period(each), round(math.degrees(each.position.max()), 2)) for each in found}
    periods = ", ".join(str(each) for each, _ in sorted(kinds))
    return Claim(
        figure,
        "branches between 12 and 14 Hz",
        thesis,
        f"from 24 starts at 13 Hz {len(kinds)} motion, of period {periods}",
        judged(agrees(len(kinds))),
        "a motion of period 3 is three points of the diagram, not three branches",
    )
