"""`python -m workflow.release.codecheck > codecheck.yml`: the outputs that a CODECHECK compares.

With `--check` nothing is written: do they all stand where the file says (`make codecheck`)?
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import yaml

from squeal.article.contents import FIGURES, report_file
from squeal.article.report.captions import captions, title
from squeal.article.report.numbering import PREFIXES, numbers
from squeal.article.report.source import ANNOUNCED
from workflow.release.codemeta import party

ROOT = Path(__file__).resolve().parents[2]
HEAD = """\
# What a CODECHECK of this repository reruns (make report) and compares. Written by `make metadata`.
"""
TAIL = """\
# Who checks adds: codechecker (name, ORCID), summary, check_time, repository, certificate, report.
"""


def text() -> str:
    """The file: the manifest of outputs, and what they belong to."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    entries = [
        {"file": "paper/report.pdf", "comment": "The paper"},
        {"file": "paper/supplement.pdf", "comment": "Its supplement"},
    ]
    texts = {name: (ROOT / "paper" / name).read_text(encoding="utf-8") for name in PREFIXES}
    known = numbers(texts)
    for name, text in captions().items():
        kind = "Figure" if name in FIGURES else "Table"
        number = f"{kind} {known[name]}. " if name in known else ""
        entries.append({"file": report_file(name), "comment": f"{number}{title(text)}"})
    found = {
        "version": "https://codecheck.org.uk/spec/config/1.0/",
        "paper": {
            "title": paper_title(),
            "authors": [_author(author) for author in citation["authors"]],
            "reference": _doi(citation) or ANNOUNCED,
        },
        "source": citation.get("repository-code", ANNOUNCED),
        "manifest": entries,
    }
    body = yaml.safe_dump(found, sort_keys=False, allow_unicode=True, width=100)
    return HEAD + body + TAIL


def paper_title() -> str:
    """The title of the report, as its PDF names it."""
    text = (ROOT / "paper" / "report.tex").read_text(encoding="utf-8")
    named = re.search(r"pdftitle=\{([^}]*)\}", text)
    if named is None:
        raise ValueError("paper/report.tex: pdftitle: missing")
    return named[1]


def _author(found: dict[str, str]) -> dict[str, str]:
    author = {"name": party(found)["name"]}
    if found.get("orcid"):
        author["ORCID"] = found["orcid"].rsplit("/", 1)[-1]
    return author


def _doi(citation: dict[str, Any]) -> str:
    return f"https://doi.org/{citation['doi']}" if "doi" in citation else ""


def manifest() -> list[str]:
    """The outputs that codecheck.yml names."""
    found = yaml.safe_load((ROOT / "codecheck.yml").read_text(encoding="utf-8"))
    return [entry["file"] for entry in found["manifest"]]


def missing() -> list[str]:
    """Those of them that a build has not left in the repository, or left empty."""
    return [f for f in manifest() if not (ROOT / f).is_file() or not (ROOT / f).stat().st_size]


def main() -> int:
    """Print the file, or check it: 1 if an output is missing."""
    if sys.argv[1:] != ["--check"]:
        print(text(), end="")
        return 0
    if lacking := missing():
        print(f"codecheck.yml: missing after the build: {', '.join(lacking)}", file=sys.stderr)
    return int(bool(lacking))


if __name__ == "__main__":
    sys.exit(main())
