"""A system as matrix files with a system file that reads them back."""

from pathlib import Path
from typing import Any

import numpy as np

from squeal.errors import InputError
from squeal.io.matrices import fingerprint, write_matrix
from squeal.io.writing import new_folder, whole_folder, write_text
from squeal.linear.system import TermSystem


def write_system(
    folder: Path, system: TermSystem, suffix: str, more: str = ""
) -> list[dict[str, Any]]:
    """Write the terms of a system and a system file into a folder; a row for each matrix.

    `more` is added to the system file.
    Raises InputError for what the format does not hold, complex matrices among it; nothing is
    written then.
    """
    rows = []
    lines = [f"name: {_quoted(system.name)}"]
    own = ", ".join(f"{name}: {value!r}" for name, value in system.parameters.items())
    lines += [f"parameters: {{{own}}}", f"parameter: {system.parameter}"]
    with new_folder(folder), whole_folder(folder) as place:
        for part in ("M", "C", "K"):
            terms = getattr(system, part)
            if terms:
                lines.append(f"{part}:")
            for i, term in enumerate(terms):
                if np.iscomplexobj(term.matrix):
                    raise InputError(
                        f"{part}: is complex (structural damping) and cannot be written; damping "
                        "by rayleigh or ratios can"
                    )
                name = f"{part}{i}.{suffix}"
                write_matrix(place / name, term.matrix, part)
                text = term.factor.text
                lines.append(f"  - {{file: {name}, factor: {_quoted(text)}}}")
                row = {"part": part, "file": name, "factor": text}
                rows.append(row | {"fingerprint": fingerprint(term.matrix)})
        write_text(place / "system.yaml", "\n".join(lines) + f"\n{more}")
    return rows


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
