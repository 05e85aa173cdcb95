"""`squeal export`: the matrices of a pad or of a (reduced) system as files that can be read again.
They are written with a system file that names them, so that every query takes them back.

squeal export pad.yaml --output matrices --format npz
squeal export brake.yaml --output reduced --method reduced --band 500:5000
"""

import argparse
import warnings
from pathlib import Path
from typing import Any

import squeal
from squeal.analysis.pads.equilibrium import analyse
from squeal.analysis.systems.matrices import write_assembly, write_system
from squeal.analysis.systems.system_analysis import SystemAnalysis
from squeal.cli.command import Parser, Reply
from squeal.cli.options import refuse, take
from squeal.cli.streams import steps
from squeal.errors import InputError, InputWarning
from squeal.io.scene import Scene
from squeal.io.writing import aligned, picked


def options(parser: Parser) -> None:
    """Options of `squeal export`."""
    words = "a new or empty folder"
    parser.add_argument("--output", metavar="FOLDER", read=Path, required=True, help=words)
    words = "how matrices are written (mtx)"
    parser.add_argument("--format", choices=("mtx", "mat", "npz"), default="mtx", help=words)
    take(parser, "method band region values memory")


def run(given: argparse.Namespace) -> Reply:
    """Write the matrices and the system file."""
    folder: Path = given.output
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        kind = "not empty" if folder.is_dir() else "no folder"
        raise InputError(f"--output {folder}: is {kind}; a new or empty folder is allowed")
    subject, basis, rows, frozen = given.source.subject(), None, None, ""
    if isinstance(subject, Scene):
        refuse(given, "method band region values", f"{given.source.name}, a scene with six roots")
        M, C, K = analyse(subject).matrices
        name = Path(given.source.name).stem
        system = squeal.System(M, C if C.any() else None, K, name=name)
        # another friction has another equilibrium, and so other matrices
        frozen = f"linearised at mu = {subject.pad.mu:g}; the matrices depend on no parameter"
    elif given.method is None and subject.assembly is not None:
        refuse(given, "region values", "components; --method reduced or modal takes it")
        system, source, basis = subject.system, given.source, subject.assembly.reduction
        rows = write_assembly(folder, subject, source.document, source.folder, given.format)
    elif given.method in (None, "full"):
        refuse(given, "band region values", "a whole system; --method reduced or modal takes it")
        system = subject.system
    else:
        asked: Any = picked(given, "band region memory") | {"progress": steps()}
        reduction, basis = SystemAnalysis.of(subject, **asked).reduced(given.values, given.method)
        if reduction.spurious:
            words = f"the reduced system has {reduction.spurious} roots that the full one has not"
            warnings.warn(words, InputWarning, stacklevel=2)
        system = reduction.system
    file = "system.yaml" if rows is None else "assembly.yaml"
    if rows is None:
        more = {"reference": frozen} if frozen else {}
        rows = write_system(folder, system, given.format, **more)
    head = f"{system.name}: {system.n} rows, {len(rows)} matrices and {file} in {folder}"
    if frozen:
        head += f"\n{frozen}"
    cells = [(r["file"], r["part"], r["factor"]) for r in rows]
    return Reply(
        lambda: {"folder": str(folder), "rows": system.n, "files": rows, "basis": basis},
        lambda: f"{head}\n{aligned(cells, right=False)}",
    )
