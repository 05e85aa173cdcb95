"""A Campbell diagram shows what grows over the whole range, and a legend of what is drawn."""

import numpy as np

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
