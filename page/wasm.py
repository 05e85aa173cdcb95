"""From LLVM text for this machine to one WebAssembly module, by clang and lld."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

from page.export import Module
from squeal.errors import ComputationError

# clang before 19 does not read heyoka's LLVM text
OLDEST = 19
NEWEST = 30
ADVICE = (
    "the page needs clang and wasm-ld of LLVM 19 or newer; on Debian: apt install clang-19 lld-19"
)
LINK = ("--no-entry", "--allow-undefined", "--gc-sections", "--strip-all")

# What is of this machine, or newer than LLVM 19 reads: all of it hints without which the code
# means the same.
_DROPPED = [
    re.compile(r"^(?:target|source_filename|attributes) .*\n", re.M),
    re.compile(r"^;.*\n", re.M),
    re.compile(r"^@llvm\.used = .*\n", re.M),
    re.compile(r"^declare [^\n]*(?:Sleef|obj_trigger|driver_)[^\n]*\n", re.M),
    re.compile(r"^define [^\n]*(?:[sS]leef|obj_trigger)[^\n]*\{\n.*?^\}\n", re.M | re.S),
    re.compile(r"^define [^\n]*@d_out_f\([^\n]*\{\n.*?^\}\n", re.M | re.S),
    re.compile(r"(?<= )initializes\(\([^\n]*?\)\) "),
]
# a text constant, which stays as it is; a name; a reference to attributes
_WORD = re.compile(r'c"[^"]*"|@([\w.]+)| #\d+\b')
_DECLARED = re.compile(r"^declare .*\n", re.M)


def compilers() -> tuple[str, str] | None:
    """clang and wasm-ld of one version that reads the code, or None."""
    for version in range(OLDEST, NEWEST):
        pair = shutil.which(f"clang-{version}"), shutil.which(f"wasm-ld-{version}")
        if pair[0] and pair[1]:
            return pair[0], pair[1]
    clang = shutil.which("clang")
    linker = shutil.which("wasm-ld")
    if clang is None or linker is None:
        return None
    said = subprocess.run([clang, "--version"], capture_output=True, text=True, check=False).stdout
    found = re.search(r"version (\d+)", said)
    return (clang, linker) if found and int(found[1]) >= OLDEST else None


def retargeted(module: Module) -> str:
    """LLVM text of a module without what ties it to this machine, every name in it its own."""
    texts = []
    for i, text in enumerate(module.texts):
        for pattern in _DROPPED:
            text = pattern.sub("", text)

        def own(match: re.Match[str], i: int = i) -> str:
            name = match[1]
            if name is None:
                return match[0] if match[0].startswith("c") else ""
            if name.startswith("llvm."):
                return match[0]
            if name == module.entry:
                return f'@"{module.name}"'
            part = "" if ".driver_" in name else f"{i}."  # drivers are called from other texts
            return f'@"{module.name}.{part}{name}"'

        texts.append(_WORD.sub(own, text.replace("captures(none)", "nocapture")))
    return "".join(texts)


def merged(modules: list[Module]) -> str:
    """One LLVM text of many modules."""
    whole = "".join(retargeted(module) for module in modules)
    declared = sorted(set(_DECLARED.findall(whole)))
    return "".join(declared) + _DECLARED.sub("", whole)


def compile_modules(modules: list[Module], folder: Path) -> bytes:
    """The WebAssembly of all modules; intermediate files go to an empty `folder`.

    Raises ComputationError without the compilers, or with the first line of what they refuse.
    """
    pair = compilers()
    if pair is None:
        raise ComputationError(ADVICE)
    clang, linker = pair
    (folder / "model.ll").write_text(merged(modules), encoding="utf-8")
    flags = ["--target=wasm32", "-O2", "-mbulk-memory", "-Wno-override-module", "-c"]
    _run([clang, *flags, "model.ll"], folder)
    exports = [f"--export={name}" for name in ("__heap_base", *(m.name for m in modules))]
    _run([linker, *LINK, *exports, "model.o", "-o", "model.wasm"], folder)
    return (folder / "model.wasm").read_bytes()


def _run(command: list[str], folder: Path) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        line = next((s for s in done.stderr.splitlines() if "error" in s), done.stderr.strip())
        raise ComputationError(f"{Path(command[0]).name} refuses the page's code: {line}")
