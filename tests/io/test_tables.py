"""Terms with a table over a parameter: a rotor on bearings whose stiffness depends on speed."""

import numpy as np
import pytest

import squeal
from squeal.errors import InputError
from squeal.io.tables import read_table
from squeal.linear.moduli import Tabulated
from squeal.numerics.differentiation import Formula

SPEEDS = np.linspace(0.0, 400.0, 9)
SYSTEM = """
M: [[2.0, 0.0], [0.0, 2.0]]
C: [[6.0, 0.0], [0.0, 6.0]]
K:
  - {matrix: [[1.0e+5, 0.0], [0.0, 1.0e+5]]}
  - {matrix: [[0.0, 1.0], [-1.0, 0.0]], table: {file: bearing.csv, column: kxy}}
parameter: speed
"""


def written(folder, text=SYSTEM, cross=5.0 * SPEEDS):
    """The system file beside a table of a direct and a cross-coupled stiffness."""
    lines = ["Speed, kxx, kxy"]
    lines += [f"{speed}, 1.0, {value}" for speed, value in zip(SPEEDS, cross, strict=True)]
    (folder / "bearing.csv").write_text("\n".join(lines))
    (folder / "rotor.yaml").write_text(text)
    return folder / "rotor.yaml"


def test_a_rotor_is_unstable_from_the_speed_of_the_closed_form(tmp_path):
    """m r'' + c r' + (k - i q) r = 0 of r = x + i y is at its threshold where q = c sqrt(k / m)."""
    file = squeal.read_system(written(tmp_path))
    found = squeal.thresholds(file, 400.0)
    exact = 6.0 * np.sqrt(1e5 / 2.0) / 5.0
    assert found.first.mu == pytest.approx(exact, rel=1e-9)


def test_between_its_lines_a_smooth_table_is_close_to_the_function(tmp_path):
    file = squeal.read_system(written(tmp_path, cross=SPEEDS**2 / 80.0))
    exact = np.sqrt(6.0 * np.sqrt(1e5 / 2.0) * 80.0)
    assert squeal.thresholds(file, 400.0).first.mu == pytest.approx(exact, rel=1e-2)
    factor = file.system.K[1].factor
    for speed in SPEEDS:
        assert factor.value({"speed": speed}) == pytest.approx(speed**2 / 80.0, abs=1e-12)


def test_a_factor_multiplies_the_table_and_slopes_are_those_of_differences():
    table = Tabulated(Formula("a * a"), "speed", "b.csv", "kxx", (0.0, 1.0, 3.0), (0.0, 2.0, 3.0))
    at = {"a": 3.0, "speed": 1.7}
    step = 1e-6
    for name in at:
        ends = [table.value(at | {name: at[name] + move}) for move in (-step, step)]
        assert table.slope(at, name) == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-7)
    grid = np.linspace(0.2, 2.8, 400)
    slopes = [table.slope(at | {"speed": place}, "speed") for place in grid]
    seen = np.abs(np.diff(slopes) / np.diff(grid)).max()
    assert seen <= table.curvature(at, "speed", 0.2, 2.8) <= 1.3 * seen
    # by a: 2 times the tabulated quantity, which does not depend on it
    of_a = 2.0 * table.value(at | {"a": 1.0})
    assert of_a <= table.curvature(at, "a", 2.0, 4.0) <= of_a * (1 + 1e-9)


@pytest.mark.parametrize("suffix", ["mtx", "npz"])
def test_what_is_exported_has_the_same_roots(tmp_path, suffix):
    from squeal.queries.systems.matrices import write_system

    system = squeal.read_system(written(tmp_path)).system
    write_system(tmp_path / "out", system, suffix)
    again = squeal.read_system(tmp_path / "out" / "system.yaml").system
    for speed in (10.0, 333.0):
        assert np.array_equal(again.arrays({"speed": speed})[2], system.arrays({"speed": speed})[2])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("column: kxy", "column: kyy", "no column kyy"),
        ("column: kxy", "column: kxy, over: load", "no column load"),
        ("column: kxy", "column: kxy, over: frequency", "the key modulus takes"),
        ("column: kxy}", "column: kxy}, rayleigh: 1.0", "rayleigh: is not allowed beside table"),
        ("parameter: speed", "parameter: speed\nparameters: {speed: 900}", "400; 900 is needed"),
    ],
)
def test_what_a_table_cannot_give_is_refused(tmp_path, old, new, words):
    with pytest.raises(InputError, match=words):
        squeal.eigenvalues(squeal.read_system(written(tmp_path, SYSTEM.replace(old, new))))


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("speed,kxy\n0,1\n0,2\n", "line 3: speed 0 is not allowed; it must rise"),
        ("speed,kxy\n0,1\n", "1 lines of numbers; 2 or more are needed"),
        ("speed,kxy\n0,1\n1,-x\n", "line 3.kxy: '-x' is not allowed"),
    ],
)
def test_a_table_over_a_parameter_rises_and_has_two_lines(tmp_path, table, words):
    system = written(tmp_path)
    (tmp_path / "bearing.csv").write_text(table)
    with pytest.raises(InputError, match=f"bearing.csv: {words}"):
        squeal.read_system(system)


def test_a_proof_says_that_it_knows_no_enclosure(tmp_path):
    pytest.importorskip("flint")
    found = squeal.thresholds(squeal.read_system(written(tmp_path)), 400.0, prove=True)
    assert "no enclosure" in str(found)


@pytest.mark.parametrize(
    ("lines", "line"),
    [
        (["1,z,-5", '2,"z,-7', "3,z,-9"], "line 3"),  # nothing closes the quote
        (["1,z,-5", '2,"z,-7', '3,"z",-9'], "line 3"),  # the quote of another line closes it
        (["1,z,-5", "2,z,-7", '3,z,"-9'], "line 4"),
    ],
)
def test_a_stray_quote_swallows_no_line(tmp_path, lines, line):
    path = tmp_path / "load.csv"
    path.write_text("\n".join(["node,dof,force", *lines]))
    with pytest.raises(InputError, match=rf"load.csv: {line}: no table of comma-separated values"):
        read_table(path, ("node", "dof", "force"))


def test_a_line_break_in_a_quoted_cell_stays(tmp_path):
    path = tmp_path / "parts.csv"
    path.write_bytes(b'part,row\r\n"outer\npad",1\r\ndisc,2\r\n')
    _, lines = read_table(path, ("part", "row"))
    assert [line.cells["part"] for line in lines] == ["outer\npad", "disc"]
    assert str(lines[1].at).endswith("line 4")
