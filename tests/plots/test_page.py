"""The page of a report: what it names, that it needs nothing else, what it refuses."""

import functools
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import block_diag

import squeal
from squeal.errors import InputError
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.plots.campbell import campbell_drawing
from squeal.plots.damping import COLOURS, damping_drawing
from squeal.plots.energy import energy_sweep_drawing
from squeal.queries.remedies.meetings import Cure
from squeal.queries.systems import thresholds as located
from squeal.reports import page as html
from tests.cli.calls import run
from tests.conftest import SCENES

pytestmark = pytest.mark.usefixtures("coarse_charts", "without_layout", "without_proof")


def pair(mu, name="pair"):
    """Flutter from mu = 3/4 on, at a circular frequency of sqrt(2)."""
    K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    return squeal.System(np.eye(2), K=K, parameters={"mu": mu}, name=name)


@functools.cache
def report_of_pair(mu):
    return squeal.report(pair(mu))


@pytest.fixture
def without_figures(monkeypatch):
    """Of the page the text alone: figures take longer than it."""
    monkeypatch.setattr(html, "_figure", lambda *_, **more: html._Figure("", ""))


@pytest.mark.parametrize(
    ("mu", "words", "end"),
    [
        (1.0, "Mode 2 (0.2274 Hz) grows by 0.2021 1/s", "mu = 1 lies 33.3 % above that."),
        (0.5, "Nothing grows at mu = 0.5. Stability is", "mu = 0.5 lies 33.3 % below that."),
    ],
)
@pytest.mark.usefixtures("without_figures")
def test_fault_and_loss_of_stability_are_those_of_the_closed_form(tmp_path, mu, words, end):
    report = report_of_pair(mu)
    first, *_ = report.opening.values()
    assert first.startswith(words)
    assert report.loss == f"Stability is first lost at mu = 0.75: flutter at 0.2251 Hz; {end}"
    report.save(tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert first in text
    assert text.count(">0.75<") == 1 + (mu > 0.75)  # the crossing, and the onset of what grows
    assert "outside of 0 to 2" in text


@pytest.mark.parametrize(
    ("mu", "end"), [(0.75, "0.2251 Hz, which is the present value."), (-0.5, "0.2251 Hz.")]
)
def test_a_share_of_the_loss_is_said_where_it_says_something(mu, end):
    assert squeal.report(pair(mu)).loss.endswith(end)


@pytest.mark.usefixtures("without_figures")
def test_no_search_of_a_page_begins_below_its_range(monkeypatch):
    """Damping 0.01/(W - 0.05) has a pole at 0.05, below the range; k is a way out."""
    C = {"1/(W - 0.05)": 0.01 * np.eye(2)}
    K = {"1": [[2, 0], [0, 2]], "k": [[0, 0], [0, 1]], "W": [[0, 1], [-1, 0]]}
    system = squeal.System(np.eye(2), C, K, parameters={"W": 1.0, "k": 1.0}, parameter="W")
    starts = []
    search = located.system_thresholds

    def recorded(system, high, low=None, *arguments, **options):
        starts.append(low)
        return search(system, high, low, *arguments, **options)

    monkeypatch.setattr(located, "system_thresholds", recorded)
    report = squeal.report(system, 2.0, low=0.1)
    assert report.remedy is not None
    assert len(starts) > 1
    assert set(starts) == {0.1}
    still = squeal.report(system.replace({"k": 9.0}), 2.0, low=0.1)
    assert still.loss == "No loss of stability from W = 0.1 up to W = 2."
    with pytest.raises(InputError, match="at most 1, the present W"):
        squeal.report(system, 2.0, low=1.5)


def test_the_loss_of_stability_is_one_of_the_band_where_one_is_given():
    """The pair at 0.1 to 0.3 Hz flutters, the band above holds no root."""
    assert "band" not in report_of_pair(1.0).loss
    for band, value in (((0.1, 0.3), "0.75"), ((0.4, 0.5), "up to")):
        loss = squeal.report(pair(1.0), band=band).loss
        assert "within the band" in loss
        assert value in loss


def test_a_limit_of_a_band_is_said_of_its_modes_alone_where_others_grow():
    """Two pairs that flutter from 3/4 on, the second at three times the frequency: of the band of
    the first alone friction below 3/4 is no way out while something grows outside."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    F = np.array([[0.0, 4 / 3], [0.0, 0.0]])
    early = 2.0 * 9.0 * F  # from 3/8 on
    both = {"1": np.kron(np.diag([1.0, 9.0]), K), "mu": block_diag([F, early]).toarray()}
    system = squeal.System(np.eye(4), K=both, parameters={"mu": 1.0})
    alone = squeal.report(system, band=(0.1, 0.3))
    assert alone.advice.startswith("For 0.1 to 0.3 Hz alone: move further apart modes 1 and 2")
    assert "Or keep mu below 0.375 (0.75 for 0.1 to 0.3 Hz, 0.375 for 0." in alone.advice
    assert " Hz outside), 62.5 % less than 1: " in alone.advice
    outside = (
        r"\. Outside of 0.1 to 0.3 Hz, 0.7\d+ Hz grows by [\d.]+ 1/s, faster than all inside\.$"
    )
    assert re.search(outside, alone.fault)
    assert alone.fault.startswith("Mode 1 (0.2274 Hz) grows by ")  # the mode of the band first


def test_thresholds_outside_of_a_band_are_left_out_of_complex_matrices():
    K = {"1": np.array([[2, -1], [-1, 2]]) * (1 + 0.001j), "mu": [[0, 4 / 3], [0, 0]]}
    system = squeal.System(np.eye(2), K=K, parameters={"mu": 1.0})
    report = squeal.report(system, band=(0.22, 0.24))
    assert report.bound is None or "outside" not in "".join(report.bound.reservations)


def test_the_page_needs_no_other_file_and_holds_no_markup_of_a_name(tmp_path):
    squeal.report(pair(1.0, "<script>x\x1b</script>")).save(tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert not re.search(r'(?:src|href)="(?!data:)|url\(|@import|<script', text)
    assert "\x1b" not in text


def test_the_command_writes_it_and_refuses_what_it_cannot_write(capsys, tmp_path):
    scene = SCENES / "b3.yaml"
    coupled = ("--set", "alpha1=1.0", "--set", "alpha2=2.6")
    code, out, _ = run(capsys, "report", scene, *coupled, "--output", tmp_path / "a.html")
    assert code == 0
    assert "Verdict: " in out
    assert (tmp_path / "a.html").stat().st_size > 10_000
    (tmp_path / "b.html").write_text("mine")
    for name in ("a.txt", "b.html"):
        code, _, err = run(capsys, "report", scene, "--output", tmp_path / name)
        assert code == 2
        assert name in err
    assert (tmp_path / "b.html").read_text() == "mine"
    with pytest.raises(InputError, match=r"must end in one of \.html, \.csv, "):
        report_of_pair(1.0).save(tmp_path / "a.txt")


@pytest.mark.parametrize("copies", [1, 2])
@pytest.mark.usefixtures("without_figures")
def test_the_page_says_what_moves_the_onset_too(tmp_path, copies):
    """At c mu = 1 the pair coalesces; of two equal pairs at once no derivative is known."""
    K = {"1": np.kron(np.eye(copies), [[2, -1], [-1, 2]])}
    K["c*mu"] = np.kron(np.eye(copies), [[0, 1], [0, 0]])
    report = squeal.report(squeal.System(np.eye(2 * copies), K=K, parameters={"mu": 1, "c": 2.0}))
    report.save(tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert ("first loss (flutter at mu = 0.5)" in text) == (copies == 1)
    told = report.to_dict()["onset_sensitivity"]
    if copies == 1:
        assert told["parameters"]["c"] == pytest.approx(-0.25, rel=1e-9)
    else:
        assert told is None


def test_the_remedy_stops_the_growth_and_the_others_are_exact():
    """omega^2 = 2 +- sqrt(1 - c mu): at mu = 1 and c = 1.1 the pair grows, at c = 1 no longer."""
    K = {"1": [[2, -1], [-1, 2]], "c*mu": [[0, 1], [0, 0]]}
    system = squeal.System(np.eye(2), K=K, parameters={"mu": 1.0, "c": 1.1}, name="pair")
    report = squeal.report(system)
    grows = report.eigenvalues.unstable[0]
    assert report.remedy.change.parameter == "c"
    assert report.remedy.change.count == -9.1  # 9.0909... % in two digits
    assert not report.remedy.computed.unstable
    assert (
        report.remedy.with_margin.count == -18.0
    )  # 17.36 %: at mu = 1.1 the pair rests up to 1 / 1.1
    assert report.advice.startswith("Lower c (factor of friction) by 18 %, from 1.1 to 0.902: ")
    cost = "as much less friction force, or 10 % more normal force for the same."
    assert f"Or keep mu below 0.909, 9.1 % less than 1: {cost}" in report.advice
    assert report.to_dict()["remedy"]["after"] == pytest.approx(0.9999)
    damped = squeal.System(
        np.eye(2),
        -2 * grows.damping_ratio * abs(grows.root) * 1.01 * np.eye(2),
        K,
        {"mu": 1, "c": 1.1},
    )
    assert not squeal.eigenvalues(damped).unstable  # the damping that the page tells


@pytest.mark.usefixtures("without_figures")
def test_terms_sum_to_the_growth_rate_on_the_page():
    # two terms of one factor, as those of two contacts
    friction = np.array([[0.0, 2 / 3], [0.0, 0.0]])
    system = squeal.System(
        (Term(np.eye(2)),),
        (Term(0.02 * np.eye(2)),),
        (Term(np.array([[2.0, -1.0], [-1.0, 2.0]])), *[Term(friction, Formula("mu"))] * 2),
        parameters={"mu": 1.0},
        name="<b>pair",
    )
    report = squeal.report(system)
    table = html._feeds(report)
    total = 0.0
    for column in table.columns[1:]:
        total += sum(float(column.cell(row) or 0) for row in table.rows)
    rate = report.eigenvalues.unstable[0].growth_rate
    assert total == pytest.approx(rate, rel=1e-3)
    text = html.page(report)
    assert "&lt;b&gt;pair" in text
    assert "<b>pair" not in text
    labels = re.findall(r"<dt>(\w+)</dt>", text)
    assert labels == ["Fault", "Cause", "Remedy"]


def test_parameters_are_sorted_by_the_next_mode_where_the_first_has_no_derivatives(monkeypatch):
    """Derivatives of a root that two others coalesce with are NaN."""
    report = report_of_pair(1.0)
    faster, slower = np.array([0.2 + 1.0j, 0.1 + 2.0j])
    names = ["a", "b", "c", "d"]
    slopes = {name: np.array([np.nan, size]) for name, size in zip(names, range(1, 5), strict=True)}
    sensitivity = replace(
        report.sensitivity,
        slopes=slopes,
        values=dict.fromkeys(names, 1.0),
        units=dict.fromkeys(names, ""),
    )
    modes = {2: SimpleNamespace(root=faster), 1: SimpleNamespace(root=slower)}
    monkeypatch.setattr(html, "_growing", lambda _: modes)
    spectrum = SimpleNamespace(values=np.array([faster, slower]))
    found: Any = SimpleNamespace(eigenvalues=spectrum, sensitivity=sensitivity, onset=None)
    assert html._moves(found).rows == ["d", "c", "b", "a"]


def test_only_what_is_proved_is_said_to_be():
    report = report_of_pair(1.0)
    for status, word in (("proved", "Proved"), ("counted", "Counted"), ("open", "A mode may be")):
        spectrum = replace(report.eigenvalues, proof={"status": status})
        losses = replace(
            report.thresholds,
            proof={"status": status, "growth_below": 1e-6, "extent": [0.0, 1.25]},
            certified=status != "open",
        )
        lines = list(html._confidence(replace(report, eigenvalues=spectrum, thresholds=losses)))
        assert lines[0].startswith(word)
        # a proof may end before the range does
        proved = "Proved too: no onset of growth by more than 1e-06 1/s from mu = 0 to 1.25 is"
        assert lines[1].startswith(proved) == (status == "proved")
        assert ("not proved" in lines[1]) == (status == "counted")


def test_a_count_that_certifies_nothing_is_not_said_to_certify():
    report = report_of_pair(1.0)
    for certified, words in ((True, "certified, not"), (False, "neither certified nor")):
        spectrum = replace(report.eigenvalues, proof={"status": "counted"}, certified=certified)
        sentence = next(html._confidence(replace(report, eigenvalues=spectrum)))
        assert sentence.startswith(f"Counted a second time ({words} proved): no mode is missing")


def test_nothing_has_to_change_where_nothing_grows():
    report = report_of_pair(0.5)
    assert report.advice == f"Nothing grows at mu = 0.5. {report.loss}"
    assert list(report.opening) == ["Verdict"]
    assert report.remedy is None


def test_beyond_a_range_without_stability_the_page_says_so():
    """Of x'' + c x' + x the damping c = (mu - 1) (mu - 2) + 0.1 is negative between two values."""
    C = {"(mu - 1)*(mu - 2) + 0.1": [[1.0]]}
    report = squeal.report(squeal.System([[1.0]], C, [[1.0]], {"mu": 2.5}), high=3.0)
    low = 1.5 - np.sqrt(0.15)
    assert report.thresholds.first.mu == pytest.approx(low)
    words = f"Stability is first lost at mu = {low:.4g}: flutter at 0.1592 Hz; mu = 2.5 lies"
    assert report.advice.startswith(
        f"Stable at mu = 2.5. {words} {100 * (2.5 / low - 1):.3g} % above"
    )


def two_pairs(c, second):
    """omega^2 = s (2 +- sqrt(1 - c mu)) with s = 1 and 4; of the second pair the formula `second`
    takes the place of c."""
    pair = np.array([[2.0, -1.0], [-1.0, 2.0]])
    coupling = np.array([[0.0, 1.0], [0.0, 0.0]])
    K = {"1": np.kron(np.diag([1.0, 4.0]), pair)}
    K["c*mu"] = np.kron(np.diag([1.0, 0.0]), coupling)
    K[f"({second})*mu"] = np.kron(np.diag([0.0, 4.0]), coupling)
    return squeal.System(np.eye(4), 0.002 * np.eye(4), K, parameters={"mu": 1.0, "c": c})


def growth_of(c, second, mu=1.0):
    """The largest growth rate of `two_pairs`, where the second pair has this number, by NumPy."""
    pair = np.array([[2.0, -1.0], [-1.0, 2.0]])
    coupling = np.array([[0.0, mu], [0.0, 0.0]])
    K = np.kron(np.diag([1.0, 0.0]), pair + c * coupling)
    K += np.kron(np.diag([0.0, 4.0]), pair + second * coupling)
    lower = np.hstack([-K, -0.002 * np.eye(4)])
    return np.linalg.eigvals(np.vstack([np.eye(4, 8, 4), lower])).real.max()


def test_what_stops_one_mode_and_drives_another_is_no_advice(monkeypatch):
    """From c = 1.15 on the second pair is at rest, the first from 1 down: what is left is told."""
    monkeypatch.setattr("squeal.queries.sweep.DRAWN_OF_SYSTEMS", 41)
    report = squeal.report(two_pairs(1.1, "2.15 - c"))
    assert report.remedy is None
    assert report.advice.startswith(
        "To stop both: move further apart modes 3 and 4 (0.4509 Hz) by raising the upper one by "
    )
    (part,) = report.search.partial
    c = part.change.after
    (left, *_) = part.computed.unstable
    assert left.growth_rate == pytest.approx(growth_of(c, 2.15 - c), rel=1e-6)
    assert left.growth_rate < growth_of(1.1, 1.05)
    # mode 3 of the second pair was the fastest, of the first pair mode 1 is now
    hertz = f"{left.frequency_hz:.4g} Hz"
    assert re.search(rf"{left.growth_rate:.3g} 1/s of mode 1 \({hertz}\)", str(report))
    for count in [*range(-100, 101), 150, 200, 300]:
        c = 1.1 * (1 + count / 100)
        assert growth_of(c, 2.15 - c) > 0.0


def test_a_change_with_which_another_mode_grows_is_no_remedy():
    """The first pair flutters above c = 1, the second, of twice its frequency, at c = 0.98."""
    report = squeal.report(two_pairs(0.98, "1.15 - 2 * (c - 0.98)"))
    assert report.remedy is None
    assert growth_of(1.06, 1.15 - 2 * 0.08) > 0.0


def test_a_parameter_that_helps_growth_and_harms_the_onset_has_both_signs_in_its_row():
    """The first pair is lost first, the second grows faster: the one with c, the other against."""
    report = squeal.report(two_pairs(1.1, "2.18 - c"))
    (row,) = (row for row in html._moves(report).records() if row["parameter"] == "c")
    fastest = report.eigenvalues.mode_of(report.eigenvalues.unstable[0])
    assert row[f"mode {fastest}, 1/s"] < 0.0
    assert row[f"first loss (flutter at mu = {report.thresholds.first.mu:.4g})"] < 0.0
    step = 1e-4
    assert growth_of(1.1 + step, 1.08 - step) < growth_of(1.1, 1.08)  # the second pair
    onset = report.thresholds.first.mu
    assert abs(growth_of(1.1, 1.08, onset)) < 1e-9
    assert growth_of(1.1 + step, 1.08 - step, onset) > 1e-9


def test_of_a_mode_with_two_growing_roots_the_page_shows_the_faster():
    """x'' - 5 x' + (4 k + mu / 100) x = 0 has two real roots s, with ds/dk = -4 / (2 s - 5)."""
    K = {"k": [[4.0]], "mu": [[0.01]]}
    report = squeal.report(squeal.System([[1.0]], [[-5.0]], K, parameters={"mu": 1.0, "k": 1.0}))
    roots = [mode.root.real for mode in report.eigenvalues.unstable]
    faster, slower = np.polynomial.Polynomial([4.01, -5.0, 1.0]).roots()[::-1]
    assert roots == pytest.approx([faster, slower])
    effects = {row["parameter"]: row["mode 1, 1/s"] for row in html._moves(report).records()}
    assert effects["k"] == pytest.approx(0.01 * -4.0 / (2.0 * faster - 5.0))
    assert effects["mu"] == pytest.approx(0.01 * -0.01 / (2.0 * faster - 5.0))


def test_the_tables_of_the_page_show_three_modes_though_a_faster_one_has_two_growing_roots():
    """x'' - 5 x' + 4 x = 0 beside two rows that vibrate and grow more slowly."""
    K = {"k": np.diag([4.0, 100.0, 900.0]), "mu": 0.01 * np.eye(3)}
    C = np.diag([-5.0, -0.2, -0.1])
    report = squeal.report(squeal.System(np.eye(3), C, K, parameters={"mu": 1.0, "k": 1.0}))
    assert len(report.eigenvalues.unstable) == 4
    modes = [row["mode"] for row in report.eigenvalues.growing.records()]
    numbers = list(dict.fromkeys(modes))
    assert len(numbers) == 3
    heads = [column.head for column in html._moves(report).columns]
    assert heads[2:5] == [f"mode {number}, 1/s" for number in numbers]
    assert len({column.head for column in html._feeds(report).columns}) == 4


def test_effects_that_are_noise_are_left_out():
    """The second pair has no part in the first loss, and d multiplies nothing but it."""
    K = {"1": np.kron(np.eye(2), [[2.0, -1.0], [-1.0, 2.0]]), "d": np.diag([0, 0, 9.0, 9.0])}
    K["c*mu"] = np.kron(np.diag([1.0, 0.0]), [[0.0, 1.0], [0.0, 0.0]])
    report = squeal.report(squeal.System(np.eye(4), K=K, parameters={"mu": 1.2, "c": 1.0, "d": 1}))
    assert {row["parameter"] for row in html._moves(report).records()} <= {"mu", "c"}


def rotating(speed):
    """Circulation against damping: whirl grows where 0.1 speed > 0.02, at one rad/s."""
    K = {"1": np.eye(2), "speed": 0.1 * np.array([[0.0, 1.0], [-1.0, 0.0]])}
    return squeal.System(np.eye(2), 0.02 * np.eye(2), K, {"speed": speed}, "speed")


@pytest.mark.usefixtures("without_figures")
def test_a_brake_at_rest_is_said_to_be_unstable_above():
    report = squeal.report(rotating(0.0), 2.0)
    assert report.advice == (
        "Stable at speed = 0 rad/s. Stability is first lost at speed = 0.2 rad/s (1.91 rpm): "
        "forward whirl begins to grow at 0.1592 Hz. Damped least is mode 1 (0.1591 Hz): 1 %."
    )
    loss = squeal.report(rotating(2.0), high=2.0).loss
    assert loss.endswith("; speed = 2 rad/s (19.1 rpm) is 10 times that.")
    assert "<h2>The modes over speed</h2>" in html.page(report)


def test_the_chart_has_the_numbers_and_the_frequencies_of_the_text():
    for mu in (0.9, 1.0):
        report = report_of_pair(mu)
        (mode,) = report.eigenvalues.unstable
        number_of_mode = report.eigenvalues.mode_of(mode)
        chart = html._chart(report)
        assert chart.reference.value == 0.0
        first = {one.mode: one.first_hz for one in chart.modes}
        assert first == pytest.approx({1: 0.5 / np.pi, 2: np.sqrt(3.0) / (2.0 * np.pi)})
        assert "Modes 1 and 2 (0.1592 and 0.2757 Hz at mu = 0)" in report.opening["Cause"]
        growing = [one.mode for one in chart.modes if one.growth_rate > 1e-3]
        assert growing == [number_of_mode]
        assert chart.names[number_of_mode] == f"mode {number_of_mode}, {mode.frequency_hz:.4g} Hz"


@pytest.mark.usefixtures("without_figures")
def test_the_damping_ratio_of_abaqus_stands_beside():
    """Twice the ratio with Im instead of the size, and no percent."""
    report = report_of_pair(1.0)
    root = np.sqrt(-2.0 - 1j * np.sqrt(1.0 / 3.0))  # omega^2 = 2 +- i sqrt(4 mu / 3 - 1)
    ratio = -2.0 * abs(root.real) / abs(root.imag)
    number_of_mode = report.eigenvalues.mode_of(report.eigenvalues.unstable[0])
    words = f"Abaqus prints -2 Re / |Im| without %: {ratio:.3g} for mode {number_of_mode}."
    assert words in html.page(report)


def test_parts_store_the_energy(capsys, tmp_path):
    """At mu = 1 K = [[2, 1/3], [-1, 2]] has the mode shapes (1, +-i sqrt(3))."""
    words = "Where its energy is: 75 % in right, 25 % in left."
    report = squeal.report(pair(1.0), parts={"left": [0], "right": [1]})
    assert words in report.opening["Cause"]
    text = "parameters: {mu: 1}\nM: [[1, 0], [0, 1]]\nK: [{matrix: [[2, -1], [-1, 2]]}, "
    text += "{matrix: [[0, 1.3333333333333333], [0, 0]], factor: mu}]\n"
    (tmp_path / "pair.yaml").write_text(text)
    (tmp_path / "parts.csv").write_text("part,row\nleft,1\nright,2\n")
    code, out, _ = run(capsys, "report", tmp_path / "pair.yaml", "--parts", tmp_path / "parts.csv")
    assert code == 0
    assert words in out
    for line, refusal in (
        ("left,3", "row: 3 is not allowed; it must be a whole number from 1 to 2"),
        (" ,2", "part: '' is not allowed; it must be the name of a part"),
    ):
        wrong = tmp_path / "wrong.csv"
        wrong.write_text(f"part,row\nleft,1\n{line}\n")
        code, _, err = run(capsys, "report", tmp_path / "pair.yaml", "--parts", wrong)
        assert code == 2
        assert refusal in err


@pytest.mark.parametrize("damping", [0.244, 0.246])
def test_limits_are_rounded_to_the_side_where_they_hold(damping):
    """x'' + (c - mu) x' + x: growth (mu - c) / 2 is the damping that stops it."""
    C = {"c": [[1.0]], "mu": [[-1.0]]}
    system = squeal.System([[1.0]], C, [[1.0]], {"mu": 1.0, "c": 1.0 - 2 * damping / 100})
    report = squeal.report(system)
    (meeting,) = report.meetings.values()
    assert meeting.cures[Cure.BOTH] == 0.0025
    limit = float(re.search(r"eep mu below ([\d.]+),", report.advice)[1])
    assert 0.999 * system.parameters["c"] < limit <= system.parameters["c"]


def test_the_table_of_terms_has_the_fastest_mode_first():
    report = squeal.report(two_pairs(1.1, "1.2"))
    heads = [column.head for column in html._feeds(report).columns[1:]]
    modes = [report.eigenvalues.mode_of(mode) for mode in report.eigenvalues.unstable]
    assert [int(head.split(",")[0].removeprefix("mode ")) for head in heads] == modes
    assert modes == sorted(modes, reverse=True)  # which is not the order of their numbers


def test_a_map_of_a_pad_is_drawn_with_its_exact_curve(capsys, tmp_path):
    typed = ["map", SCENES / "b1-a.yaml", "--n", "8", "--first", "mu:0.1:0.8"]
    typed += ["--second", "alpha2:2.8:3.4", "--figure", tmp_path / "map.svg"]
    code, _, _ = run(capsys, *typed)
    assert code == 0
    assert 'id="threshold"' in (tmp_path / "map.svg").read_text(encoding="utf-8")


def jeffcott(speed):
    """A Jeffcott rotor of 100 rad/s: 4 of outer and 2 of inner damping, limit 100 (1 + 4 / 2)."""
    skew = np.array([[0.0, 1.0], [-1.0, 0.0]])
    K = {"1": 2e4 * np.eye(2), "speed": 2.0 * skew}
    at = {"speed": speed}
    labels = ((1, 1), (1, 2))
    return squeal.System(
        2 * np.eye(2), 6 * np.eye(2), K, at, "speed", labels=labels, name="jeffcott"
    )


@functools.cache
def report_of_jeffcott():
    return squeal.report(jeffcott(350.0), 400.0)


@pytest.mark.usefixtures("without_figures")
def test_the_page_of_a_rotor_has_its_critical_speeds_and_its_limit():
    """Critical where Im lambda is the speed; backward whirl is damped more and forward one less.

    z of exp(lambda t): 2 lambda^2 + 6 lambda + 2e4 - 2 i W = 0.
    """
    report = report_of_jeffcott()
    assert report.thresholds.first.mu == pytest.approx(100 * (1 + 4 / 2), rel=1e-9)
    assert report.loss == (
        "Stability is first lost at speed = 300 rad/s (2865 rpm): "
        "forward whirl begins to grow at 15.92 Hz; "
        "speed = 350 rad/s (3342 rpm) lies 16.7 % above that."
    )
    # c of the support from 4 to 5 moves the onset to the speed: 1 / (2 m omega) is 0.25 %
    (meeting,) = report.meetings.values()
    assert meeting.cures[Cure.BOTH] == 0.0026
    # a tenth more of the speed: c of the support from 4 to 5.7
    damping = "both real modes at 15.92 Hz by 0.43 % of critical damping"
    assert f"Raise the damping of {damping}: nothing grows up to speed = 385" in report.advice
    assert "This damping must be stationary" in report.advice
    assert "mode of a pair" not in report.advice
    assert report.opening["Cause"].startswith(
        "Forward whirl, no other mode meets it: cross-coupled (skew-symmetric) stiffness puts in"
    )
    assert "keep speed below 300 rad/s (2865 rpm), 14.3 % less than 350." in report.advice
    for one in report.critical.critical:
        roots = np.roots([2.0, 6.0, 2e4 - 2j * one.speed])
        sign = {"forward": 1.0, "backward": -1.0}[one.direction]
        root = roots[np.argmax(sign * roots.imag)]
        assert sign * root.imag == pytest.approx(one.speed, rel=1e-9)
        assert root.real == pytest.approx(one.growth_rate, rel=1e-6)
    for row in report.critical.to_records():
        assert row["rpm"] == pytest.approx(row["speed"] * 60 / (2 * np.pi), rel=1e-15)
    text = html.page(report)
    assert report.critical.table().html() in text
    assert report.critical.table().text() in str(report)
    assert "steady sliding" not in text
    assert report_of_pair(0.5).critical is None


def test_what_crosses_has_the_number_of_the_chart_beside_its_own():
    """A disc tilts at -W +- sqrt(12 + W^2) and a mode stays at 3: the backward one falls below."""
    gyroscopic = np.zeros((3, 3))
    gyroscopic[:2, :2] = [[0.0, 2.0], [-2.0, 0.0]]
    K = np.diag([12.0, 12.0, 9.0])
    rotor = squeal.System(np.eye(3), {"speed": gyroscopic}, K, {"speed": 1.0}, "speed")
    rows = squeal.report(rotor, 5.0).to_dict()["critical_speeds"]
    numbers = [(row["mode"], row["number_in_chart"]) for row in rows]
    assert [round(row["speed"], 9) for row in rows] == [2.0, 3.0]
    assert numbers == [(1, 2), (2, 1)]
    report = report_of_pair(1.0)
    (crossing,) = report.to_dict()["thresholds"]["crossings"]
    assert crossing["number_in_chart"] == report.to_dict()["meetings"][0]["mode"]


def test_the_least_damped_mode_of_a_stable_brake_is_named():
    K = {"1": np.diag([1.0, 4.0]), "mu": [[0.0, 0.1], [-0.1, 0.0]]}
    system = squeal.System(np.eye(2), np.diag([0.04, 0.02]), K)  # at mu = 0
    assert "Damped least is mode 2 (0.3183 Hz): 0.5 %." in squeal.report(system).advice


@pytest.mark.usefixtures("without_figures")
def test_damping_that_a_file_adds_has_its_role_once(tmp_path):
    (tmp_path / "pair.yaml").write_text(
        "parameters: {mu: 1.0}\nM: [[1, 0], [0, 1]]\n"
        "K: [{file: K.mtx}, {file: F.mtx, factor: mu}]\ndamping: {rayleigh: [0.01, 0.0]}\n"
    )
    mmwrite(tmp_path / "K.mtx", np.array([[2.0, -1.0], [-1.0, 2.0]]))
    mmwrite(tmp_path / "F.mtx", np.array([[0.0, 1.34], [0.0, 0.0]]))
    squeal.report(squeal.read_system(tmp_path / "pair.yaml")).save(tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "(damping)" in text
    assert "(damping) (damping)" not in text


@pytest.mark.usefixtures("without_figures")
def test_a_mode_has_one_colour_in_the_chart_the_campbell_diagram_and_the_tables():
    report = report_of_jeffcott()
    chart = html._chart(report)
    figures = [damping_drawing("rotor", chart).figure]
    figures.append(campbell_drawing(report.critical, "rotor", paths=chart).figure)
    for figure in figures:
        lines = [line for axes in figure.axes for line in axes.get_lines()]
        assert {line.get_color() for line in lines if line.get_gid() == "pair 2"} == {COLOURS[0]}
    dot = f'<b style="color:{COLOURS[0]}">&#9679;</b> '
    text = html.page(report)
    assert f"<tr><td>{dot}2</td>" in text
    assert f"<th>{dot}mode 2, 15.92 Hz</th>" in text


@pytest.mark.parametrize("high", [2.0, 0.5])
@pytest.mark.filterwarnings("ignore:.*no matrix depends on")
def test_modes_have_the_numbers_of_the_chart_in_all_answers(high):
    """At rest 1, sqrt(3) and 2 rad/s; at mu = 1 the third is the lowest, 0.5^(1/2), and beyond 3/4
    the first two are a pair; a range that ends below the present value changes no number."""
    K = {"1": np.array([[2.0, -1, 0], [-1, 2, 0], [0, 0, 4]]), "mu": np.zeros((3, 3))}
    K["mu"][0, 1] = 4 / 3
    K["mu"][2, 2] = -3.5
    system = squeal.System(np.eye(3), 0.01 * np.eye(3), K, {"mu": 1.0, "unused": 1.0})
    report = squeal.report(system, high)
    numbers: dict[float, set[int]] = {}
    for number_of_mode, root in report.eigenvalues.of_modes:
        if root.value.imag > 0.0:
            numbers.setdefault(round(root.frequency_hz * 2 * np.pi, 3), set()).add(number_of_mode)
    assert numbers == {0.707: {3}, 1.429: {1, 2}}
    for row in report.sensitivity.table().records():
        assert row["mode"] in numbers[round(row["frequency_hz"] * 2 * np.pi, 3)]
    for term in report.energy.contributions:
        assert term.mode in numbers[round(term.frequency_hz * 2 * np.pi, 3)]
    assert report.opening["Cause"].startswith("Modes 1 and 2 (0.1592 and 0.2757 Hz at mu = 0)")


def test_a_mode_that_no_longer_vibrates_keeps_its_number():
    """1 - 2 mu of the second of three: it diverges at mu = 1, between two that stay."""
    K = {"1": np.diag([0.5, 1.0, 4.0]), "mu": np.diag([0.0, -2.0, 0.0])}
    system = squeal.System(np.eye(3), 0.01 * np.eye(3), K, parameters={"mu": 1.0})
    report = squeal.report(system)
    assert [report.eigenvalues.mode_of(mode) for mode in report.eigenvalues.unstable] == [2]


def test_a_change_with_hardly_an_effect_is_no_choice():
    """k adds at most 0.4 % to one of two stiffnesses that flutter far beyond their onset."""
    K = {"1": [[2, -1], [-1, 2]], "k": [[0.001, 0], [0, 0]], "mu": [[0, 4 / 3], [0, 0]]}
    report = squeal.report(squeal.System(np.eye(2), K=K, parameters={"mu": 1.5, "k": 1.0}))
    assert report.eigenvalues.unstable
    (row,) = report.remedies.rows
    assert row.name == "mu"
    words = "Changing k by up to a factor of 4 takes less than a tenth of the growth."
    assert words in str(report)


@pytest.mark.usefixtures("without_figures")
def test_a_lone_whirl_that_grows_is_no_flutter_in_words():
    report = report_of_jeffcott()
    assert report.thresholds.first.kind == "flutter"  # as files and records have it
    text = f"{html.page(report)} {report.thresholds} {report.eigenvalues}"
    assert "flutter" not in text
    assert "unstable whirl" in text


def test_a_term_has_one_colour_in_all_panels_and_the_legend_has_each():
    """The third mode is fed by another term than the pair."""
    M = np.eye(3)
    C = {"1": np.diag([0.2, 0.2, 0.0]), "mu": np.diag([0.0, 0.0, -0.1])}
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, 0.0], [0.0, 0.0, 9.0]])
    friction = np.zeros((3, 3))
    friction[0, 1] = 4 / 3
    system = squeal.System(M, C, {"1": K, "mu": friction}, parameters={"mu": 0.4})
    swept = squeal.energy_sweep(squeal.sweep(system, [0.3, 0.4, 0.5]))
    figure = energy_sweep_drawing(swept, "pair and one").figure
    colours: dict[str, set[str]] = {}
    for axes in figure.axes:
        for line in axes.lines:
            label = str(line.get_label())
            if not label.startswith("_"):  # the line of zero
                colours.setdefault(label, set()).add(str(line.get_color()))
    assert {"growth rate", "C: 1", "C: mu"} <= colours.keys()
    assert all(len(found) == 1 for found in colours.values())
    assert len(set.union(*colours.values())) == len(colours)
    assert {text.get_text() for text in figure.legends[0].get_texts()} == colours.keys()
