"""`python -m workflow.trials.pages [PAGE ...]`: does what README and documentation say run?

The shell commands and the Python snippets of each page run literally, one after the other, in a
folder that is empty when the page begins. The environment holds the wheel and what the wheel
requires with its extras `EXTRAS`, linked from the locked environment, and nothing else. What cannot
run there is listed in `ELSEWHERE` and printed as skipped.
"""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import Distribution, distribution, distributions
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[2]
NAME = "brake-squeal"
EXTRAS = frozenset({"fast", "fe", "proof"})
LIMIT = 600.0  # s for one step
PROCESSES = 2
GALLERY = sorted((ROOT / "docs" / "gallery").glob("*.py"))
ELSEWHERE = {
    r"make|snakemake|git|cp|python -m (benchmarks|workflow)\.": "needs a clone",
    r"sbatch": "needs a cluster",
    r"pip|python -m venv": "installs what is installed here",
    r"python brake_from_mesh\.py|squeal \w+(-\w+)* decks/": "needs CalculiX",
    r"squeal conditions hot\.yaml": "needs matrices of yours",
    r"import ross": "needs ROSS",
    r"squeal article take fig\d+": "needs a build in a clone",
}
"""How a command or a snippet begins that the wheel alone does not run, and why."""

BLOCK = re.compile(r"^```(\{run\}|console|python)\n(.*?)^```", re.DOTALL | re.MULTILINE)
OPTION = re.compile(r"^:(\w+): *(\d+)$")


@dataclass(frozen=True)
class Step:
    """A command or a snippet of a page; `code` is the exit code that the page expects."""

    page: str
    line: int
    text: str
    snippet: bool = False
    code: int = 0

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"{self.page}:{self.line}"

    @property
    def reason_to_skip(self) -> str:
        """Why the wheel alone cannot run it, "" where it can."""
        for beginning, reason in ELSEWHERE.items():
            if re.match(f"({beginning})\\b", self.text):
                return reason
        return ""


def steps_of(page: str, text: str) -> Iterator[Step]:
    """The steps of a page in their order; a script is one."""
    if page.endswith(".py"):
        yield Step(page, 1, text, snippet=True)
    for block in BLOCK.finditer(text):
        kind = block[1]
        first_line = text.count("\n", 0, block.start()) + 2
        if kind == "python":
            yield Step(page, first_line, block[2], snippet=True)
            continue
        code = 0
        for number, line in enumerate(block[2].split("\n"), first_line):
            option = OPTION.match(line)
            if option is not None:
                code = int(option[2]) if option[1] == "code" else code
            elif kind == "{run}" and line:
                yield Step(page, number, line, code=code)
            elif line.startswith("$ "):
                yield Step(page, number, line.removeprefix("$ "))


def required(wheel: Distribution, extras: frozenset[str]) -> list[Distribution]:
    """The installed distributions that a wheel with these extras requires, directly or not."""
    found: dict[str, Distribution] = {}
    waiting = [(wheel, extras)]
    while waiting:
        asking, options = waiting.pop()
        for line in asking.requires or ():
            requirement = Requirement(line)
            marker = requirement.marker
            applies = marker is None or any(marker.evaluate({"extra": e}) for e in {"", *options})
            if applies and requirement.name not in found:
                found[requirement.name] = distribution(requirement.name)
                waiting.append((found[requirement.name], frozenset(requirement.extras)))
    return list(found.values())


def install(folder: Path) -> Path:
    """Build the wheel and an environment of its own in a folder; returns where its programs are."""
    python = sys.executable
    subprocess.run(
        [python, "-m", "flit_core.wheel", "--outdir", str(folder), str(ROOT)],
        check=True,
        capture_output=True,
    )
    (wheel,) = folder.glob("*.whl")
    place = folder / "environment"
    subprocess.run([python, "-m", "venv", "--without-pip", str(place)], check=True)
    programs = place / "bin"
    pip = [python, "-m", "pip", "--python", str(programs / "python"), "install", "--quiet"]
    subprocess.run([*pip, "--no-deps", "--no-index", str(wheel)], check=True)
    (site,) = (place / "lib").glob("python*/site-packages")
    (installed,) = distributions(name=NAME, path=[str(site)])
    for package in required(installed, EXTRAS):
        for file in package.files or ():
            entry = file.parts[0]
            link = site / entry
            if entry != ".." and not link.exists():
                link.symlink_to(Path(str(package.locate_file(entry))))
    return programs


def environment(programs: Path) -> dict[str, str]:
    """Variables with which the programs of that environment are found, and nothing of this one."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    return kept | {"PATH": path, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}


def run_step(
    step: Step, folder: Path, variables: Mapping[str, str]
) -> subprocess.CompletedProcess[str]:
    """Run one step in the folder of its page; errors stand in the output where they came."""
    words = ["python", "-c", step.text] if step.snippet else ["sh", "-c", step.text]
    return subprocess.run(
        words,
        cwd=folder,
        env=variables,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=LIMIT,
        check=False,
    )


def try_page(path: Path, variables: Mapping[str, str]) -> tuple[int, int, list[str]]:
    """Run a page; returns how many steps ran, how many failed, and lines about the others."""
    ran = failed = 0
    lines = []
    page = path.relative_to(ROOT).as_posix()
    with tempfile.TemporaryDirectory() as folder:
        for step in steps_of(page, path.read_text(encoding="utf-8")):
            title = step.text.strip().partition("\n")[0]
            if step.reason_to_skip:
                lines.append(f"{step.place}: skipped, {step.reason_to_skip}: {title}")
                continue
            done = run_step(step, Path(folder), variables)
            ran += 1
            if done.returncode != step.code:
                failed += 1
                words = f"ended with {done.returncode}, expected {step.code}"
                lines.append(f"{step.place}: {words}: {title}\n{done.stdout}")
    return ran, failed, lines


def main() -> int:
    """Run the pages that are named, or all."""
    named = [Path(name).resolve() for name in sys.argv[1:]]
    pages = named or [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *GALLERY]
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(PROCESSES) as pool:
        variables = environment(install(Path(folder)))
        outcomes = list(pool.map(lambda page: try_page(page, variables), pages))
    for _, _, lines in outcomes:
        print(*lines, sep="\n", end="\n" * bool(lines))
    ran = sum(outcome[0] for outcome in outcomes)
    failed = sum(outcome[1] for outcome in outcomes)
    words = (
        f"{ran} commands and snippets of {len(pages)} pages ran in {time.monotonic() - begun:.0f} s"
    )
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{words}, {spent.ru_utime + spent.ru_stime:.0f} s of processors: {failed} failed")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
