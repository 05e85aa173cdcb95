"""`python workflow/release/licences.py SBOM`: the licences that a CycloneDX file states."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any


def stated(component: dict[str, Any]) -> str:
    """The licences of a component."""
    found = []
    for entry in component.get("licenses", ()):
        own = entry.get("license", {})
        words = entry.get("expression") or own.get("id") or own.get("name", "")
        found.append(words.rpartition(":: ")[2].removesuffix(" License").partition("\n")[0])
    return ", ".join(dict.fromkeys(found)) or "none stated"


def main() -> None:
    """Print a line for each component."""
    components = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["components"]
    for one in sorted(components, key=lambda one: one["name"].lower()):
        print(f"{one['name']:32} {one.get('version', ''):14} {stated(one)}")


if __name__ == "__main__":
    main()
