"""`python -m workflow.trials.dispatches [STUDY ...]`: does the report say the same elsewhere?

Other processors round otherwise: their libraries take other instructions, and sums come in another
order. Each study of the build in this folder is computed again under every entry of
`SURROUNDINGS`, and the texts of the paper are written from its result. One line per study says
whether they are the same, where a printed number with its spread agrees if the two ranges meet, and
what is not. `make report` comes first. 1 if anything printed differs.
"""

from __future__ import annotations

import hashlib
import os
import re
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from squeal.article.contents import RESULTS, STUDIES
from squeal.article.report.printed import differences

ROOT = Path(__file__).resolve().parents[2]
SCENES = Path("workflow/scenes")
RELATIVE = 1e-12  # change of the scenes' numbers
TIMES = ("accuracy",)
"""Studies left out unless they are named: they take minutes and integrate short motions."""


@dataclass(frozen=True)
class Surroundings:
    """Where a study runs: environment variables, whether heyoka's code is compiled otherwise, and
    whether the scenes' numbers are changed."""

    variables: dict[str, str] = field(default_factory=dict)
    compiled: bool = False
    changed: bool = False


SURROUNDINGS = {
    "AVX2": Surroundings(
        {
            "OPENBLAS_CORETYPE": "Haswell",
            "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
            "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX512VL",
        }
    ),
    "SSE": Surroundings(
        {
            "OPENBLAS_CORETYPE": "Prescott",
            "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
            "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX,-AVX512F",
        }
    ),
    "compiled otherwise": Surroundings(compiled=True),
    f"parameters changed by {RELATIVE:g}": Surroundings(changed=True),
}
_NUMBER = re.compile(r"(?<![\w.])\d+\.\d*(?:e[-+]?\d+)?|(?<![\w.])\d+e[-+]?\d+")


def otherwise() -> None:
    """Let heyoka compile without optimisation, and with it without fused multiplications and
    additions, for half as many motions side by side."""
    import heyoka as hy

    from squeal.article.identify import batch
    from squeal.simulation.taylor import Machine

    def plain(*arguments: Any, make: Callable[..., Any], **settings: Any) -> Any:
        return make(*arguments, **settings | {"opt_level": 0})

    Machine.adaptive = staticmethod(partial(plain, make=hy.taylor_adaptive))
    batch.BatchMachine.adaptive = staticmethod(partial(plain, make=hy.taylor_adaptive_batch))
    batch.LANES //= 2
    batch.BatchMachine.motions = (batch.LANES,)


def changed(text: str) -> str:
    """The text of a scene file with its numbers changed relatively by `RELATIVE`, up or down by
    chance; numbers that are equal stay equal."""

    def other(match: re.Match[str]) -> str:
        up = hashlib.sha256(match[0].encode()).digest()[0] % 2
        return repr(float(match[0]) * (1.0 + (RELATIVE if up else -RELATIVE)))

    return _NUMBER.sub(other, text)


def changed_scenes(folder: Path) -> Path:
    """All scene files with changed numbers in a folder."""
    for file in (ROOT / SCENES).rglob("*.yaml"):
        place = folder / SCENES / file.relative_to(ROOT / SCENES)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(changed(file.read_text(encoding="utf-8")), encoding="utf-8")
    return folder


def computed(study: str, there: Surroundings, folder: Path) -> Path:
    """The result of a study in other surroundings. Raises CalledProcessError where it fails."""
    program = ["-m", "squeal.article.studies"]
    if there.compiled:
        program = ["-m", __spec__.name, "--compiled-otherwise"]
    base = changed_scenes(folder) if there.changed else ROOT
    files = []
    for name in STUDIES[study]:
        of_scene = SCENES in Path(name).parents  # stored computations are read as they are
        files.append(str((base if of_scene else ROOT) / name))
    result = folder / f"{study}.json"
    with result.open("w", encoding="utf-8") as stream:
        subprocess.run(
            [sys.executable, *program, study, *files],
            cwd=ROOT,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"} | there.variables,
            stdout=stream,
            stderr=subprocess.PIPE,
            text=True,
            check=True,
        )
    return result


def printed(folder: Path, **other: Path) -> dict[str, str]:
    """What the texts of the paper read, by name, from the build and other results of some studies.

    Raises CalledProcessError where a sentence does not hold.
    """
    results = {Path(file).stem: ROOT / file for file in RESULTS} | other
    subprocess.run(
        [sys.executable, "-m", "squeal.article.report", *map(str, results.values())]
        + ["--out", str(folder)],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
        check=True,
    )
    return {file.stem: file.read_text(encoding="utf-8") for file in folder.glob("*.tex")}


def compared(study: str, known: dict[str, str]) -> list[str]:
    """What a study says otherwise, a line each."""
    found = []
    for name, there in SURROUNDINGS.items():
        with tempfile.TemporaryDirectory() as folder:
            try:
                result = computed(study, there, Path(folder))
                texts = printed(Path(folder) / "generated", **{study: result})
            except subprocess.CalledProcessError as error:
                found.append(f"{name}: {error.stderr.strip()}")
                continue
            for text, before in known.items():
                found += [f"{name}: {text}: {one}" for one in differences(before, texts[text])]
    return found


def main() -> int:
    """Print a line for each study, and one for each thing that it says otherwise."""
    if sys.argv[1:2] == ["--compiled-otherwise"]:
        otherwise()
        sys.argv = ["squeal.article.studies", *sys.argv[2:]]
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
    chosen = sys.argv[1:] or [name for name in STUDIES if name not in TIMES]
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        known = printed(Path(folder))
    for study in chosen:
        found = compared(study, known)
        wrong += bool(found)
        says = "says otherwise" if found else "prints the same"
        print(
            f"{study}: {says} in {len(SURROUNDINGS)} surroundings", *found, sep="\n  ", flush=True
        )
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
