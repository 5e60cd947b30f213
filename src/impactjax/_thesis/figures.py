"""All figures of the thesis, by number."""

from collections.abc import Callable

from impactjax._thesis.chatter import figure_4_3_at_1_hz, figure_4_4, figure_4_5, figure_4_6
from impactjax._thesis.compliance import figure_3_4, figure_3_5, figure_3_6
from impactjax._thesis.drawing import Made
from impactjax._thesis.free_decay import figure_2_3
from impactjax._thesis.hertz import figure_3_7, figure_3_8, figure_3_9
from impactjax._thesis.periodic import figure_4_1, figure_4_2, figure_4_3, figure_4_7
from impactjax._thesis.restitution import figure_3_1, figure_3_2, figure_3_3
from impactjax._thesis.sweep import figure_4_8, figure_4_9, figure_4_10

FIGURES: dict[str, Callable[[], Made]] = {
    "2.3": figure_2_3,
    "3.1": figure_3_1,
    "3.2": figure_3_2,
    "3.3": figure_3_3,
    "3.4": figure_3_4,
    "3.5": figure_3_5,
    "3.6": figure_3_6,
    "3.7": figure_3_7,
    "3.8": figure_3_8,
    "3.9": figure_3_9,
    "4.1": figure_4_1,
    "4.2": figure_4_2,
    "4.3": figure_4_3,
    "4.3-1hz": figure_4_3_at_1_hz,
    "4.4": figure_4_4,
    "4.5": figure_4_5,
    "4.6": figure_4_6,
    "4.7": figure_4_7,
    "4.8": figure_4_8,
    "4.9": figure_4_9,
    "4.10": figure_4_10,
}
"""Makers of the figures. The thesis uses the number 4.3 twice, at 15 Hz and at 1 Hz."""
