"""`make page`: the live page as one HTML file."""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

from page.wasm import compile_modules
from squeal.errors import ComputationError

HERE = Path(__file__).parent
SCENES = HERE.parent / "workflow" / "scenes"


def build(folder: Path) -> None:
    """Write model.wasm and model.json to a folder. Raises ComputationError without compilers."""
    from page import export  # heyoka is not everywhere

    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        code = compile_modules(export.modules(), Path(scratch))
    (folder / "model.wasm").write_bytes(code)
    (folder / "model.json").write_text(json.dumps(export.tables(SCENES)), encoding="utf-8")


def main() -> int:
    """Build the page, or say in one sentence what is missing."""
    try:
        build(HERE / "built")
    except (ComputationError, ImportError) as missing:
        print(f"make page: {missing}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
