"""`python -m workflow.release.verify`: is a build the one that `manifest.json` describes?

The manifest, beside this file, holds the digest of what each result, figure, table and PDF says,
a summary of the numbers under each key of a result, and the numbers that each text prints. What
says where a file comes from (versions, commit, digests of sources) takes no part. With the same
programs and instructions bytes must be the same. Elsewhere numbers must agree, those of sensitive
motions within the spread that results and texts state. `--write` describes the build that is there.
"""

from __future__ import annotations

import csv
import hashlib
import json
import math
import os
import platform
import re
import subprocess
import sys
import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.contents import REPRODUCIBLE, RESULTS, TABLES, figure_files
from squeal.article.report import printed

ROOT = Path(__file__).resolve().parents[2]
MANIFEST = Path(__file__).with_name("manifest.json")
LOCK = ROOT / "requirements" / "environment.txt"


# left out where TeX is missing; the supplement shows the run times of its own build, and all else
# that it shows is compared by itself
PDFS = ("paper/report.pdf",)
RELATIVE = 1e-6  # of the mean magnitude under a key: how far the mean may lie off
ROUNDING = 1e-9  # magnitudes below are errors and residuals, which each machine has its own


def built() -> list[str]:
    """The files of a whole build that each build makes alike."""
    return [
        *RESULTS,
        *(f"results/{scene}.csv" for scene in HISTORY_FIGURES),
        *(file for name in REPRODUCIBLE for file in figure_files(name)),
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
    if path.suffix == ".pdf":
        return _paper(path.read_bytes())
    if path.name == "values.tex":
        return re.sub(rb"^\\setval\{where\..*\n", b"", path.read_bytes(), flags=re.M)
    return path.read_bytes()


def _paper(data: bytes) -> bytes:
    """A PDF of TeX without the line that names its commit, and without lengths and places in the
    file, which change with that line. Raises zlib.error where a stream is damaged."""
    outside = re.split(rb"stream\n.*?\nendstream", data, flags=re.S)
    parts = [re.sub(rb"/Length \d+|startxref\n\d+", b"", part) for part in outside]
    streams = re.findall(rb"stream\n(.*?)\nendstream", data, re.S)
    for head, stream in zip(outside, streams, strict=False):  # the last part ends without one
        _, _, dictionary = head.rpartition(b" obj")
        if b"/Type /XRef" in dictionary:
            continue
        if b"/FlateDecode" in dictionary:
            stream = zlib.decompress(stream)
        parts.append(re.sub(rb"/Source BMC.*?EMC", b"", stream, flags=re.S))
    return b"".join(parts)


Number = tuple[str, float, float]
"""The group of a number, the number, and how far its spread reaches."""


def _numbers(value: Any, widths: dict[str, float], keys: tuple[str, ...] = ()) -> Iterator[Number]:
    """The numbers of a JSON value, each under the first and the last of its keys that are words."""
    entries: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, dict):
        entries = value.items()
    elif isinstance(value, list):
        entries = enumerate(value)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        words = [key for key in keys if not key.isdigit()]
        group = f"{words[0]} {words[-1]}" if len(words) > 1 else "".join(words)
        yield group, float(value), widths.get(".".join(keys), 0.0)
    for key, entry in entries:
        yield from _numbers(entry, widths, (*keys, str(key)))


class Summary(NamedTuple):
    """How many numbers a group has, their mean, mean magnitude and mean spread.

    The manifest holds it as a list.
    """

    numbers: int
    mean: float
    magnitude: float
    spread: float


def summary(path: Path) -> dict[str, Summary]:
    """The numbers under each key of a result, summarised."""
    if path.suffix == ".csv":
        with path.open(encoding="utf-8", newline="") as stream:
            found = []
            for row in csv.DictReader(stream):
                found += [(key, float(text), 0.0) for key, text in row.items() if _is_number(text)]
    else:
        value = json.loads(path.read_text(encoding="utf-8"))
        del value["provenance"]
        widths = {one["key"]: one["high"] - one["low"] for one in value.pop("spread", ())}
        found = list(_numbers(value, widths))
    groups = defaultdict(list)
    for group, number, width in found:
        groups[group].append((number, width))
    return {group: _summary_of(members) for group, members in groups.items()}


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _summary_of(members: list[tuple[float, float]]) -> Summary:
    """The summary of numbers, each with its spread."""

    def mean(values: Iterable[float]) -> float:
        return float(f"{math.fsum(values) / len(members):.9g}")

    return Summary(
        numbers=len(members),
        mean=mean(number for number, _ in members),
        magnitude=mean(abs(number) for number, _ in members),
        spread=mean(width for _, width in members),
    )


def agree(one: Summary, other: Summary) -> bool:
    """Whether two summaries of a group of numbers agree, within both spreads."""
    if one.numbers != other.numbers:
        return False
    magnitude = max(one.magnitude, other.magnitude)
    if magnitude <= ROUNDING:
        return True
    reach = RELATIVE * magnitude + one.spread + other.spread
    return abs(one.mean - other.mean) <= reach and abs(one.magnitude - other.magnitude) <= reach


def prints(path: Path) -> list[str]:
    """The digest of what stands between the numbers of a text, and the numbers as printed."""
    between, numbers = printed.split(path.read_text(encoding="utf-8"))
    return [hashlib.sha256("\0".join(between).encode()).hexdigest()[:16], *numbers]


def manifest(folder: Path) -> dict[str, Any]:
    """What the manifest says of a build. Raises OSError or ValueError where a file is damaged."""
    files = {name: hashlib.sha256(told(folder / name)).hexdigest() for name in built()}
    results = [name for name in files if name.startswith("results/")]
    texts = [name for name in files if name.endswith((".tex", ".txt"))]
    return {
        "files": files,
        "numbers": {name: summary(folder / name) for name in results},
        "printed": {name: prints(folder / name) for name in texts},
    }


def here() -> dict[str, str]:
    """What bytes depend on beside the sources: programs, and which instructions they take."""
    model = re.search(r"^model name.*: (.*)$", _read("/proc/cpuinfo"), re.M)
    try:
        tex = subprocess.run(["pdflatex", "--version"], capture_output=True, text=True).stdout
    except OSError:
        tex = "none\n"
    return {
        "machine": f"{platform.system()} {platform.machine()} {' '.join(platform.libc_ver())}",
        "processor": model[1] if model else platform.processor(),
        "NumPy's instructions": _numpy_instructions(),
        "OpenBLAS's kernels": _blas_kernels(),
        "instructions of the C library": _library_instructions(),
        "heyoka's target": _compiler_target(),
        "Python": platform.python_version(),
        "packages": hashlib.sha256(_read(LOCK).encode()).hexdigest()[:16],
        "TeX": tex.partition("\n")[0],
    }


def _numpy_instructions() -> str:
    """The groups of instructions that NumPy's loops are compiled for and that it uses here."""
    core: Any = import_module("numpy._core._multiarray_umath")  # as numpy.show_runtime reads it
    groups = [*core.__cpu_baseline__, *core.__cpu_dispatch__]
    return " ".join(group for group in groups if core.__cpu_features__[group])


def _blas_kernels() -> str:
    """The kernels that the OpenBLAS of NumPy and of SciPy chose."""
    import scipy.linalg  # noqa: F401  it loads its own
    from threadpoolctl import threadpool_info

    pools = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
    kernels = sorted({pool.get("architecture", "unknown") for pool in pools})
    return ", ".join(kernels) or "none"


def _library_instructions() -> str:
    """Those for which the C library has functions of its own, as far as no tunable hides them."""
    flags = re.search(r"^flags.*: (.*)$", _read("/proc/cpuinfo"), re.M)
    available = set(flags[1].split()) if flags else set()
    hidden = re.findall(r"-(\w+)", os.environ.get("GLIBC_TUNABLES", ""))
    names = ("sse4_1", "avx", "fma", "avx2", "fma4", "avx512f")
    used = [n for n in names if n in available and n.upper() not in hidden]
    return " ".join(used) or "unknown"


def _compiler_target() -> str:
    """The processor for which heyoka compiles, "none" without heyoka."""
    try:
        import heyoka as hy
    except ImportError:
        return "none"
    x = hy.make_vars("x")
    state = repr(hy.taylor_adaptive([(x, -x)], [1.0]).llvm_state)
    target = re.search(r"^Target CPU\s*: (.*)$", state, re.M)
    return target[1] if target else "unknown"


def _read(path: str | Path) -> str:
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError:
        return ""


def _wrong(path: Path, name: str, known: dict[str, Any]) -> str:
    """What is wrong in a file whose bytes may differ."""
    if name in known["numbers"]:
        return _wrong_numbers(summary(path), known["numbers"][name])
    if name in known["printed"]:
        return _wrong_text(prints(path), known["printed"][name])
    return "" if path.read_bytes().endswith(b"%%EOF\n") else "is cut off"


def _wrong_numbers(found: dict[str, Summary], known: dict[str, list[float]]) -> str:
    nothing = Summary(0, 0.0, 0.0, 0.0)
    off = []
    for key in sorted(found.keys() | known.keys()):
        listed = Summary(*known[key]) if key in known else nothing  # type: ignore[arg-type]
        if not agree(found.get(key, nothing), listed):
            off.append(key)
    return f"other numbers under {', '.join(off)}" if off else ""


def _wrong_text(found: list[str], known: list[str]) -> str:
    if found[0] != known[0] or len(found) != len(known):
        return "other words"
    pairs = zip(known[1:], found[1:], strict=True)
    off = [f"{one} there, {other} here" for one, other in pairs if not printed.same(one, other)]
    return f"prints {'; '.join(off)}" if off else ""


def compared(known: dict[str, Any], folder: Path, same_tools: bool) -> tuple[list[str], list[str]]:
    """Names of the files whose bytes differ from those of the manifest `known`, and what is wrong.

    same_tools: the manifest's build had the same programs and instructions, so that other bytes are
    wrong as such; else a file is wrong where its numbers or words do not agree.
    """
    other = []
    wrong = []
    for name, digest in known["files"].items():
        path = folder / name
        try:
            if hashlib.sha256(told(path)).hexdigest() == digest:
                continue
            other.append(name)
            reason = _wrong(path, name, known)
            if reason or same_tools:
                wrong.append(f"{name}: {reason or 'other bytes'}")
        except OSError as error:
            wrong.append(f"{name}: {error.strerror}")
        except (ValueError, KeyError, TypeError, zlib.error):
            wrong.append(f"{name}: is damaged")
    return other, wrong


def unlike(known: dict[str, str], now: dict[str, str]) -> list[str]:
    """What this build was made with otherwise than the manifest's, by name."""
    lines = []
    for name, value in now.items():
        if value != known.get(name):
            lines.append(f"{name}: {known.get(name, 'unknown')} there, {value} here")
    return lines


def main() -> int:
    """Print one line on what was found, and a line for each file that is wrong; 1 for any."""
    if sys.argv[1:] == ["--write"]:
        text = json.dumps({"made_with": here(), **manifest(ROOT)}, indent=1)
        rows = re.sub(r"\[[^\[\]]*\]", lambda m: " ".join(m[0].split()), text)
        MANIFEST.write_text(f"{rows}\n", encoding="utf-8")
        return 0
    known = json.loads(MANIFEST.read_text(encoding="utf-8"))
    now = here()
    if now["TeX"] == "none":
        known["files"] = {n: d for n, d in known["files"].items() if n not in PDFS}
    reasons = unlike(known["made_with"], now)
    other, wrong = compared(known, ROOT, same_tools=not reasons)
    count = len(known["files"])
    results = len(known["numbers"])
    if wrong:
        print(f"verify: not the same: {len(wrong)} of {count} files", *wrong, sep="\n  ")
        print("  make report builds anew what is removed")
    elif other:
        print(
            f"verify: the same numbers: {results} results agree to {RELATIVE:g} or within their "
            f"spread, as texts do; {len(other)} of {count} files have other bytes"
        )
        print("  " + ", ".join(other))
    else:
        print(f"verify: the same: {count} files say byte for byte what the manifest says")
    if reasons and (wrong or other):
        print("made with another", *reasons, sep="\n  ")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
