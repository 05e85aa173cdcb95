"""Horizon of predictability over the stiffness of the contact, from the study of the same name."""

import math

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.article.studies.horizon import LEVELS, ROUNDING, Horizon, Run
from squeal.plots.style import DOUBLE, Drawing, origin, style

CAPTION = r"""How far ahead stiff contact can be computed. (a) Relative error against quad
precision, line contact \val[n]{horizon.example} times as stiff as a support: the default path in
doubles, the second method in doubles, and quad precision from a start that is off by $10^{-15}$;
the dotted line grows by the Lyapunov exponent. (b) Points, (c) line: time at which the error passes
$10^{-9}$, in support periods, over the contact stiffness; dashed: the time in which the exponent
takes $10^{-16}$ to $10^{-9}$. Arrows from ten periods upwards: no such error until then."""
KINDS = {
    "double": ("#C8380E", "o", "-", "doubles"),
    "independent": ("#3498DB", "^", "--", "second method, doubles"),
    "start": ("#000000", "s", ":", "quad, start off by $10^{-15}$"),
}
"""Colour, mark, line and label by what is compared."""
TOP = 10.0  # periods
LARGEST_PREDICTED = 0.1  # error at which the line of the predicted growth ends


def _curves(axes: Axes, run: Run) -> None:
    """Draw the errors of a run over time, and their growth by the Lyapunov exponent as a line."""
    for kind, (colour, mark, line, _) in KINDS.items():  # a mark at every fourth time
        errors = getattr(run.errors, kind)
        axes.plot(run.times, errors, line, color=colour, lw=0.8)
        axes.plot(run.times[::4], errors[::4], mark, color=colour, mfc="white", ms=3.5, mew=0.8)
    # `predicted` is the time in which an error of `ROUNDING` grows to the first level; the line
    # ends at `LARGEST_PREDICTED`, or at TOP
    decades_to_level = math.log10(LEVELS[0] / ROUNDING)
    decades_to_end = math.log10(LARGEST_PREDICTED / ROUNDING)
    end = min(TOP, run.predicted * decades_to_end / decades_to_level)
    last = ROUNDING * 10.0 ** (decades_to_level * end / run.predicted)
    axes.plot([0.0, end], [ROUNDING, last], ":", color="0.5")
    axes.axhline(LEVELS[0], color="0.7", lw=0.6, zorder=0)
    axes.set(yscale="log", ylim=(1e-18, 10.0), xlim=(0.0, run.window))
    axes.set_yticks([10.0**n for n in range(-18, 1, 3)])
    axes.minorticks_off()
    axes.set_xlabel("time [support periods]")
    axes.set_ylabel("relative error")
    axes.set_title(f"(a) {run.model}, {run.stiffness:g} $k_1$", loc="left", pad=3.0)


def _first_horizons(run: Run) -> dict[str, float | None]:
    """The horizon at the first level by what is compared (a key of `KINDS`), in support periods.

    None where the error stays below that level in the window; of the runs in doubles the least.
    """
    return {
        "double": run.horizon[0] if run.horizon else None,
        "independent": run.independent[0],
        "start": run.start[0],
    }


def _horizons(axes: Axes, runs: tuple[Run, ...], title: str) -> None:
    """Draw horizons over the contact stiffness; an arrow where doubles have none up to `TOP`.

    Dashed is what the Lyapunov exponent predicts, where it is above 0.
    """
    chaotic = [run for run in runs if run.exponent > 0.0]
    axes.plot(
        [run.stiffness for run in chaotic],
        [run.predicted for run in chaotic],
        "--",
        color="0.4",
        lw=0.9,
        label="by the exponent",
    )
    for kind, (colour, mark, _, label) in KINDS.items():
        for run in runs:
            horizon = _first_horizons(run)[kind]
            if horizon is not None:
                axes.plot(run.stiffness, horizon, mark, color=colour, mfc="white", ms=4, mew=0.9)
            elif kind == "double" and run.window >= TOP:
                # an arrow without text, from `TOP` upwards
                axes.annotate(
                    "",
                    (run.stiffness, 2.2 * TOP),
                    (run.stiffness, TOP),
                    arrowprops={"arrowstyle": "->", "lw": 0.8, "shrinkA": 0, "shrinkB": 0},
                )
        # the mark in the legend, once for all runs
        axes.plot([], [], mark, color=colour, mfc="white", ms=4, mew=0.9, label=label)
    axes.set(xscale="log", yscale="log", xlim=(0.3, 3e8), ylim=(1e-2, 40.0))
    axes.set_xticks([10.0**n for n in range(0, 9, 2)])
    axes.set_yticks([10.0**n for n in range(-2, 2)])
    axes.minorticks_off()
    axes.set_xlabel("contact stiffness over $k_1$")
    axes.set_title(title, loc="left", pad=3.0)


def draw(record: Horizon) -> Drawing:
    """The figure, ready to be saved."""
    example = next(run for run in record.with_model("B2") if run.stiffness == record.example)
    with style():
        figure = Figure(figsize=(DOUBLE, 2.6))
        left, middle, right = figure.subplots(1, 3)
        _curves(left, example)
        _horizons(middle, record.with_model("B1"), "(b) B1")
        _horizons(right, record.with_model("B2"), "(c) B2")
        middle.set_ylabel("horizon [support periods]")
        right.tick_params(labelleft=False)
        handles, labels = middle.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
    parts = []
    for run in record.runs:
        horizon = f"none in {run.window:.2g} support periods"
        if run.horizon:
            horizon = f"{run.horizon[0]:.2g} support periods"
        predicted = f"{run.predicted:.2g}" if run.exponent > 0.0 else "none"
        parts.append(
            f"{run.model} {run.stiffness:g} k1 {horizon} (predicted by the exponent: {predicted})"
        )
    text = f"Horizon of predictability over contact stiffness: {'; '.join(parts)}."
    title = "Horizon of predictability"
    return Drawing(figure, text, title, origin(__name__, record.provenance))
