"""`python -m workflow.release.codecheck > codecheck.yml`: the outputs that a CODECHECK compares.

With `--check` nothing is written: do they all stand where the file says (`make codecheck`)?
"""

from __future__ import annotations

import sys
from pathlib import Path

import yaml

from squeal.article.contents import FIGURES
from squeal.article.report.captions import captions, title
from workflow.release.codemeta import party

ROOT = Path(__file__).resolve().parents[2]
HEAD = """\
# What a CODECHECK of this repository reruns (make report) and compares. Written by `make metadata`.
"""


def text() -> str:
    """The file: the manifest of outputs, and what they belong to."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    entries = [
        {"file": "paper/report.pdf", "comment": "The paper"},
        {"file": "paper/supplement.pdf", "comment": "Its supplement"},
    ]
    for name, text in captions().items():
        file = f"figures/{name}.pdf" if name in FIGURES else f"paper/generated/{name}.tex"
        entries.append({"file": file, "comment": title(text)})
    found = {
        "version": "https://codecheck.org.uk/spec/config/1.0/",
        "manifest": entries,
        "paper": {
            "title": citation["title"],
            "authors": [{"name": party(author)["name"]} for author in citation["authors"]],
        },
    }
    return HEAD + yaml.safe_dump(found, sort_keys=False, allow_unicode=True, width=100)


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
