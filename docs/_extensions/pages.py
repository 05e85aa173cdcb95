"""Pages that the package writes itself: findings, contents of the report; the live page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from page import PAGE, SITE
from squeal.article.cases import STEMS
from squeal.article.commands.claims import scene_files
from squeal.article.contents import STUDIES, report_file
from squeal.article.report.captions import captions, title
from squeal.article.studies.findings import study
from squeal.io.provenance import digest

FINDINGS = "squeal.article.studies.findings"
ROOT = Path(__file__).resolve().parents[2]
LIVE = ROOT / "page" / "built" / PAGE


def findings() -> str:
    """The findings, each with what was measured while the site was built."""
    return "\n".join(
        f"({found.id.lower()})=\n## {found.id}: {found.where}\n\n{_escaped(found.statement)}\n\n"
        f"Worth\n: {_escaped(found.worth)}\n\nMeasured\n: {_escaped(found.outcome)}\n"
        for found in study(scene_files(None, STEMS)).findings
    )


def contents() -> str:
    """The report's figures, tables and results."""
    parts = [
        f"`{report_file(name)}`\n: {_escaped(title(text)) or '...'}\n"
        for name, text in captions().items()
    ]
    parts.append(f"Results: {', '.join(f'`results/{name}.json`' for name in STUDIES)}.\n")
    return "\n".join(parts)


def _escaped(text: str) -> str:
    return text.replace("*", r"\*").replace("_", r"\_").replace("$", r"\$")


def _write(place: Path, text: str) -> None:
    """Write a file unless it says the same already, so that Sphinx reads what is new only."""
    if not place.is_file() or place.read_text(encoding="utf-8") != text:
        place.write_text(text, encoding="utf-8")


def write(app: Sphinx) -> None:
    """Write the pages into generated/; findings only if their sources have changed."""
    folder = Path(app.srcdir) / "generated"
    folder.mkdir(exist_ok=True)
    _write(folder / "contents.md", contents())
    measured = folder / "findings.md"
    stamp = f"% made from the sources {digest(FINDINGS)}\n"
    if not measured.is_file() or not measured.read_text(encoding="utf-8").startswith(stamp):
        measured.write_text(stamp + findings(), encoding="utf-8")


def take_live_page(app: Sphinx, error: Exception | None) -> None:
    """Put the live page, where it was built, into the site, its links to the pages beside it."""
    if error is None and LIVE.is_file():
        text = LIVE.read_text(encoding="utf-8").replace(SITE, "")
        (Path(app.outdir) / PAGE).write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the writer; pages may speak of the live page under `only:: live`."""
    if LIVE.is_file():
        app.tags.add("live")
    app.connect("build-finished", take_live_page)
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
