"""`python -m workflow.release.verify`: is a build the one that `manifest.json` describes?

The manifest, beside this file, holds the digest of what each result, figure, table and PDF says,
and a summary of the numbers under each key of a result. What says where a file comes from
(versions, digests of sources) takes no part. With the same processor and programs bytes must be the
same, elsewhere numbers must agree. `--write` describes the build that is there.
"""

from __future__ import annotations

import csv
import hashlib
import json
import math
import platform
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.contents import FIGURES, RESULTS, TABLES

ROOT = Path(__file__).resolve().parents[2]
MANIFEST = Path(__file__).with_name("manifest.json")
LOCK = ROOT / "requirements" / "environment.txt"


PDFS = ("paper/report.pdf", "paper/supplement.pdf")  # left out where TeX is missing
RELATIVE = 1e-6  # of the mean magnitude under a key: how far the mean may lie off
ROUNDING = 1e-9  # magnitudes below are errors and residuals, which each machine has its own


def built() -> list[str]:
    """The files that a whole build leaves."""
    return [
        *RESULTS,
        *(f"results/{scene}.csv" for scene in HISTORY_FIGURES),
        *(f"figures/{name}.{kind}" for name in FIGURES for kind in ("pdf", "txt")),
        *(f"paper/generated/{name}.tex" for name in ("values", "captions", *TABLES)),
        *PDFS,
    ]


def told(path: Path) -> bytes:
    """A file without what says where it comes from."""
    if path.suffix == ".json":
        value = json.loads(path.read_text(encoding="utf-8"))
        value["provenance"] = [value["provenance"][key] for key in ("inputs", "module")]
        return json.dumps(value).encode()
    if path.suffix == ".pdf" and path.parent.name == "figures":  # the line, and places in the file
        body = path.read_bytes().rpartition(b"\nxref")[0]
        return re.sub(rb"\n/Keywords \(.*?\)\n", b"\n", body)
    return path.read_bytes()


def _numbers(value: Any, keys: tuple[str, ...] = ()) -> Iterator[tuple[str, float]]:
    """The numbers of a JSON value, each under the first and the last of its keys."""
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from _numbers(entry, (*keys[:1], key))
    elif isinstance(value, list):
        for entry in value:
            yield from _numbers(entry, keys)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield " ".join(keys), float(value)


def summary(path: Path) -> dict[str, list[float]]:
    """Number, mean and mean magnitude of the numbers under each key of a result."""
    if path.suffix == ".csv":
        with path.open(encoding="utf-8", newline="") as stream:
            rows = csv.DictReader(stream)
            pairs = [(k, float(v)) for row in rows for k, v in row.items() if _is_number(v)]
    else:
        value = json.loads(path.read_text(encoding="utf-8"))
        pairs = [*_numbers({k: v for k, v in value.items() if k != "provenance"})]
    groups = defaultdict(list)
    for key, number in pairs:
        groups[key].append(number)
    return {key: _summed(some) for key, some in groups.items()}


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _summed(some: list[float]) -> list[float]:
    mean, magnitude = math.fsum(some) / len(some), math.fsum(map(abs, some)) / len(some)
    return [len(some), float(f"{mean:.9g}"), float(f"{magnitude:.9g}")]


def agree(one: list[float], other: list[float]) -> bool:
    """Whether two summaries of a group of numbers agree."""
    magnitude = max(one[2], other[2])
    near = all(abs(a - b) <= RELATIVE * magnitude for a, b in zip(one[1:], other[1:], strict=True))
    return one[0] == other[0] and (near or magnitude <= ROUNDING)


def manifest(folder: Path) -> dict[str, Any]:
    """What the manifest says of a build. Raises OSError or ValueError where a file is damaged."""
    files = {name: hashlib.sha256(told(folder / name)).hexdigest() for name in built()}
    results = [name for name in files if name.startswith("results/")]
    return {"files": files, "numbers": {name: summary(folder / name) for name in results}}


def here() -> dict[str, str]:
    """What bytes depend on beside the sources."""
    model = re.search(r"^model name.*: (.*)$", _read("/proc/cpuinfo"), re.M)
    try:
        tex = subprocess.run(["pdflatex", "--version"], capture_output=True, text=True).stdout
    except OSError:
        tex = "none\n"
    return {
        "machine": f"{platform.system()} {platform.machine()} {' '.join(platform.libc_ver())}",
        "processor": model[1] if model else platform.processor(),
        "Python": platform.python_version(),
        "packages": hashlib.sha256(_read(LOCK).encode()).hexdigest()[:16],
        "TeX": tex.partition("\n")[0],
    }


def _read(path: str | Path) -> str:
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError:
        return ""


def _wrong(path: Path, numbers: dict[str, list[float]] | None) -> str:
    """What is wrong in a file whose bytes may differ."""
    if numbers is None:
        end = b"%%EOF\n" if path.suffix == ".pdf" else b"\n"
        return "" if path.read_bytes().endswith(end) else "is cut off"
    found, nothing = summary(path), [0.0, 0.0, 0.0]
    keys = sorted(found.keys() | numbers.keys())
    off = [k for k in keys if not agree(found.get(k, nothing), numbers.get(k, nothing))]
    return f"other numbers under {', '.join(off)}" if off else ""


def compared(known: dict[str, Any], folder: Path, alike: bool) -> tuple[list[str], list[str]]:
    """Names of files whose bytes differ, and what is wrong; where all is alike, any difference."""
    other, wrong = [], []
    for name, digest in known["files"].items():
        path = folder / name
        try:
            if hashlib.sha256(told(path)).hexdigest() == digest:
                continue
            other.append(name)
            reason = _wrong(path, known["numbers"].get(name))
            if reason or alike:
                wrong.append(f"{name}: {reason or 'other bytes'}")
        except OSError as error:
            wrong.append(f"{name}: {error.strerror}")
        except (ValueError, KeyError, TypeError):
            wrong.append(f"{name}: is damaged")
    return other, wrong


def main() -> int:
    """Print one line on what was found, and a line for each file that is wrong; 1 for any."""
    if sys.argv[1:] == ["--write"]:
        text = json.dumps({"made_with": here(), **manifest(ROOT)}, indent=1)
        rows = re.sub(r"\[[^\[\]]*\]", lambda m: " ".join(m[0].split()), text)
        MANIFEST.write_text(f"{rows}\n", encoding="utf-8")
        return 0
    known = json.loads(MANIFEST.read_text(encoding="utf-8"))
    if here()["TeX"] == "none":
        known["files"] = {n: d for n, d in known["files"].items() if n not in PDFS}
    unlike = [name for name, value in here().items() if value != known["made_with"][name]]
    other, wrong = compared(known, ROOT, not unlike)
    count, results = len(known["files"]), len(known["numbers"])
    if wrong:
        print(f"verify: not the same: {len(wrong)} of {count} files", *wrong, sep="\n  ")
        print("  make report builds anew what is removed")
    elif other:
        print(
            f"verify: the same numbers: {results} results agree to {RELATIVE:g}; {len(other)} of "
            f"{count} files have other bytes, made with other {', '.join(unlike)}"
        )
    else:
        print(f"verify: the same: {count} files say byte for byte what the manifest says")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
