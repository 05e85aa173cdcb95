"""Files that cannot be written are refused before anything is computed."""

import os

import pytest

from squeal.errors import InputError
from squeal.io.writing import check_writable


def test_only_a_plain_file_in_a_writable_folder_is_an_output(tmp_path, monkeypatch):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path, words in (
        (tmp_path, "is a folder; the name of a file is allowed"),
        (pipe, "is not a plain file; the name of a file is allowed"),
        (tmp_path / "none" / "a.csv", "the folder .*none does not exist"),
    ):
        with pytest.raises(InputError, match=f"--csv {path}: {words}"):
            check_writable(path, "--csv")
    good = tmp_path / "a.csv"
    check_writable(good, "--csv")
    good.touch()
    check_writable(good, "--csv")
    monkeypatch.setattr(os, "access", lambda path, mode: (path, mode) != (tmp_path, os.W_OK))
    with pytest.raises(InputError, match="is not writable"):
        check_writable(good, "--csv")
