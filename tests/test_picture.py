"""The margins of figures hold what is written there."""

import numpy as np
import pytest
from matplotlib.axes import Axes

from impactjax._report.picture import PLAIN, figure
from tiers import quick

pytestmark = quick


@pytest.mark.parametrize("size", [2e-9, 2e-5, 3e-4, 0.02, 1.0, 700.0, 9000.0, 4e7])
@pytest.mark.parametrize("width", [4.2, 9.0])
@pytest.mark.parametrize("height", [2.4, 3.6])
def test_figure_labels_are_inside_margins(size, width, height):
    def draw(ax: Axes) -> Axes:
        ax.plot(np.linspace(-1, 1, 5) * size, np.linspace(-1, 1, 5) * size, label="recorded")
        ax.set(xlabel="approach speed [m/s]", ylabel="angular acceleration [rad/s²]")
        ax.set_title("16 of 16 starts reach the best", fontsize="medium")
        return ax

    drawn = figure(draw, width, height, PLAIN)
    box = drawn.axes[0].get_tightbbox()
    assert box is not None
    assert min(box.x0, box.y0) >= 0
    assert box.x1 <= drawn.bbox.x1
    assert box.y1 <= drawn.bbox.y1
