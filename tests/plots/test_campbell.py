"""A Campbell diagram shows what grows over the whole range, and a legend of what is drawn."""

import numpy as np
import pytest
import scipy.sparse as sp

import squeal
from squeal.plots.campbell import campbell_drawing


def test_the_growing_branch_is_in_the_frame_and_its_onset_is_said():
    """omega^2 = 9; its damping 1 - speed / 2 is lost from 2 rad/s on."""
    system = squeal.System(
        np.eye(2),
        {"1": np.diag([0.1, 0.1]), "speed": np.diag([-0.05, 0.0])},
        np.diag([9.0, 1.0]),
        parameters={"speed": 0.0},
        parameter="speed",
    )
    found = squeal.critical_speeds(system, high=5.0)
    figure = campbell_drawing(found, "two").figure
    axes = figure.axes[0]
    assert axes.get_ylim()[1] >= found.frequencies_hz[found.growing].max()
    (told,) = [text.get_text() for text in axes.texts if "unstable from" in text.get_text()]
    assert told == "unstable from 2 rad/s (19.1 rpm) on, 0.4775 Hz"  # omega = 3
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["no direction", "thick: unstable"]


def test_a_mode_that_leaves_the_band_is_drawn_up_to_there_and_has_no_mark_beyond():
    """Of s^2 x'' = -k x with a gyroscopic term g speed of two rows the frequencies are
    (k + (g speed / 2)^2)^(1/2) -+ g speed / 2: the forward one rises out of the band."""
    band = (1.0, 18.0)
    g = 0.5
    k = np.repeat([50.0**2, 100.0**2, *(400.0 + 5.0 * np.arange(199)) ** 2], 2)
    gyroscopic = sp.block_diag([np.array([[0.0, g], [-g, 0.0]])] * 2 + [np.zeros((398, 398))])
    rotor = squeal.System(
        sp.eye_array(402), {"speed": gyroscopic}, sp.diags_array(k), {"speed": 0.0}, "speed"
    )
    found = squeal.critical_speeds(rotor, 100.0, band=band)
    lines = campbell_drawing(found, "rotor").figure.axes[0].lines
    marks = [np.asarray(line.get_ydata(), float) for line in lines if "end" in str(line.get_gid())]
    half = g * 100.0 / 2
    at_end = np.array([[(w * w + half**2) ** 0.5 - half] * 2 for w in (50.0, 100.0)])
    at_end[:, 1] += 2 * half
    at_end /= 2 * np.pi
    assert np.sort(np.ravel(marks)) == pytest.approx(np.sort(at_end[at_end < band[1]]), rel=1e-6)
    drawn = [np.asarray(line.get_ydata(), float) for line in lines if line.get_color() == "0.45"]
    assert len(drawn) == 4
    assert max(np.nanmax(hertz) for hertz in drawn) == pytest.approx(band[1], rel=0.01)
