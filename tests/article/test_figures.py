"""Figures draw the data that they are given, in the colours of the states, with embedded fonts."""

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb

from squeal.article.equations import quasi_static_map
from squeal.article.figures import (
    charts,
    coupling,
    energy,
    histories,
    line_springs,
    modes,
    sketch,
)
from squeal.article.figures.work import panels
from squeal.article.records import Missing
from squeal.article.runs import read_run
from squeal.article.studies.accuracy import Accuracy
from squeal.article.studies.energy import Energy
from squeal.article.studies.line_springs import Case, LineSprings
from squeal.article.studies.stability import SceneStability, Stability
from squeal.article.transitions import transitions
from squeal.cli.main import main
from squeal.io.scene import read_scene
from squeal.model.contact import FULL, LEAD, NONE, TRAIL, contact_law
from squeal.model.pad import coefficients
from squeal.plots import motion as traces
from squeal.plots import style
from squeal.plots.maps import VERDICT_COLOURS
from tests.conftest import ROOT

SCENES = ROOT / "workflow" / "scenes"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """One run of each contact model, by way of the files of `squeal simulate`."""
    folder = tmp_path_factory.mktemp("results")
    runs = {}
    for stem in ("b1-a", "b2-c"):
        with (folder / f"{stem}.json").open("w") as stream, pytest.MonkeyPatch.context() as patch:
            patch.setattr("sys.stdout", stream)
            history = str(folder / f"{stem}.csv")
            assert main(["simulate", str(SCENES / f"{stem}.yaml"), "--csv", history, "--json"]) == 0
        runs[stem] = read_run(folder / f"{stem}.json", Path(history))
    return runs


@pytest.mark.parametrize("stem", ["b1-a", "b2-c"])
def test_timeline_fills_the_run_and_gives_the_shares(runs, stem):
    run = runs[stem]
    assert run.timeline[0].start == 0.0
    assert run.timeline[-1].stop == run.stop
    for before, after in itertools.pairwise(run.timeline):
        assert before.stop == after.start
        assert before.state != after.state
    for state, share in run.shares.items():
        spent = sum(i.stop - i.start for i in run.timeline if i.state == state)
        assert spent / run.stop == pytest.approx(share, abs=1e-12)


@pytest.mark.parametrize("stem", ["b1-a", "b2-c"])
def test_curves_hold_every_sample_and_meet_at_the_events(runs, stem):
    run = runs[stem]
    t = run.history["t"]
    for signal in (signal.name for signal in contact_law(run.model).plotted):
        values = run.history[signal]
        curves = traces.pieces(t, values, run.timeline)
        drawn: dict[float, list[tuple[str, float]]] = {}
        for state, (times, heights) in curves.items():
            for time, height in zip(times, heights, strict=True):
                if not math.isnan(time):
                    drawn.setdefault(time, []).append((state, height))
        events = {interval.start for interval in run.timeline[1:]}
        # the end of the run may be off the last sample by rounding
        assert set(drawn) == set(t) | events | {run.stop}
        for time, value in zip(t, values, strict=True):
            for state, height in drawn[time]:
                assert height == pytest.approx(value, abs=1e-12, nan_ok=True)
                inside = [i for i in run.timeline if i.start <= time <= i.stop]
                assert state in {i.state for i in inside}
        for time in events:
            assert len({s for s, _ in drawn[time]}) == 2  # the curves of both states end here


@pytest.mark.parametrize(
    ("stem", "labels"), [("b1-a", ("F_{s,3}", "F_{s,4}")), ("b2-c", ("R_n", "delta"))]
)
def test_history_figure_shows_states_by_colour_and_place(runs, stem, labels):
    run = runs[stem]
    figure = histories.history_figure(run)
    first, second, strip = figure.axes
    palette = style.colours(run.model)
    for axes, label in zip((first, second), labels, strict=True):
        assert label in axes.get_ylabel()
        lines = {line.get_gid(): line for line in axes.get_lines() if line.get_gid()}
        assert list(dict.fromkeys(s.split()[0] for s in lines)) == run.states_met
        for state, line in lines.items():
            edge = {"leading": style.STATE_COLOURS[LEAD], "trailing": style.STATE_COLOURS[TRAIL]}
            name, _, side = state.partition(" ")
            assert line.get_color() == (edge[side] if side else palette[name])
            if side and axes is second:  # the reaction acts on that side of the centre
                place = np.asarray(line.get_ydata(), dtype=float)
                assert np.nanmedian(place) < 0.0 if side == "leading" else np.nanmedian(place) > 0.0
    assert "ms" in strip.get_xlabel()
    assert first.get_xlim() == (0.0, 1e3 * run.stop)
    rows = {str(bars.get_gid()): bars for bars in strip.collections}
    assert {name.split()[0] for name in rows} == set(run.states_met)
    heights = set()
    spent: dict[str, float] = {}
    for state, bars in rows.items():
        boxes = [path.get_extents() for path in bars.get_paths()]
        heights.add(tuple({round(box.y0, 9) for box in boxes}))
        name = state.split()[0]
        spent[name] = spent.get(name, 0.0) + sum(b.width for b in boxes)
        colour = to_hex(tuple(np.asarray(bars.get_facecolor())[0])).upper()
        assert colour == {line.get_gid(): line for line in first.get_lines()}[state].get_color()
    for name, width in spent.items():
        assert width == pytest.approx(1e3 * run.shares[name] * run.stop, abs=1e-9)
    assert len(heights) == len(rows)  # the second cue: a row of its own for each state
    assert figure.get_size_inches()[0] in (style.SINGLE, style.DOUBLE)


def test_state_colours_stand_out_on_white():
    """WCAG 2 contrast of at least 3:1 for graphical objects, and no two alike."""

    def luminance(colour):
        encoded = np.array(to_rgb(colour))
        linear = np.where(encoded <= 0.03928, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
        return np.array([0.2126, 0.7152, 0.0722]) @ linear

    values = [luminance(colour) for colour in style.STATE_COLOURS.values()]
    assert all(1.05 / (value + 0.05) >= 3.0 for value in values)
    assert len(set(style.STATE_COLOURS.values())) == 4


@pytest.mark.parametrize("areas", [VERDICT_COLOURS])
def test_areas_of_a_map_differ_in_grey(areas):
    """By the luma of ITU-R BT.601, by which a grey print shows a colour."""
    greys = sorted(np.array([0.299, 0.587, 0.114]) @ to_rgb(colour) for colour in areas)
    assert min(np.diff(greys)) > 0.1


def drawings(runs):
    yield histories.drawing(runs["b1-a"])
    yield histories.drawing(runs["b2-c"])
    yield charts.draw("B1")
    yield sketch.draw(SCENES / "b2-c.yaml")


def test_saved_figures_embed_fonts_name_their_origin_and_repeat(runs, tmp_path):
    for number, (once, again) in enumerate(zip(drawings(runs), drawings(runs), strict=True)):
        first = tmp_path / f"{number}.pdf"
        second = tmp_path / f"{number}-again.pdf"
        style.save(once, first)
        style.save(again, second)
        data = first.read_bytes()
        assert data == second.read_bytes()
        assert b"/FontFile2" in data
        assert b"/Type3" not in data
        assert b"CreationDate" not in data
        assert once.origin.encode() in data.replace(b"\\", b"")
        assert "drawn by squeal." in once.origin
        text = first.with_suffix(".txt").read_text().strip()
        assert text == once.alternative
        assert len(text) > 80


@pytest.mark.parametrize("model", ["B1", "B2"])
def test_chart_shows_every_transition(model):
    links = charts.links(model)
    law = contact_law(model)
    name = law.state_name
    single = {(name(t.source), name(t.target)) for t in transitions()}
    assert {ends for ends, gaps in links.items() if gaps == 1} == single
    full = name(FULL)
    apart = name(NONE)
    assert {ends for ends, gaps in links.items() if gaps == 2} == {(full, apart), (apart, full)}
    texts = [text.get_text() for text in charts.chart(model).axes[0].texts]
    for label in law.meanings:
        assert any(re.search(rf"(state )?{label}\n", text) for text in texts)
    for a, b in links:
        assert f"{a}–{b}" in texts


def test_sketch_is_to_scale():
    """Corners by Eq. (2) at x = y = theta = 0, spring directions by Eq. (1)."""
    pad = read_scene(SCENES / "b1-c.yaml").pad.replace(theta0=0.1, alpha1=0.6, alpha2=2.0)
    c = coefficients(math, pad, False)
    d = math.hypot(pad.w, pad.h)
    beta = math.asin(pad.h / math.hypot(pad.w, pad.h))
    at = sketch.corners(c)
    ways = sketch.towards_ground(c)
    expected = {
        "1": (-d * math.cos(beta - 0.1), d * math.sin(beta - 0.1)),
        "2": (d * math.cos(beta + 0.1), d * math.sin(beta + 0.1)),
        "l": (-d * math.cos(beta + 0.1), -d * math.sin(beta + 0.1)),
        "t": (d * math.cos(beta - 0.1), -d * math.sin(beta - 0.1)),
    }
    for corner, place in expected.items():
        assert at[corner] * pad.w == pytest.approx(place, rel=1e-12)
    assert ways["1"] == pytest.approx((math.cos(0.6), math.sin(0.6)), rel=1e-12)
    assert ways["2"] == pytest.approx((-math.cos(2.0), math.sin(2.0)), rel=1e-12)


@pytest.mark.parametrize(
    ("stem", "symbols"),
    [("b1-c", ["k_3", "k_4", "L_3"]), ("b2-c", ["k_c", "R_n", "R_f", r"\delta"])],
)
def test_sketch_holds_the_symbols(stem, symbols):
    figure = sketch.sketch(read_scene(SCENES / f"{stem}.yaml"))
    texts = " ".join(text.get_text() for text in figure.axes[0].texts)
    common = ["x", "y", r"\theta", r"\alpha_1", r"\alpha_2", "k_1", "k_2", "L_1", "d", r"\beta"]
    for symbol in [*common, "2h", "2w", "F_n", "V", r"\vec{e}_x", r"\vec{e}_y", *symbols]:
        assert symbol in texts


def test_quasi_static_map_is_eq_23():
    pad = read_scene(SCENES / "b3.yaml").pad
    maps = quasi_static_map(pad, 24)
    d = math.hypot(pad.w, pad.h)
    beta = math.atan2(pad.h, pad.w)
    t0 = pad.theta0
    for i, j in itertools.product(range(24), repeat=2):
        a, b = maps.angles[i], maps.angles[j]
        K11 = pad.k1 * math.cos(a) ** 2 + pad.k2 * math.cos(b) ** 2
        K21 = pad.k1 * math.sin(a) * math.cos(a) - pad.k2 * math.sin(b) * math.cos(b)
        K31 = -d * pad.k1 * math.cos(a) * math.sin(a + beta - t0)
        K31 -= d * pad.k2 * math.cos(b) * math.sin(b + beta + t0)
        printed = pad.mu < K11 / K21 and pad.mu < K31 / (pad.h * K21)
        # Rn/F_n = K11/(K11 - mu K21) from rows 1 and 2, K31/(K31 - mu h K21) from rows 2 and 3,
        # and x has the sign of Rn/K11 in row 1, that of Rn/K31 in row 3
        both = K11 / (K11 - pad.mu * K21) > 0 and K31 / (K31 - pad.mu * pad.h * K21) > 0
        assert maps.as_printed[i, j] == printed
        assert maps.complete[i, j] == (both and K11 > 0 and K31 > 0)


def _without_branches():
    missing = Missing("no steady sliding")
    names = ("b2-c", "b2-d")
    return Stability(
        tuple(SceneStability(n, "B2", 0.3, 0.04, 0.01, missing, missing) for n in names)
    )


@pytest.mark.parametrize(
    ("figure", "record"),
    [
        (coupling, _without_branches()),
        (modes, _without_branches()),
        (energy, Energy(dict.fromkeys(("b1-c", "b2-c-mean"), Missing("no steady sliding")))),
        (line_springs, LineSprings({"a": Case(Missing("no steady sliding"), ())}, stop=1.0)),
    ],
)
def test_a_figure_of_nothing_says_why(figure, record):
    assert figure.draw(record).alternative == "no steady sliding"


def test_no_case_of_the_figures_of_work_is_left_out():
    record = Accuracy(points=(), changes=dict.fromkeys("1234567", 0), truth="")
    figure, empty = panels(record, lambda _: 1.0, "evaluations", 2, 4.6)
    titles = [axes.get_title(loc="left") for axes in figure.axes if axes not in empty]
    assert titles == ["(a) 1", "(b) 2", "(c) 3", "(d) 4", "(e) 5", "(f) 6", "(g) 7"]
    with pytest.raises(ValueError, match="longer"):  # a row has half as many panels as cases
        panels(record, lambda _: 1.0, "evaluations", 1, 4.6)
