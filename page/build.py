"""`make page`: the live page as one HTML file."""

from __future__ import annotations

import base64
import gzip
import json
import re
import sys
import tempfile
from pathlib import Path

from page import PAGE, SITE
from page.wasm import compile_modules
from squeal.errors import ComputationError

HERE = Path(__file__).parent
SCENES = HERE.parent / "workflow" / "scenes"

_IMPORT = re.compile(r"^import (?:\* as )?(\w+|\{[^}]*\}) from \"\./(\w+)\.js\";$", re.M)
_EXPORTED = re.compile(r"^export (?:async )?(?:function|const) (\w+)", re.M)


def bundle(entry: str) -> str:
    """The modules that `entry` needs as one script, each a scope of its own."""
    done: dict[str, str] = {}

    def add(name: str) -> None:
        text = (HERE / "js" / f"{name}.js").read_text(encoding="utf-8")
        for _, other in _IMPORT.findall(text):
            if other not in done:
                add(other)
        names = ", ".join(_EXPORTED.findall(text))
        text = _IMPORT.sub(r"const \1 = in_\2;", re.sub(r"^export ", "", text, flags=re.M))
        done[name] = f"const in_{name} = (() => {{\n{text}return {{ {names} }};\n}})();\n"

    add(entry)
    return "".join(done.values())


def build(folder: Path) -> Path:
    """Write the page, and the module and the tables that it carries, to a folder.

    Returns the page's path. Raises ComputationError without compilers.
    """
    from page import export, tables  # heyoka is not everywhere

    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        code = compile_modules(export.modules(), Path(scratch))
    described = json.dumps(tables.tables(SCENES), ensure_ascii=False, separators=(",", ":"))
    (folder / "model.wasm").write_bytes(code)
    (folder / "model.json").write_text(described, encoding="utf-8")
    parts = {
        "style": (HERE / "style.css").read_text(encoding="utf-8"),
        "site": SITE,
        "tables": described.replace("<", "\\u003c"),
        "module": base64.b64encode(gzip.compress(code, mtime=0)).decode(),
        "script": bundle("main"),
    }
    template = (HERE / "template.html").read_text(encoding="utf-8")
    page = re.sub(r"\{\{(\w+)\}\}", lambda m: parts[m[1]], template)
    (folder / PAGE).write_text(page, encoding="utf-8")
    return folder / PAGE


def main() -> int:
    """Build the page, or say in one sentence what is missing."""
    try:
        page = build(HERE / "built")
    except (ComputationError, ImportError) as missing:
        print(f"make page: {missing}", file=sys.stderr)
        return 1
    print(f"{page.relative_to(HERE.parent)}: {page.stat().st_size / 1000:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
