"""Matrices of a system before anything is solved: what they are and their files."""

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from shutil import copyfile
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from squeal.io.matrices import fingerprint, write_matrix
from squeal.io.system import SystemFile
from squeal.io.writing import JsonObject, whole_folder, write_csv, write_text
from squeal.linear.matrices import EPS, Matrix, dense, norm_of, unit_diagonal
from squeal.linear.moduli import Modulus, Tabulated
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.schema import Place, document_text
from squeal.sparse.components import Component

ALL_ROWS = 400  # up to so many rows all roots are computed


def is_symmetric(matrix: Matrix) -> bool:
    """True if a matrix (n, n) and its transpose differ by rounding only, 1e-12 of its largest
    entry."""
    difference = abs(matrix - matrix.T).max()
    return bool(difference <= 1e-12 * abs(matrix).max())


def _properties(matrix: Matrix) -> str:
    """Symmetry of M or K in words; of a small one whether it is definite, and its condition.

    Definiteness and condition are those of the matrix scaled to a unit diagonal, which do not
    depend on the units of its rows.
    """
    if np.iscomplexobj(matrix):
        return "complex"
    symmetric = is_symmetric(matrix)
    properties = ["symmetric" if symmetric else "not symmetric"]
    if matrix.shape[0] <= ALL_ROWS:
        scaled = unit_diagonal(dense(matrix))
        reciprocal_condition = float(1 / np.linalg.cond(scaled))
        if reciprocal_condition <= 4 * EPS:
            properties.append("numerically singular")
        elif symmetric and np.linalg.eigvalsh(scaled)[0] > 0.0:
            properties.append("positive definite")
        else:
            properties.append("regular")
        properties.append(f"reciprocal condition {reciprocal_condition:.2g}")
    return ", ".join(properties)


def system_checks(system: TermSystem) -> dict[str, str]:
    """Properties of M, K and, if there is damping, C in words, at the system's parameters.

    They are symmetry, definiteness, condition, and rows of K that are empty.
    """
    M, C, K = system.frozen().at()
    checks = {"M": _properties(M), "K": _properties(K)}
    entries_of_row = np.diff(csr_array(K).indptr)
    empty = np.flatnonzero(entries_of_row == 0)
    if empty.size:
        count = "1 row" if empty.size == 1 else f"{empty.size} rows"
        checks["K"] += f", {count} without an entry, the first is row {empty[0] + 1}"
    if C is not None and norm_of(C):
        checks["C"] = "symmetric" if is_symmetric(C) else "not symmetric"
    return checks


def matrix_list(file: SystemFile) -> list[JsonObject]:
    """A row for each matrix of a system file, as the JSON object holds it.

    `part` is M, C, K or K4 (structural damping), in an assembly behind the component's name,
    such as disc.M; `labels` says whether the file names its rows, `digits` to how many digits the
    entries were rounded. `file`, `key`, `format` and `digits` are None where there is nothing to
    name, as for a matrix that stands in the system file itself.
    """
    rows = []
    for origin in file.origins:
        matrix = origin.matrix
        rows.append(
            {
                "part": origin.part,
                "file": origin.file or None,
                "key": origin.key or None,
                "format": origin.form or None,
                "labels": origin.labelled,
                "factor": origin.factor,
                "digits": origin.digits,
                "rows": int(matrix.shape[0]),
                "nonzeros": int(matrix.nnz),
                "symmetric": is_symmetric(matrix),
                "fingerprint": fingerprint(matrix),
            }
        )
    return rows


def write_system(
    folder: Path, system: TermSystem, suffix: str, is_new: bool = False, **more: Any
) -> list[JsonObject]:
    """Write each term of a system to a file, and the system file that reads them again.

    Parameters
    ----------
    folder : Path
        The folder that receives the files; made if it is not there.
    system : TermSystem
        The system.
    suffix : str
        Suffix of the matrix files, which says their format: mtx, mat or npz.
    is_new : bool
        Whether the folder has to be empty.
    **more
        Further keys of the system file.

    Returns
    -------
    list of dict
        For each matrix its part (M, C or K), file, factor and fingerprint.

    Raises
    ------
    InputError
        For what the format does not hold; nothing is written then.
    """
    rows = []
    document = _keys_beside_matrices(system)
    with whole_folder(folder, is_new) as target:  # all files or none
        for part, terms in zip("MCK", system.parts, strict=True):
            for i, term in enumerate(terms):
                file = f"{part}{i}.{suffix}"
                write_matrix(target / file, term.matrix, part)
                rows.append(
                    {
                        "part": part,
                        "file": file,
                        "factor": term.factor.text,
                        "fingerprint": fingerprint(term.matrix),
                    }
                )
                entry = {"file": file} | _write_factor(target, f"{part}{i}.csv", term)
                entry |= _write_precision(target, f"{part}{i}_errors.{suffix}", term)
                is_structural_damping = isinstance(term.factor, Modulus) and term.factor.imaginary
                if is_structural_damping:  # an imaginary stiffness, which has its own key
                    document.setdefault("damping", {}).setdefault("K4", []).append(entry)
                else:
                    document.setdefault(part, []).append(entry)
        write_text(target / "system.yaml", document_text(document | more))
    return rows


def _keys_beside_matrices(system: TermSystem) -> JsonObject:
    """The keys of a system file beside its matrices: name, assumptions and parameters."""
    document: JsonObject = {"name": system.name}
    if system.assumptions:
        document["assumptions"] = list(system.assumptions)
    parameters = {}
    for name, value in system.given.items():
        # a file that names no free parameter is read with one that is called mu, of value 0: it is
        # left out where this is it and no matrix depends on it
        is_default = name == system.parameter == "mu" and name not in system.names and value == 0.0
        if not is_default:
            parameters[name] = value
    if parameters:
        document["parameters"] = parameters
    if system.parameter in parameters:
        document["parameter"] = system.parameter
    return document


def _write_factor(folder: Path, file: str, term: Term) -> JsonObject:
    """The keys of a system file that give the factor of a term: a modulus, a table or a formula.

    A table of a modulus over the frequency, or of a factor over a parameter, is written to `file`
    in the folder.
    """
    factor = term.factor
    if isinstance(factor, Modulus):
        keys: JsonObject = {"factor": factor.factor.text}
        if factor.loss:
            keys["structural"] = factor.loss.text
        table = factor.table
        if table:
            keys["modulus"] = {"file": file}
            moduli = zip(table.frequencies, table.storage, table.loss, strict=True)
            write_csv(folder / file, ["frequency", "storage", "loss"], moduli)
        return keys
    if isinstance(factor, Tabulated):
        pairs = zip(factor.points, factor.quantities, strict=True)
        write_csv(folder / file, [factor.parameter, factor.column], pairs)
        table_keys = {"file": file, "column": factor.column, "over": factor.parameter}
        return {"factor": factor.factor.text, "table": table_keys}
    return {"factor": factor.text}


def _write_precision(folder: Path, file: str, term: Term) -> JsonObject:
    """The keys of a system file that tell how far the entries of a term may be off.

    Errors that its digits do not tell are written to `file` in the folder.
    """
    keys: JsonObject = {}
    if term.digits is not None:
        keys["digits"] = term.digits
        if term.errors is not None:
            keys["errors"] = file
            write_matrix(folder / file, term.errors, "errors")
    if term.rounding:
        keys["rounding"] = term.rounding
    return keys


def write_components(
    folder: Path, components: Sequence[Component], suffix: str
) -> list[JsonObject]:
    """Write each component into a folder of its name, with the nodes of its rows and its load.

    Returns a row for each matrix, and raises InputError, as `write_system` does.
    """
    rows = []
    for body in components:
        home = folder / body.name
        written = write_system(home, body.system, suffix, coordinates={"file": "nodes.csv"})
        for row in written:
            row["file"] = f"{body.name}/{row['file']}"
        rows += written
        # generalised coordinates of a reduced component have neither a node nor a direction
        nodes = [node or "-" for node in body.nodes.tolist()]
        dofs = ["xyz-"[direction] for direction in body.directions]  # -1, of no direction, is "-"
        positions = np.zeros((len(nodes), 3)) if body.places is None else body.places
        table = zip(nodes, dofs, *positions.T.tolist(), strict=True)
        write_csv(home / "nodes.csv", ["node", "dof", "x", "y", "z"], table)
        flexibility = body.residual_flexibility
        if flexibility is not None:
            write_matrix(home / f"flexibility.{suffix}", flexibility, "residual_flexibility")
        if body.load is not None:
            # by rows, not nodes: a load of a reduced component acts on generalised coordinates too
            loads = ((i + 1, float(body.load[i])) for i in np.flatnonzero(body.load))
            write_csv(home / "load.csv", ["row", "force"], loads)
    return rows


def write_assembly(
    folder: Path, file: SystemFile, document: JsonObject, home: Path, suffix: str
) -> list[JsonObject]:
    """Write the components of an assembly as they were joined, and a file that joins them again.

    Parameters
    ----------
    folder : Path
        The folder that receives the files.
    file : SystemFile
        The assembly as it was read; its components may have been reduced.
    document : dict
        The content of the assembly file that was read.
    home : Path
        The folder of that file.
    suffix : str
        Suffix of the matrix files: mtx, mat or npz.

    Returns
    -------
    list of dict
        A row for each matrix, as of `write_system`.

    Raises
    ------
    InputError
        For a load with a factor of 0, and for what the format does not hold.
    """
    from squeal.io.components import write_points  # which no other system needs

    components = file.assembly.components
    rows = write_components(folder, components, suffix)
    # the file that was read, without the keys whose work the written matrices hold already
    joined = deepcopy(document)
    joined.pop("cutoff", None)  # the components are reduced already
    for (name, keys), body in zip(joined["components"].items(), components, strict=True):
        keys["file"] = f"{name}/system.yaml"
        keys.pop("rotation", None)  # its terms are among the matrices
        if body.rows:
            keys["reduced"] = {
                "rows": body.rows,
                "cutoff": body.cutoff,
                "residual_flexibility": f"{name}/flexibility.{suffix}",
            }
        load = keys.get("load")
        # the written forces hold the value of the factor at the present parameters: the new factor
        # is the old one over this value, so that it is 1 now and serves at other parameters too
        if load:
            factor = Formula(str(load.get("factor", "1")))  # the file may have a number
            value = factor.value(file.system.parameters)
            if value == 0.0:
                at = Place("assembly", "components", name, "load", "factor")
                raise at.refuse("is 0, so that no force is known; another value is needed")
            keys["load"] = {"file": f"{name}/load.csv", "factor": f"({factor.text}) / {value!r}"}
    for i, keys in enumerate(joined["contact"], 1):
        pairs_file = f"pairs{i}.csv"
        if keys.pop("faces", None):  # the pairs of points that were found between the faces
            del keys["distance"]
            keys["pairs"] = {"file": pairs_file}
            write_points(folder / pairs_file, file.assembly.contacts[i - 1])
        elif "pairs" in keys:
            copyfile(home / keys["pairs"]["file"], folder / pairs_file)
            keys["pairs"] = {"file": pairs_file}
    write_text(folder / "assembly.yaml", document_text(joined))
    return rows
