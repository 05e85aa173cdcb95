"""How the report was made: versions and digests behind the results, and the list of chapters."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from squeal.article.report.chapters import CHAPTERS
from squeal.article.report.latex import Generated, escape, tabular
from squeal.io.provenance import Provenance


def versions(made: Iterable[Provenance]) -> dict[str, str]:
    """Versions of the packages that computed the results: several where results differ."""
    found: dict[str, dict[str, None]] = {}
    for one in made:
        for package, version in one.versions.items():
            found.setdefault(f"version.{package}", {})[version] = None
    return {key: ", ".join(several) for key, several in found.items()}


def origin_table(results: Mapping[str, Provenance]) -> str:
    """Which files and which sources made each result, after the digests of the files."""
    files = dict.fromkeys(file for made in results.values() for file in made.inputs)
    digests = [[rf"\texttt{{{escape(f.name)}}}", rf"\texttt{{{f.sha256[:16]}}}", ""] for f in files]
    rows = []
    for key, made in results.items():
        names = ", ".join(file.name.removesuffix(".yaml") for file in made.inputs)
        rows.append(
            [rf"\texttt{{{escape(key)}}}", rf"\texttt{{{made.source_sha256}}}", names or "--"]
        )
    head = ["file or result", "of its bytes or sources", "computed from"]
    return tabular("lll", head, [digests, rows])


def chapter_list() -> str:
    r"""The values of all chapters, and \\chapters, which reads them in their order."""
    values = "".join(rf"\input{{generated/{one.name}-values}}" + "\n" for one in CHAPTERS)
    texts = "".join(rf"\input{{{one.name}}}" + "\n" for one in CHAPTERS)
    return f"{values}\\newcommand{{\\chapters}}{{%\n{texts}}}\n"


def generated(*results: Path) -> Generated:
    """Values and tables, from all result files."""
    made = {}
    for file in results:
        found = json.loads(file.read_text(encoding="utf-8"))
        made[file.stem] = Provenance.from_dict(found["provenance"])
    return versions(made.values()), {"origin": origin_table(made), "chapters": chapter_list()}
