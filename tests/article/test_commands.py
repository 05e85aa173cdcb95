"""The companion's commands where the article's scenes are not at hand."""

import pytest

from squeal.article.commands import claims
from squeal.commands.cli import main


@pytest.mark.parametrize("command", ["claims", "findings"])
@pytest.mark.parametrize("given", [[], ["--scenes", "."]])
def test_away_from_the_repository_the_scenes_are_asked_for(
    command, given, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(claims, "ROOT", tmp_path / "squeal")
    assert main([command, *given]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"squeal: --scenes {given[1] if given else 'workflow/scenes'}: holds no")
    assert "repository" in told
