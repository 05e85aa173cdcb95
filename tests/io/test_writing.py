"""What is written: whole or not at all, every digit."""

import csv
import json
import math
import os
import random
import re
from argparse import Namespace
from operator import itemgetter

import numpy as np
import pytest

import squeal
from squeal.cli.options import check_outputs
from squeal.errors import ComputationError, InputError
from squeal.io.writing import Column, Table, remaining, to_json, whole_folder

TABLE = Table([Column("n", value=int)], [1])


def test_only_a_plain_file_in_a_writable_folder_is_an_output(tmp_path, monkeypatch):
    def check(path):
        check_outputs(Namespace(table=path, typed={"table": f"--csv {path}"}), [])

    (tmp_path / "folder.csv").mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    for name in ("folder.csv", "pipe.csv", "none/a.csv"):
        with pytest.raises(InputError, match=f"--csv {tmp_path / name}: "):
            check(tmp_path / name)
    good = tmp_path / "a.csv"
    check(good)
    good.touch()
    check(good)
    monkeypatch.setattr(os, "access", lambda path, mode: (path, mode) != (tmp_path, os.W_OK))
    with pytest.raises(InputError, match=f"--csv {good}: "):
        check(good)


def refused(path):
    with pytest.raises(InputError, match=f"{path}: cannot be written"):
        TABLE.save(path)


def test_a_written_file_keeps_the_permissions_of_the_one_before(tmp_path):
    path = tmp_path / "private.csv"
    path.touch(0o600)
    (tmp_path / "link.csv").symlink_to(path)
    for name in ("private.csv", "link.csv"):
        TABLE.save(tmp_path / name)
        assert (path.read_text(), path.stat().st_mode & 0o777) == ("n\n1\n", 0o600)
    assert (tmp_path / "link.csv").is_symlink()
    with whole_folder(tmp_path) as folder:
        TABLE.save(folder / "private.csv")
        TABLE.save(folder / "other.csv")
    assert path.stat().st_mode & 0o777 == 0o600
    TABLE.save(tmp_path / "new.csv")
    mask = os.umask(0)
    os.umask(mask)
    for name in ("new.csv", "other.csv"):
        assert (tmp_path / name).stat().st_mode & 0o777 == 0o666 & ~mask


def write_beside(folder, meanwhile):
    """Write late.csv into a new folder; `meanwhile` is called before it is complete."""
    with whole_folder(folder, is_new=True) as late:
        TABLE.save(late / "late.csv")
        meanwhile()


@pytest.mark.parametrize("exists", [False, True])
@pytest.mark.parametrize("other", ["new.csv", "x/new.csv"])
def test_of_two_that_write_into_a_new_folder_one_is_refused(tmp_path, exists, other):
    folder = tmp_path / "deep" / "out"
    if exists:
        folder.mkdir(parents=True)

    def write_other():
        with whole_folder(folder, is_new=True) as early:
            (early / other).parent.mkdir(exist_ok=True)
            TABLE.save(early / other)

    with pytest.raises(InputError, match="out: is not empty any more; a new or empty folder"):
        write_beside(folder, write_other)
    assert [path for path in folder.rglob("*") if path.is_file()] == [folder / other]


def test_no_folder_is_written_while_another_process_writes_it(tmp_path):
    claim = tmp_path / ".squeal-claim"
    with pytest.raises(InputError, match="another process writes into it"):
        write_beside(tmp_path, claim.touch)
    assert list(tmp_path.iterdir()) == [claim]


def test_no_pipe_and_no_folder_is_replaced_by_a_file(tmp_path):
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    refused(pipe)
    assert pipe.is_fifo()
    (tmp_path / "folder.csv").mkdir()
    refused(tmp_path / "folder.csv")
    assert {one.name for one in tmp_path.iterdir()} == {"pipe.csv", "folder.csv"}


@pytest.mark.parametrize("length", [250, 255])
def test_a_name_as_long_as_the_system_allows_is_written(tmp_path, length):
    path = tmp_path / ("n" * (length - 4) + ".csv")
    TABLE.save(path)
    assert path.read_text() == "n\n1\n"
    refused(tmp_path / ("n" * 252 + ".csv"))
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("most", "shown"), [(4, "0 1 8 9"), (5, "0 1 2 8 9"), (20, "0 1 2 3 4 5 6 7 8 9")]
)
def test_a_long_table_shows_both_ends(most, shown):
    table = Table((Column("k", value=int),), range(10))
    _, *lines = table.text(most).splitlines()
    assert [line.strip() for line in lines if "..." not in line] == shown.split()


UNITS = {"t": "s", "x": "m", "state": "", "n": ""}
ROWS = [
    (0.0, 1 / 3, "FC", 1),
    (1e-300, -math.pi * 1e-7, "SS", 2**53),
    (2.5, None, "1", -3),
    (np.nextafter(2.5, 3.0), 5e-324, "", 0),
]


def test_every_digit_comes_back(tmp_path):
    table = Table([Column(*each, itemgetter(i)) for i, each in enumerate(UNITS.items())], ROWS)
    with np.printoptions(legacy="1.13"):  # as other packages leave NumPy
        for name in ("x.json", "x.csv"):
            table.save(tmp_path / name)
    found = json.loads((tmp_path / "x.json").read_text())
    assert found["units"] == UNITS
    assert [tuple(row.values()) for row in found["rows"]] == ROWS
    with (tmp_path / "x.csv").open(newline="") as stream:
        head, *rows = csv.reader(stream)
    assert head == ["t [s]", "x [m]", "state", "n"]
    assert [(float(t), float(x) if x else None, s, int(n)) for t, x, s, n in rows] == ROWS


@pytest.mark.parametrize("left", [0, 1, 2, 7])
@pytest.mark.parametrize("form", ["text", "html"])
def test_a_long_table_shows_some_rows_and_counts_the_others(left, form):
    """Every value is shown once, or counted in the one number that is no value."""
    table = Table([Column("n", "", int)], range(1000, 1006 + left), "a title")
    found = [int(one) for one in re.findall(r"\d+", getattr(table, form)(6))]
    values = [n for n in found if n >= 1000]
    counts = [n for n in found if n < 1000]
    assert sorted(set(values)) == values
    assert len(values) == 6
    assert counts == ([left] if left else [])
    if form == "text" and left:  # the count stands where the rows are left out
        assert found == [1000, 1001, 1002, left, *range(1003 + left, 1006 + left)]
    assert "a title" in getattr(table, form)(6)


def test_a_long_table_shows_the_rows_of_greatest_rank():
    order = [*range(1000, 1100)]
    random.Random(1).shuffle(order)
    table = Table([Column("n", "", int)], order, rank=int)
    found = [int(one) for one in re.findall(r"\d+", table.text(7))]
    assert [n for n in found if n >= 1000] == [n for n in order if n > 1092]
    assert sum(n for n in found if n < 1000) == 93


def test_the_one_mode_that_grows_is_shown_among_a_hundred():
    """Two equal frequencies in the middle, which friction couples: growth mu b / (2 omega)."""
    hertz = np.arange(1.0, 101.0)
    hertz[50] = hertz[49]
    turn = np.zeros((100, 100))
    turn[49, 50] = 1.0
    turn[50, 49] = -1.0
    K = {"a": np.diag((math.tau * hertz) ** 2), "mu*b": turn}
    parameters = {"mu": 0.5, "a": 1.0, "b": 100.0}
    system = squeal.System(np.eye(100), 1e-3 * np.eye(100), K, parameters)
    found = squeal.eigenvalues(system, modes=100)
    swept = squeal.sweep(system, [0.0, 0.25, 0.5])
    assert found.unstable[0].growth_rate == pytest.approx(25.0 / (math.tau * 50), rel=1e-2)
    growth = f"{found.unstable[0].growth_rate:.6g}"
    moved = squeal.sensitivity(system, known=found).text()
    assert [growth in text for text in (found.table().text(), swept.text(), moved)] == [True] * 3
    assert len(re.findall(f"  {growth} +(?:mu|a|b) ", moved)) == 3


@pytest.mark.parametrize(("spent", "done", "count", "left"), [(10, 2, 6, 20), (600, 1, 3, 20)])
def test_what_remains_takes_as_long_each_as_what_is_done(monkeypatch, spent, done, count, left):
    monkeypatch.setattr("time.monotonic", lambda: 1000.0)
    (told,) = re.findall(r"[\d.]+", remaining(1000.0 - spent, done, count))
    assert float(told) == left


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan])
def test_json_holds_no_number_that_json_cannot_say(value):
    with pytest.raises(ComputationError):
        to_json({"one": [1.0, value]})
