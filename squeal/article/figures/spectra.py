"""Spectrogram through the onset and spectrum of what follows, from the study of that name."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from squeal.article.cases import title
from squeal.article.results.spectra import Spectra
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

FAINT = -60.0  # dB, the least that is drawn
LOW = 12.0  # kHz, up to which the spectrogram is drawn


def spectra_figure(found: Spectra) -> Figure:
    """A column a scene: levels over time and frequency, and those of the second half."""
    with style():
        figure = Figure(figsize=(DOUBLE, 4.2))
        count = len(found.scenes)
        grid = figure.subplots(2, count, squeeze=False)
        for column, (name, one) in enumerate(found.scenes.items()):
            over_time, late = grid[:, column]
            drawn = np.array(one.frequencies) <= LOW
            levels = (np.array(one.frequencies)[drawn], np.array(one.levels).T[drawn])
            look: Any = {"vmin": FAINT, "vmax": 0.0, "cmap": "magma_r", "rasterized": True}
            image = over_time.pcolormesh(one.times, *levels, **look)
            for mode in one.modes:
                over_time.axhline(mode, color="#3498DB", lw=0.7, ls="--")
                late.axvline(mode, color="#3498DB", lw=0.7, ls="--")
            if one.onset is not None:
                over_time.axvline(one.onset, color="0.4", lw=0.7, ls=":")
            over_time.set_ylim(0.0, LOW)
            over_time.set_xlabel("time [ms]")
            late.plot(one.late_frequencies, one.late, color="k", lw=0.5)
            for k in range(1, int(one.late_frequencies[-1] / one.strongest) + 1):
                late.plot(k * one.strongest, 3.0, "v", color="#C8380E", ms=3)
            late.set_xlim(0.0, one.late_frequencies[-1])
            late.set_ylim(FAINT - 10.0, 8.0)
            late.set_xlabel("frequency [kHz]")
            for axes, letter in ((over_time, "abcd"[column]), (late, "abcd"[count + column])):
                axes.set_title(f"({letter}) {title(name)}", loc="left", pad=3.0)
        grid[0, 0].set_ylabel("frequency [kHz]")
        grid[1, 0].set_ylabel("level of the second half [dB]")
        figure.colorbar(image, ax=grid[0, :], label="level [dB]", pad=0.01, aspect=12)
    return figure


def draw(found: Spectra) -> Drawing:
    """The figure, ready to be saved."""
    name = "Spectra of the contact force through the first losses of contact"
    if not found.scenes:
        why = "The equilibrium of none of the scenes flutters with damping."
        return blank(name, why, __name__, found.provenance)
    parts = [
        f"{title(key)}: growing mode {one.growing:.3g} kHz, strongest line afterwards "
        f"{one.strongest:.4g} kHz with {100 * one.tonal:.0f} % of the power at its multiples"
        for key, one in found.scenes.items()
    ]
    text = (
        "Levels of the contact force over time and frequency from the kicked equilibrium on, and "
        "spectra of the second half with marks at multiples of the strongest line. "
        f"{'; '.join(parts)}."
    )
    return Drawing(spectra_figure(found), text, name, origin(__name__, found.provenance))
