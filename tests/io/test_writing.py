"""What is written: whole or not at all, every digit."""

import math
import os
from argparse import Namespace

import numpy as np
import pytest
from scipy.io import netcdf_file

from squeal.cli.options import check_outputs
from squeal.errors import InputError
from squeal.io.writing import write_table


def test_only_a_plain_file_in_a_writable_folder_is_an_output(tmp_path, monkeypatch):
    def check(path):
        check_outputs(Namespace(table=path, table_said=f"--csv {path}"), [])

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


UNITS = {"t": "s", "x": "m", "state": "", "n": ""}
ROWS = [
    (0.0, 1 / 3, "FC", 1),
    (1e-300, -math.pi * 1e-7, "SS", 2**53),
    (2.5, None, "1", -3),
    (np.nextafter(2.5, 3.0), 5e-324, "", 0),
]


def read(path):
    with netcdf_file(path, mmap=False) as file:
        units = {n: getattr(v, "units", b"").decode() for n, v in file.variables.items()}
        shapes = {n: v.dimensions for n, v in file.variables.items()}
        return {n: v[:].copy() for n, v in file.variables.items()}, units, shapes


def test_every_digit_comes_back(tmp_path):
    path = tmp_path / "x.nc"
    write_table(path, UNITS, ROWS)
    found, units, shapes = read(path)
    assert set(found) == set(UNITS)
    assert units == UNITS
    for i, name in enumerate(UNITS):
        expected = [row[i] for row in ROWS]
        if name == "state":
            told = [b"".join(row).rstrip(b"\0").decode() for row in found[name]]
            assert told == expected
            assert shapes[name] == ("t", "state_length")
        else:
            numbers = [math.nan if v is None else float(v) for v in expected]
            assert np.array(found[name], dtype=float).tobytes() == np.array(numbers).tobytes()
            assert shapes[name] == ("t",)


def test_a_first_column_that_does_not_rise_is_no_coordinate(tmp_path):
    path = tmp_path / "x.nc"
    write_table(path, {"mu": "", "x": "m"}, [(0.1, 1.0), (0.1, 2.0)])
    assert read(path)[2] == {"mu": ("row",), "x": ("row",)}
    write_table(path, {"what": "", "x": "m"}, [("a", 1.0), ("b", 2.0)])
    assert read(path)[2] == {"what": ("row", "what_length"), "x": ("row",)}
    write_table(path, {"mu": "", "x": "m"}, [])
    assert read(path)[0]["x"].shape == (0,)


def test_xarray_reads_it(tmp_path):
    xarray = pytest.importorskip("xarray")
    path = tmp_path / "x.nc"
    write_table(path, UNITS, ROWS)
    found = xarray.load_dataset(path, engine="scipy")
    assert found["x"].attrs["units"] == "m"
    assert found["x"].dims == ("t",)
    assert found["t"].values.tolist() == [row[0] for row in ROWS]
    assert found["state"].values.astype(str).tolist()[:2] == ["FC", "SS"]
