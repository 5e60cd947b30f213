"""The figures of the thesis."""

from collections.abc import Callable
from typing import NamedTuple

from impactjax._thesis.chaos import figure_4_7
from impactjax._thesis.chatter import figure_4_3_at_1_hz, figure_4_4, figure_4_5, figure_4_6
from impactjax._thesis.compliance import figure_3_4, figure_3_5, figure_3_6
from impactjax._thesis.drawing import Made
from impactjax._thesis.free_decay import figure_2_3
from impactjax._thesis.hertz import figure_3_7, figure_3_8, figure_3_9
from impactjax._thesis.periodic import figure_4_1, figure_4_2, figure_4_3
from impactjax._thesis.restitution import figure_3_1, figure_3_2, figure_3_3
from impactjax._thesis.sweep import figure_4_8, figure_4_9, figure_4_10


class Figure(NamedTuple):
    """A figure of the thesis.

    - `title`: its caption, shortened.
    - `make`: a function that computes and draws it.
    """

    title: str
    make: Callable[[], Made]


FIGURES: dict[str, Figure] = {
    "2.3": Figure("Free oscillation curve fitting", figure_2_3),
    "3.1": Figure("Determination of coefficient of restitution from successive peaks", figure_3_1),
    "3.2": Figure("Comparison of multiple scales solution and numerical integration", figure_3_2),
    "3.3": Figure(
        "Comparison of experimental results with piecewise analytical solution", figure_3_3
    ),
    "3.4": Figure("Comparison of experimental results with Kelvin-Voigt model", figure_3_4),
    "3.5": Figure(
        "Effect of viscoelasticity on the equivalent coefficient of restitution", figure_3_5
    ),
    "3.6": Figure(
        "Comparison of experimental results with nonlinear lumped parameter model", figure_3_6
    ),
    "3.7": Figure("Comparison of experimental results with damped Hertzian model", figure_3_7),
    "3.8": Figure("Comparison of contact model predictions near impact", figure_3_8),
    "3.9": Figure("Comparison of experimental and numerical results, r = r0 − α v", figure_3_9),
    "4.1": Figure("Forced response at 4.2 Hz", figure_4_1),
    "4.2": Figure("Forced response at 8 Hz", figure_4_2),
    "4.3": Figure("Forced response at 15 Hz", figure_4_3),
    "4.3-1hz": Figure("Forced response at 1 Hz", figure_4_3_at_1_hz),
    "4.4": Figure("Simulated occurrence of chatter and sticking", figure_4_4),
    "4.5": Figure("Simulated response during sticking", figure_4_5),
    "4.6": Figure("Comparison of chatter with acceleration", figure_4_6),
    "4.7": Figure("Forced response at 10 Hz", figure_4_7),
    "4.8": Figure("Relationship between forcing frequency and amplitude", figure_4_8),
    "4.9": Figure("Bifurcation diagram using the coefficient of restitution", figure_4_9),
    "4.10": Figure("Bifurcation diagram using the linear compliance model", figure_4_10),
}
"""The figures by number. The thesis uses the number 4.3 twice, at 15 Hz and at 1 Hz."""
