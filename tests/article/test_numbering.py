"""Numbers of figures and tables, and the line that says what a build comes from."""

import re
import subprocess

import pytest

from squeal.article.report import numbering
from squeal.article.report.source import source, where
from squeal.errors import InputError

REPORT = r"""
\ref{sets} % \ref{late}
\drawn{fig08}\drawn{fig03} \numbered{figure}{one} \tabled{sets} \wide{two} \numbered{table}{table1}
\ref{one} and \ref{two}
"""


def test_the_articles_numbers_stay_and_ours_are_counted_by_kind_and_text():
    found = numbering.numbers(
        {"report.tex": REPORT, "supplement.tex": r"\tabled{late}\wide{three}"}
    )
    assert found == {
        "fig08": "8", "fig03": "3", "one": "R1", "two": "R2", "sets": "R1", "table1": "1",
        "late": "S1", "three": "S1",
    }  # fmt: skip


def test_a_number_of_what_stands_nowhere_is_refused():
    with pytest.raises(
        InputError, match=r"report\.tex: \\numberof\{late\}: no such figure or table"
    ):
        numbering.numbers({"report.tex": REPORT + r"\numberof{late}"})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (r"\ref{one} and \ref{two}", r"\ref{two} and \ref{one}", "first cited in the order two"),
        (r"\ref{one}", "", "figure one: is nowhere cited"),
        (r"\ref{sets}", "", "table sets: is nowhere cited"),
    ],
)
def test_what_is_not_cited_in_order_is_refused(old, new, message):
    numbering.check_order(REPORT, "report.tex")
    with pytest.raises(InputError, match=rf"report\.tex: .*{message}"):
        numbering.check_order(REPORT.replace(old, new), "report.tex")


def test_a_build_names_its_commit_and_changes_since(tmp_path, monkeypatch):
    def git(*words):
        command = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b", *words]
        run = subprocess.run(command, check=True, capture_output=True, text=True)
        return run.stdout.strip()

    citation = tmp_path / "CITATION.cff"
    citation.write_text(
        'date-released: 2026-11-20\nrepository-code: "https://example.org/squeal"\n'
    )
    released = where(tmp_path)
    assert (released["commit"], released["date"]) == ("of the release", "2026-11-20")
    assert released["repository"] == "https://example.org/squeal"
    monkeypatch.setenv("GIT_COMMITTER_DATE", "2026-11-21T23:30:00-05:00")
    git("init", "--quiet")
    git("add", ".")
    git("commit", "--quiet", "--message=a")
    made = source(tmp_path)
    assert re.fullmatch("[0-9a-f]{10}", made.commit)
    assert git("rev-parse", "HEAD").startswith(made.commit)
    assert made.date == "2026-11-22"
    citation.write_text("license: MIT\n")
    assert source(tmp_path).commit == f"{made.commit} with uncommitted changes"
    (tmp_path / "in").mkdir()
    assert source(tmp_path / "in").commit == "of the release"
