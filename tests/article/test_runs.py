"""What `squeal simulate --json` printed, read back."""

import json

import pytest

from squeal.article.runs import read_run
from squeal.errors import InputError


@pytest.mark.parametrize("left_out", ["events", "shares", "extrema"])
def test_a_summary_without_an_output_is_refused(tmp_path, left_out):
    file = tmp_path / "run.json"
    whole: dict[str, object] = {"events": [], "shares": {}, "extrema": {}}
    file.write_text(json.dumps({key: whole[key] for key in whole if key != left_out}))
    with pytest.raises(InputError, match=f"run.json: {left_out}: missing; the scene's outputs"):
        read_run(file, tmp_path / "run.csv")
