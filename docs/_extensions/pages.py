"""Pages that the package writes itself: findings, contents of the report, lists of names."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

import squeal
from page import PAGE, SITE
from squeal.article.cases import STEMS
from squeal.article.commands.claims import scene_files
from squeal.article.contents import FIGURES, STUDIES
from squeal.article.report.captions import captions, title
from squeal.article.studies.findings import study
from squeal.io.provenance import digest

FINDINGS = "squeal.article.studies.findings"
PACKAGES = sorted({m.name for m in pkgutil.iter_modules(squeal.__path__)} - {"__main__"})
ROOT = Path(__file__).resolve().parents[2]
LIVE = ROOT / "page" / "built" / PAGE


def findings() -> str:
    """The findings, each with what was measured while the site was built."""
    return "\n".join(
        f"({found.id.lower()})=\n## {found.id}: {found.where}\n\n{_escaped(found.statement)}\n\n"
        f"Measured\n: {_escaped(found.outcome)}\n"
        for found in study(scene_files(None, STEMS)).findings
    )


def contents() -> str:
    """The report's figures, tables and results."""
    figures = [
        f"`figures/{name}.pdf`" if name in FIGURES else f"`paper/generated/{name}.tex`"
        for name in captions()
    ]
    parts = [
        f"{file}\n: {_escaped(title(text)) or '...'}\n"
        for file, text in zip(figures, captions().values(), strict=True)
    ]
    parts.append(f"Results: {', '.join(f'`results/{name}.json`' for name in STUDIES)}.\n")
    return "\n".join(parts)


def _escaped(text: str) -> str:
    return text.replace("*", r"\*").replace("_", r"\_").replace("$", r"\$")


def api(folder: Path, name: str) -> set[Path]:
    """A page for a module and, below it, for all that it holds; returns their files.

    autosummary would do the same, but for modules that share their name with a function beside.
    """
    held = import_module(name)
    inner = sorted(m.name for m in pkgutil.iter_modules(getattr(held, "__path__", ())))
    modules = [f"{name}.{last}" for last in inner if not last.startswith("_")]
    lines = [name, "=" * len(name), "", f".. automodule:: {name}", ""]
    if modules:
        lines += [".. toctree::", "   :maxdepth: 1", "", *(f"   {one}" for one in modules), ""]
    _write(folder / f"{name}.rst", "\n".join(lines))
    return {folder / f"{name}.rst"}.union(*(api(folder, one) for one in modules))


def public() -> str:
    """What the package offers by itself: functions, then what they take and answer with."""
    names = sorted(squeal._HOME, key=lambda name: (name[0].isupper(), name.lower()))
    lines = "".join(f"   ~squeal.{squeal._HOME[name]}.{name}\n" for name in names)
    return f"```{{eval-rst}}\n.. autosummary::\n   :nosignatures:\n\n{lines}```\n"


def _write(place: Path, text: str) -> None:
    """Write a file unless it says the same already, so that Sphinx reads what is new only."""
    if not place.is_file() or place.read_text(encoding="utf-8") != text:
        place.write_text(text, encoding="utf-8")


def write(app: Sphinx) -> None:
    """Write the pages into generated/; findings only if their sources have changed."""
    folder = Path(app.srcdir) / "generated"
    (folder / "api").mkdir(parents=True, exist_ok=True)
    _write(folder / "contents.md", contents())
    current: set[Path] = set().union(*(api(folder / "api", f"squeal.{name}") for name in PACKAGES))
    for page in {*(folder / "api").glob("*.rst")} - current:  # of a module that is gone
        page.unlink()
    _write(folder / "public.md", public())
    pages = "\n".join(f"/generated/api/squeal.{name}" for name in PACKAGES)
    _write(folder / "modules.md", f"```{{toctree}}\n:maxdepth: 1\n\n{pages}\n```\n")
    measured, stamp = folder / "findings.md", f"% made from the sources {digest(FINDINGS)}\n"
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
