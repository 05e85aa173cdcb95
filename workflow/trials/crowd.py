"""`python -m workflow.trials.crowd [--queries 64] [--repeated 100000]`: a crowd of queries.

Many queries started at once must print the bytes of the same ones one after another, and a process
that answers one query after another must not grow.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np

import squeal
from workflow.trials.copies import BIN, ROOT

SCENES = [ROOT / f"workflow/scenes/{stem}.yaml" for stem in ("b1-c", "b2-c", "b1-b", "b2-b")]
COMMANDS = (
    ("eigenvalues", "--json"),
    ("critical-friction", "--json"),
    ("simulate", "--json"),
    ("map", "--n", "20", "--json"),
)
LOOKS = 10  # at the memory
GROWTH = 2_000_000  # bytes over the second half that count as none


def started(k: int) -> subprocess.Popen[bytes]:
    """The k-th query."""
    verb, *options = COMMANDS[k % len(COMMANDS)]
    scene = SCENES[k // len(COMMANDS) % len(SCENES)]
    asked: list[str | Path] = [
        BIN / "squeal",
        verb,
        scene,
        *options,
        "--set",
        f"mu={0.3 + 0.001 * k}",
    ]
    return subprocess.Popen(asked, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def together(count: int) -> int:
    """How many queries print other bytes beside each other than one after another."""
    at_once = [answer(query) for query in [started(k) for k in range(count)]]
    alone = [answer(started(k)) for k in range(count)]
    return sum(a != b for a, b in zip(at_once, alone, strict=True))


def answer(query: subprocess.Popen[bytes]) -> bytes:
    """What a query prints."""
    said, _ = query.communicate()
    assert query.returncode == 0, said
    return said


def repeated(count: int) -> list[int]:
    """Resident bytes of this process after each tenth of so many queries of two kinds."""
    scene = squeal.read_scene(SCENES[0])
    rng, sizes, page = np.random.default_rng(0), [], resource.getpagesize()
    for look in range(LOOKS):
        for k in range(count // LOOKS):
            changed = scene.replace(mu=float(rng.uniform(0.0, 0.6)))
            squeal.eigenvalues(changed)
            if k % 50 == 0:
                squeal.thresholds(changed)
        held = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * page
        sizes.append(held)
        print(f"{(look + 1) * count // LOOKS} queries: {held / 1e6:.1f} MB", flush=True)
    return sizes


def main() -> int:
    """Ask; 1 where bytes differ or memory grows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--queries", type=int, default=64)
    parser.add_argument("--repeated", type=int, default=100_000)
    given = parser.parse_args()
    differ = together(given.queries)
    print(f"{given.queries} queries at once: {differ} print other bytes than alone")
    sizes = repeated(given.repeated)
    grown = sizes[-1] - sizes[LOOKS // 2 - 1]
    print(f"memory grew by {grown / 1e6:.1f} MB over the second half")
    return int(differ > 0 or grown > GROWTH)


if __name__ == "__main__":
    sys.exit(main())
