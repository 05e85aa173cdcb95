"""`python -m workflow.trials.kills FOLDER [KILLS [WHAT ...]]`: what is left after kills?

Runs builds and queries in FOLDER, sends SIGKILL, SIGTERM or SIGINT at random times to one of their
processes, each run after the first goes on with what a killed one left, and each tenth ends. Then
no process may be left, no file but those of an undisturbed run, and all must have its bytes.
WHAT names some of `COMMANDS`; left out, all but the whole build.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from workflow.release.verify import built
from workflow.trials.copies import ROOT, copied, differing, digests, surroundings

PART = ["results/b1-a.json", "results/b2-c.json", "figures/fig01.pdf", "figures/fig04.pdf"]
SPREADS = "samples: 6000\nspreads: {mu: {between: [0.2, 0.5]}, k1: {relative: 0.05}}\n"
# the shell stands for make, as whose child report.sh runs
AS_MAKE = ["bash", "-c", '"$0" "$@"; exit $?']
BUILD = ["bash", "-c", 'SQUEAL_BUILD=$PPID exec snakemake "$@"', "-"]
SQUEAL = ["python", "-m", "squeal"]
PAD = "tests/scenes/b1-c.yaml"
AXES = ["--first", "mu:0:0.8", "--second", "contact:0.5:2", "--n", "15", "--band", "500:5000"]
MAP = ["map", "brake/system.yaml", *AXES, "--csv", "map.csv", "--workers", "2"]
SCATTER = ["scatter", PAD, "spreads.yaml", "--of", "growth", "--csv", "samples.csv"]
COMMANDS: dict[str, tuple[list[str], list[str]]] = {
    "part": ([*AS_MAKE, *BUILD, "--quiet", "all", "--", *PART], PART),
    "scatter": (
        [*SQUEAL, *SCATTER, "--workers", "2", "--journal", "journal.jsonl"],
        ["samples.csv"],
    ),
    "map": ([*SQUEAL, *MAP], ["map.csv"]),
    "whole": ([*AS_MAKE, "workflow/setup/report.sh"], built()),
}
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
PATIENCE = 15.0  # s that the processes of a killed run may take to end


def processes(folder: Path) -> dict[int, str]:
    """Those that work in a folder, with their commands."""
    found = {}
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            if (entry / "cwd").resolve().is_relative_to(folder) and "Z" not in _state(entry):
                found[int(entry.name)] = (entry / "cmdline").read_text().replace("\0", " ")
        except OSError:  # it has ended
            continue
    return found


def _state(entry: Path) -> str:
    return (entry / "stat").read_text().rpartition(")")[2].split()[0]


class Trials:
    """Kills of one command in a folder: what was done and what was wrong."""

    def __init__(self, name: str, folder: Path, dice: random.Random) -> None:
        self.name, self.dice, self.place = name, dice, folder / name
        self.command, self.wanted = COMMANDS[name]
        self.done, self.wrong = Counter[str](), list[str]()
        self.source = copied(folder / f"{name} source")
        brake = [sys.executable, "-m", "benchmarks.solid_brake", "brake", "600"]
        subprocess.run(brake, cwd=self.source, stdout=subprocess.DEVNULL, check=True)
        (self.source / "spreads.yaml").write_text(SPREADS)
        started = time.monotonic()
        self.exact = self.finished(self.fresh())
        self.span = time.monotonic() - started

    def fresh(self) -> Path:
        """A new copy."""
        shutil.rmtree(self.place, ignore_errors=True)
        shutil.copytree(self.source, self.place)
        return self.place

    def start(self) -> subprocess.Popen[bytes]:
        """The command in the copy."""
        log = (self.place.parent / f"{self.name}.log").open("w")
        env = surroundings(self.place, OPENBLAS_NUM_THREADS="1")
        return subprocess.Popen(self.command, cwd=self.place, env=env, stdout=log, stderr=log)

    def finished(self, place: Path) -> dict[str, str]:
        """Run to the end; digests, and names of all other files that stand then."""
        if self.start().wait():
            self.wrong.append(f"a run failed: {self.place.parent / self.name}.log")
        names = [str(p.relative_to(place)) for p in place.rglob("*") if p.is_file()]
        kept = (n for n in names if not n.startswith((".snakemake", "logs")) and ".pyc" not in n)
        return dict.fromkeys(kept, "stands") | digests(place, self.wanted)

    def kill(self) -> None:
        """Start, kill at a random time, wait until all has ended."""
        running = self.start()
        time.sleep(self.dice.uniform(0.0, 1.2 * self.span))
        others = sorted(processes(self.place).keys() - {running.pid})
        worker = bool(others) and self.dice.random() < 0.5
        victim = self.dice.choice(others) if worker else running.pid
        by = self.dice.choice(SIGNALS)
        alive = running.poll() is None
        try:
            os.kill(victim, by)
        except ProcessLookupError:
            alive = False
        what = f"{by.name} to {'a worker' if worker else 'the parent'}"
        self.done[what if alive else "too late"] += 1
        self.span *= 1.0 if alive else 0.7
        began = time.monotonic()
        while (left := processes(self.place)) and self.waits(began, running, by):
            time.sleep(0.1)
        for process, words in left.items():
            self.wrong.append(f"{what}: lives on: {process} {words[:90]}")
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        running.wait()

    def waits(self, began: float, running: subprocess.Popen[bytes], by: int) -> bool:
        """Whether processes may still be there: a run that was not killed comes to its end."""
        whole = running.poll() is None
        return time.monotonic() < began + PATIENCE + (20.0 if whole else 2.0) * self.span

    def run(self, kills: int) -> None:
        """Kill, go on, and compare after each tenth."""
        for number in range(1, kills + 1):
            self.kill()
            if number % 10 == 0 or number == kills:
                found = self.finished(self.place)
                unlike = differing(self.exact, found)
                self.wrong += [f"after kill {number}: {n} differs" for n in unlike]
                self.fresh()


def main() -> int:
    """Kill and print what was found; 1 where something was wrong."""
    folder, *more = sys.argv[1:]
    kills, names = int(more[0]) if more else 40, more[1:] or [*COMMANDS][:-1]
    place = Path(folder).resolve()
    if place.is_relative_to(ROOT):
        sys.exit("the folder must lie outside the repository")
    signal.signal(signal.SIGINT, signal.default_int_handler)  # shells let what is behind ignore it
    wrong = []
    for name in names:
        trials = Trials(name, place, random.Random(name))
        trials.run(kills)
        print(f"{name}: {kills} kills, {len(trials.wrong)} wrong: {dict(trials.done)}", flush=True)
        print(*trials.wrong, sep="\n", end="\n" if trials.wrong else "", flush=True)
        wrong += trials.wrong
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
