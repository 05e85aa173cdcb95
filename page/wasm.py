"""From LLVM text for this machine to one WebAssembly module, by clang and lld."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from page.export import Module
from squeal.errors import ComputationError

OLDEST, NEWEST = 19, 30  # clang before 19 does not read heyoka's LLVM text
ADVICE = (
    "the page needs clang and wasm-ld of LLVM 19 or newer; on Debian: apt install clang-19 lld-19"
)
LINK = ("--no-entry", "--allow-undefined", "--gc-sections", "--strip-all")

# What is of this machine, or newer than LLVM 19 reads: all of it hints without which the code
# means the same.
_DROPPED = [
    re.compile(r"^target (?:datalayout|triple) = .*\n", re.M),
    re.compile(r"^@llvm\.used = .*\n", re.M),
    re.compile(r"^declare [^\n]*(?:Sleef|obj_trigger)[^\n]*\n", re.M),
    re.compile(r"^define [^\n]*(?:[sS]leef|obj_trigger)[^\n]*\{\n.*?^\}\n", re.M | re.S),
    re.compile(r"^define [^\n]*@d_out_f\([^\n]*\{\n.*?^\}\n", re.M | re.S),
    re.compile(r"(?<= )initializes\(\([^\n]*?\)\) "),
]
_ATTRIBUTES = re.compile(r"^attributes (#\d+) = .*$", re.M)
_OWN_NAME = re.compile(r"@(heyoka\.cm_jet\.driver_\d+)")


def compilers() -> tuple[str, str] | None:
    """clang and wasm-ld of one version that reads the code, or None."""
    for version in range(OLDEST, NEWEST):
        pair = shutil.which(f"clang-{version}"), shutil.which(f"wasm-ld-{version}")
        if pair[0] and pair[1]:
            return pair[0], pair[1]
    clang, linker = shutil.which("clang"), shutil.which("wasm-ld")
    if clang is None or linker is None:
        return None
    said = subprocess.run([clang, "--version"], capture_output=True, text=True, check=False).stdout
    found = re.search(r"version (\d+)", said)
    return (clang, linker) if found and int(found[1]) >= OLDEST else None


def retargeted(text: str, module: Module) -> str:
    """LLVM text of heyoka without what ties it to this machine, its function renamed."""
    for pattern in _DROPPED:
        text = pattern.sub("", text)
    text = text.replace("captures(none)", "nocapture")
    text = _ATTRIBUTES.sub(r"attributes \1 = { nounwind }", text)
    text = _OWN_NAME.sub(rf'@"{module.name}.\1"', text)
    return text.replace(f"@{module.entry}(", f'@"{module.name}"(')


def compile_modules(modules: list[Module], folder: Path) -> bytes:
    """The WebAssembly of all modules; intermediate files go to an empty `folder`.

    Raises ComputationError without the compilers, or with the first line of what they refuse.
    """
    pair = compilers()
    if pair is None:
        raise ComputationError(ADVICE)
    clang, linker = pair
    sources = []
    for module in modules:
        for i, text in enumerate(module.texts):
            file = folder / f"{module.name}.{i}.ll"
            file.write_text(retargeted(text, module), encoding="utf-8")
            sources.append(file.name)

    def objects(part: list[str]) -> None:
        flags = ["--target=wasm32", "-O2", "-mbulk-memory", "-Wno-override-module", "-c"]
        _run([clang, *flags, *part], folder)

    workers = os.cpu_count() or 1
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(objects, [p for p in (sources[i::workers] for i in range(workers)) if p]))
    exports = [f"--export={name}" for name in ("__heap_base", *(m.name for m in modules))]
    files = [Path(name).with_suffix(".o").name for name in sources]
    _run([linker, *LINK, *exports, *files, "-o", "model.wasm"], folder)
    return (folder / "model.wasm").read_bytes()


def _run(command: list[str], folder: Path) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        line = next((s for s in done.stderr.splitlines() if "error" in s), done.stderr.strip())
        raise ComputationError(f"{Path(command[0]).name} refuses the page's code: {line}")
