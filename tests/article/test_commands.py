"""The companion's commands where the article's scenes are not at hand."""

import errno
import os
from importlib import import_module

import pytest

from squeal.cli.main import main


@pytest.mark.parametrize("command", ["claims", "findings"])
def test_a_folder_without_scenes_is_refused(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([command, "--scenes", "."]) == 2
    assert capsys.readouterr().err.startswith("squeal: --scenes .: holds no")


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (KeyboardInterrupt(), 130, "stopped"),
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), 1, "output: No space left on device"),
    ],
)
@pytest.mark.parametrize(
    ("program", "arguments", "called"),
    [
        ("studies.__main__", "angles", "import_module"),
        ("figures.__main__", "modes --out modes.pdf", "import_module"),
    ],
)
def test_programs_of_the_workflow_end_as_commands_do(
    program, arguments, called, error, code, message, tmp_path, monkeypatch, capsys
):
    def stopped(*_):
        raise error

    monkeypatch.chdir(tmp_path)
    module = import_module(f"squeal.article.{program}")
    monkeypatch.setattr(module, called, stopped)
    assert module.main(arguments.split()) == code
    assert tuple(capsys.readouterr()) == ("", f"{arguments.split()[0]}: {message}\n")
