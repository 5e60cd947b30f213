"""Restitution that was measured without any law, in figure and `fit.json`."""

import matplotlib.pyplot as plt
import numpy as np

import impactjax as ij
from impactjax._report.document import document

R, SPEED, GRAVITY = 0.8, 1.5, 9.80665
TIMES = 0.1 + 2 * SPEED / GRAVITY * (1 - R ** np.arange(9)) / (1 - R)


def test_measured_restitution_of_flights_is_drawn_and_written():
    prepared = ij.prepare(ij.ImpactTimes(TIMES), laws=["restitution"])
    compared = ij.compare(prepared, starts=ij.Starts(2))
    found = document([compared])
    measured = found["measured_restitution"]["recording"]
    np.testing.assert_allclose(measured["restitution"], R, rtol=1e-9)
    speeds = SPEED * R ** np.arange(7)  # at the end of each flight but the last
    np.testing.assert_allclose(measured["approach_speed"], speeds, rtol=1e-9)
    law = found["fits"][0]["restitution"]
    np.testing.assert_allclose(law["restitution"], R, rtol=1e-6)
    assert len(law["approach_speed"]) == len(law["half_width95"]) == 10
    ax = plt.figure().add_subplot()
    ij.plot.restitution(ax, compared.fits, compared.first_look)
    drawn = {line.get_label(): line.get_ydata() for line in ax.get_lines()}
    np.testing.assert_allclose(np.asarray(drawn["measured"]), R, rtol=1e-9)
