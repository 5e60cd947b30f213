"""Figure 4.7: chaos."""

import math

import impactjax as ij
from impactjax._thesis.claim import Claim, Verdict, judged
from impactjax._thesis.constants import AT_10_HZ, LENGTH, RECORD, Case
from impactjax._thesis.drawing import Made
from impactjax._thesis.motions import rigid, soft
from impactjax._thesis.steady import compared, steady

_PEAKS = (4.2, 4.0, 3.7333, 1.0, 3.1333, 3.3333)  # printed in Figures 4.1 to 4.7 [Hz]


def figure_4_7() -> Made:
    """Forced response at 10 Hz."""
    made = compared(AT_10_HZ)
    exponent, error = _exponent(AT_10_HZ)
    hard, chaotic = made.rigid.period, made.soft.period == 0 and exponent > 3 * error
    r0, alpha = AT_10_HZ.rigid
    in_radians = AT_10_HZ._replace(rigid=(r0, alpha / LENGTH))
    other = steady(rigid(in_radians), in_radians).period
    lines = ", ".join(f"{each * RECORD:.0f}" for each in _PEAKS)
    return made.drawn(
        Claim(
            "4.7",
            "chaos with the Kelvin-Voigt contact",
            "chaotic, from a broad spectrum",
            f"largest Lyapunov exponent {exponent:.2f} ± {error:.2f} /s",
            judged(chaotic),
        ),
        Claim(
            "4.7",
            "chaos with restitution",
            "chaotic, from a broad spectrum",
            f"period {hard} of the base",
            judged(hard == 0),
            "the motion repeats with the printed r0 = 0.6, α = 0.05 s/m; with α in s/rad its "
            f"period is {other}",
        ),
        Claim(
            "4.7",
            "the two laws predict this motion equally well",
            "equally valid",
            "one chaotic, one periodic" if chaotic and hard else "of the same kind",
            judged(chaotic == (hard == 0)),
            "it does not hold for the printed parameters",
        ),
        Claim(
            "4.7",
            "largest line of the spectrum",
            "3.1333 and 3.3333 Hz",
            f"{made.rigid.peak:.4f} and {made.soft.peak:.4f} Hz",
            Verdict.OPEN,
            "the largest line of a chaotic motion differs from record to record",
        ),
        Claim(
            "4.7",
            "peaks of all spectra of chapter 4 are frequencies of the motions",
            ", ".join(f"{each:g}" for each in _PEAKS) + " Hz",
            f"{lines} fifteenths of 1 Hz",
            judged(any(abs(each * RECORD - round(each * RECORD)) > 1e-3 for each in _PEAKS)),
            "all are lines of records of 15 s",
        ),
    )


def _exponent(case: Case) -> tuple[float, float]:
    """The largest Lyapunov exponent with the Kelvin-Voigt contact and its standard error [1/s]."""
    period = 2 * math.pi / case.omega
    found = ij.lyapunov(soft(case), ij.InitialState(0.2), period, count=4000, settle=200)
    return float(found.values[0]), float(found.errors[0])
