"""The README's first queries are what a user gets, and its Python example runs."""

import io
import re
import shlex
from contextlib import redirect_stdout

import pytest
from matplotlib.image import imread

from squeal.cli.main import main
from tests.conftest import ROOT
from workflow.release.dist import absolute

README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def printed(command):
    out = io.StringIO()
    with redirect_stdout(out):
        assert main(shlex.split(command)) == 0
    return out.getvalue()


def test_console_blocks_show_what_the_commands_print(folder):
    blocks = [b for b in re.findall(r"```console\n(.*?)```", README, re.S) if "$ squeal " in b]
    pairs: list[tuple[str, str]] = []
    for block in blocks:
        parts = re.split(r"^\$ squeal (.*)\n", block, flags=re.M)[1:]
        pairs += zip(parts[::2], parts[1::2], strict=True)  # commands and what they print
    assert [command.split()[0] for command, _ in pairs] == [
        "example",
        "check",
        "eigenvalues",
        "eigenvalues",
        "report",
    ]
    for command, shown in pairs:
        if command.startswith("report "):  # prints nothing: among fewer modes
            command = command.replace("3500:7000", "5000:6500")
        out = printed(command)
        if "--chart" in command:
            name = command.split()[-1]
            difference = imread(folder / name) - imread(ROOT / "figures" / name)
            assert abs(difference).mean() < 0.002  # the picture at the top is the one it draws
        if shown:
            told = words(shown)
            made = words(out)
            assert len(told) == len(made)
            for one, other, following in zip(told, made, [*made[1:], ""], strict=True):
                # entries that cancel leave zeros, or rounding: by which products a processor makes
                rel = 1e-3 if following == "non-zeros" else 1e-5
                assert one == other or float(one) == pytest.approx(float(other), rel=rel)


def words(text):
    """Without what may differ between machines: the size of rounding, the number of steps."""
    return re.sub(r"\(rounding .*?\)|\d+ steps", "", without_errors(text)).split()


def without_errors(text):
    """Tables without the numbers of the columns `residual` and `error`, which stand right below."""
    lines = []
    ends = []  # of these columns in the present table
    for line in text.splitlines():
        headings = list(re.finditer(r"\b(?:residual|error(?:, \S+)?)(?=  |$)", line))
        if headings or not line:
            ends = [heading.end() for heading in headings]
        else:
            for end in reversed(ends):
                line = re.sub(r"\S+$", "-", line[:end]) + line[end:]
        lines.append(line)
    return "\n".join(lines)


def test_links_lead_to_files_and_away_from_them_in_a_package():
    links = set(re.findall(r"\]\(([^)]*)\)", README))
    assert {"figures/brake.png", "docs/start.md"} <= links
    assert all((ROOT / link).is_file() for link in links)
    away = set(re.findall(r"\]\(([^)]*)\)", absolute(README, "https://host.example/squeal")))
    expected = set()
    for link in links:
        kind = "raw" if link.endswith(".png") else "blob"
        expected.add(f"https://host.example/squeal/{kind}/main/{link}")
    assert away == expected


def test_python_example_runs(folder, capsys):
    printed("example brake")
    capsys.readouterr()
    example = re.search(r"```python\n(.*?)```", README, re.S)[1]
    exec(example, {})
    out = capsys.readouterr().out
    assert "3 unstable modes" in out
    assert "friction puts in 131.4 1/s" in out
