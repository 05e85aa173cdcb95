"""`squeal export`: the matrices of a pad or of a (reduced) system as files that can be read again.

They are written with a system file that names them, so that every query takes them back.
"""

import argparse
import warnings
from pathlib import Path

import numpy as np

from squeal.analysis.eigenvalues import analyse
from squeal.analysis.systems.sweeps import reduced_for
from squeal.analysis.systems.wanted import check_memory
from squeal.analysis.systems.writing import write_system
from squeal.cli import system_options
from squeal.cli.base import Answer, Parser
from squeal.cli.numbers import few, spaced
from squeal.cli.systems import basis_row
from squeal.cli.tables import table
from squeal.errors import InputError, InputWarning
from squeal.linear.system import Term, TermSystem
from squeal.sparse.reduction import Reduction

FORMATS = ("mtx", "mat", "npz", "hb", "rua", "inp", "txt")
VALUES = 9  # at which a reduced system has to be good, if no sweep names them


def options(parser: Parser) -> None:
    """Options of `squeal export`."""
    parser.add_argument(
        "--output", metavar="FOLDER", type=Path, required=True, help="a new or empty folder"
    )
    parser.add_argument(
        "--format", metavar="NAME", default="mtx", help=f"one of {', '.join(FORMATS)} (mtx)"
    )
    parser.add_argument(
        "--method", metavar="NAME", help="systems only: full (left out), reduced or modal"
    )
    parser.add_argument("--band", metavar="LOW:HIGH", help="of a reduced system, Hz")
    parser.add_argument("--region", metavar="RE0:RE1:IM0:IM1", help="of a reduced system")
    parser.add_argument(
        "--sweep", metavar="A:B:N", help="values of the parameter that it has to serve"
    )
    system_options.work_options(parser)


def run(given: argparse.Namespace) -> Answer:
    """Write the matrices and the system file."""
    if given.format not in FORMATS:
        raise InputError(
            f"--format {given.format}: is not allowed; it must be one of {', '.join(FORMATS)}"
        )
    folder: Path = given.output
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        kind = "not empty" if folder.is_dir() else "no folder"
        raise InputError(f"--output {folder}: is {kind}; a new or empty folder is allowed")
    file = system_options.system_of(given)
    reduction: Reduction | None = None
    if file is None:
        system_options.refuse_options(given, ("method", "band", "region", "sweep"))
        plain = given.source.system()
        system = _of_scene(given) if plain is None else plain.terms()
        inputs = [given.source.file]
    else:
        system, inputs = file.system, [given.source.file, *file.inputs]
        if given.method not in (None, "full"):
            reduction = _reduced(given, system)
            system = reduction.system
        elif which := next((n for n in ("band", "region", "sweep") if getattr(given, n)), None):
            raise InputError(
                f"--{which} {getattr(given, which)}: is of a reduced system; --method reduced or "
                "modal is allowed with it"
            )
    rows = write_system(folder, system, given.format)
    return Answer(
        lambda: {
            "folder": str(folder),
            "rows": system.n,
            "files": rows,
            "basis": basis_row(reduction, system_options.wanted_of(given)),
        },
        lambda: "\n".join(
            [
                f"{system.name}: {system.n} rows, {len(rows)} matrices and system.yaml in {folder}",
                table([(f"  {r['file']}", r["part"], r["factor"]) for r in rows], right=False),
            ]
        ),
        inputs,
    )


def _of_scene(given: argparse.Namespace) -> TermSystem:
    scene = given.source.scene()
    found = analyse(scene).matrices
    damping = (Term(found.C),) if np.any(found.C) else ()
    name, mu = Path(given.source.name).stem, scene.pad.mu
    return TermSystem((Term(found.M),), damping, (Term(found.K),), {"mu": mu}, "mu", name)


def _reduced(given: argparse.Namespace, system: TermSystem) -> Reduction:
    if given.method not in ("reduced", "modal"):
        raise InputError(
            f"--method {given.method}: is not allowed; it must be one of full, reduced, modal"
        )
    wanted = system_options.wanted_of(given)
    if wanted.rectangle is None:
        raise InputError("--band: is missing; a reduced system needs --band or --region")
    check_memory(system, given.memory)
    own = system.parameters[system.parameter]
    values = spaced(given.sweep, "--sweep") if given.sweep else [own]
    changes = [{system.parameter: v} for v in few(values, VALUES)]
    reduction, _ = reduced_for(
        system, wanted, changes, given.method, system_options.progress_of(given)
    )
    if reduction.spurious:
        warnings.warn(
            f"the reduced system has {reduction.spurious} roots in the band that the full one has "
            "not, over all values checked",
            InputWarning,
            stacklevel=2,
        )
    return reduction
