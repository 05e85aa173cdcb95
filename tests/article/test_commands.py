"""The companion's commands where the article's scenes are not at hand."""

import errno
import os
from importlib import import_module

import pytest

from squeal.article.commands import claims
from squeal.cli.main import main


@pytest.mark.parametrize("command", ["claims", "findings"])
@pytest.mark.parametrize("given", [[], ["--scenes", "."]])
def test_away_from_the_repository_the_scenes_are_asked_for(
    command, given, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(claims, "ROOT", tmp_path / "squeal")
    assert main([command, *given]) == 2
    message = capsys.readouterr().err
    assert message.startswith(
        f"squeal: --scenes {given[1] if given else 'workflow/scenes'}: holds no"
    )
    assert "repository" in message


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
