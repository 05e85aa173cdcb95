"""`squeal export`: the matrices of a pad or of a (reduced) system as files that can be read again.
They are written with a system file that names them, so that every query takes them back.

squeal export pad.yaml --output matrices --format npz
squeal export brake.yaml --output reduced --method reduced --band 500:5000
"""

import argparse
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import refuse, take
from squeal.cli.streams import steps
from squeal.errors import InputError, InputWarning
from squeal.io.scene import Scene
from squeal.io.writing import JsonObject, aligned_text, whole_folder
from squeal.linear.terms import Term
from squeal.queries.eigenvalues import data_of_pad
from squeal.queries.pads.equilibrium import DIGITS, analyse
from squeal.queries.systems.matrices import write_assembly, write_system
from squeal.queries.systems.reduced import basis_of
from squeal.queries.systems.system_analysis import SystemAnalysis

if TYPE_CHECKING:
    from squeal.io.system import SystemFile


@dataclass(frozen=True)
class _Exported:
    """The system whose matrices are written, and the files in the folder.

    basis: what was left out, of a reduced one; note: what to know of it, in the system file too.
    """

    system: squeal.System
    files: list[JsonObject]
    file: str = "system.yaml"
    basis: Any = None
    note: str = ""


def options(parser: Parser) -> None:
    """Options of `squeal export`."""
    parser.add_argument(
        "--output", metavar="FOLDER", read=Path, required=True, help="a new or empty folder"
    )
    parser.add_argument(
        "--format",
        choices=("mtx", "mat", "npz"),
        default="mtx",
        help="how matrices are written (mtx)",
    )
    take(parser, "method", "band", "region", "values", "memory")


def run(given: argparse.Namespace) -> Reply:
    """Write the matrices and the system file."""
    folder: Path = given.output
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        kind = "not empty" if folder.is_dir() else "no folder"
        raise InputError(f"--output {folder}: is {kind}; a new or empty folder is allowed")
    subject = given.source.subject()
    if isinstance(subject, Scene):
        exported = _export_pad(given, subject)
    elif given.method is None and subject.assembly is not None:  # `full` writes them joined
        exported = _export_assembly(given, subject)
    elif given.method in (None, "full"):
        whole_system = "a whole system; --method reduced or modal takes it"
        refuse(given, "band", "region", "values", beside=whole_system)
        whole = subject if subject.assembly is None else subject.assembly
        system = whole.system
        files = write_system(folder, system, given.format, is_new=True)
        exported = _Exported(system, files)
    else:
        exported = _export_reduced(given, subject)
    system = exported.system
    files = exported.files
    text = f"{system.name}: {system.n} rows, {len(files)} matrices and {exported.file} in {folder}"
    if exported.note:
        text += f"\n{exported.note}"
    cells = [(file["file"], file["part"], file["factor"]) for file in files]
    text += f"\n{aligned_text(cells, right=False)}"
    answer = {"folder": str(folder), "rows": system.n, "files": files, "basis": exported.basis}
    return Reply(lambda: answer, lambda: text)


def _export_pad(given: argparse.Namespace, scene: Scene) -> _Exported:
    """The matrices of a pad about its equilibrium, each with bounds of its errors where known."""
    name = given.source.name
    # these options choose among the roots of a large system
    refuse(given, "method", "band", "region", "values", beside=f"{name}, a scene with six roots")
    analysis = analyse(scene)
    doubt: str = analysis.doubt  # why nothing about the matrices is certified; "" if it may be
    # three arrays (3, 3), how far the entries of M, C and K may be off; None if not known
    radii: tuple[Any, ...] | None = None
    if analysis.errors is not None:
        radii = data_of_pad(scene, analysis).radii
    if radii is not None and not np.isfinite(radii).all():  # a file holds finite bounds alone
        doubt = "the errors of an entry are not known"
        radii = None
    parts: list[tuple[Term, ...]] = []  # M, C and K, each a sum of one term
    for X, errors in zip(analysis.matrices, radii or (None, None, None), strict=True):
        parts.append((Term(X, digits=DIGITS, errors=errors),))
    mass, damping, stiffness = parts
    if not analysis.matrices.C.any():
        damping = ()
    system = squeal.System(mass, damping, stiffness, name=Path(name).stem)
    if doubt:  # the written system says it too, so that its answers are not certified either
        system = system.assuming(doubt)
    # at another friction the equilibrium differs, and with it the matrices
    note = f"linearised at mu = {scene.pad.mu:g}; the matrices depend on no parameter"
    files = write_system(given.output, system, given.format, is_new=True, reference=note)
    return _Exported(system, files, note=note)


def _export_assembly(given: argparse.Namespace, subject: "SystemFile") -> _Exported:
    """Components as they were reduced, and the file that joins them."""
    refuse(given, "region", "values", beside="components; --method reduced or modal takes it")
    source = given.source
    with whole_folder(given.output, is_new=True) as folder:
        files = write_assembly(folder, subject, source.document, source.folder, given.format)
    basis = subject.assembly.reduction
    return _Exported(subject.system, files, file="assembly.yaml", basis=basis)


def _export_reduced(given: argparse.Namespace, subject: "SystemFile") -> _Exported:
    """A system reduced to the roots of a band or region."""
    analysis = SystemAnalysis.of(
        subject, band=given.band, region=given.region, memory=given.memory, progress=steps()
    )
    reduction = analysis.reduced(given.values, given.method)
    if reduction.spurious:
        warnings.warn(
            f"the reduced system has {reduction.spurious} roots that the full one has not",
            InputWarning,
            stacklevel=2,
        )
    system = reduction.standalone_system
    files = write_system(given.output, system, given.format, is_new=True)
    basis = basis_of(reduction, analysis.selection)
    return _Exported(system, files, basis=basis)
