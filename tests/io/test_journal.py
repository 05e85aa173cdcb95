"""What is kept of long computations, and what is not taken for it."""

import numpy as np
import pytest

from squeal.io.writing import Checkpoint


def test_arrays_come_back_under_the_same_head(tmp_path):
    path = tmp_path / "table.csv"
    kept = Checkpoint(path, lambda: {"of": 1})
    assert kept.load() == {}
    kept.save(vectors=np.eye(2))
    kept.save(vectors=np.eye(3), samples=np.array([4, 2]))
    assert [p.name for p in tmp_path.iterdir()] == ["table.csv.partial.npz"]
    found = Checkpoint(path, lambda: {"of": 1}).load()
    assert np.array_equal(found["vectors"], np.eye(3))
    assert found["samples"].tolist() == [4, 2]
    assert Checkpoint(path, lambda: {"of": 2}).load() == {}
    kept.close()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", [b"", b"no arrays", b"PK\x03\x04 cut off"])
def test_a_damaged_file_does_not_count(tmp_path, text):
    (tmp_path / "table.csv.partial.npz").write_bytes(text)
    assert Checkpoint(tmp_path / "table.csv", lambda: {}).load() == {}


def test_without_an_output_nothing_is_kept():
    def head():
        raise AssertionError("not asked for")

    kept = Checkpoint(None, head)
    kept.save(vectors=np.eye(2))
    assert kept.load() == {}
    kept.close()
