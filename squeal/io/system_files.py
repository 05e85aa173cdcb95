"""System files: of matrices, or of components that contact joins."""

from pathlib import Path

from squeal import schema
from squeal.io.system import SystemFile, matrices_file
from squeal.io.system_keys import Document
from squeal.schema import Place


def read_system(path: Path | str) -> SystemFile:
    """The system that a file describes, its matrices read and checked, or its components joined.

    Raises InputError with one sentence that names the file, the key, the value and what is
    allowed.

    Examples
    --------
    >>> import squeal
    >>> from pathlib import Path
    >>> _ = Path("mass.yaml").write_text("{M: [[1.0]], C: [[0.2]], K: [[4.0]]}")
    >>> squeal.eigenvalues(squeal.read_system("mass.yaml")).verdict
    'stable'
    """
    document, at = schema.read_document(path)
    return system_file(document, at, Path(path).parent)


def system_file(
    document: Document, at: Place, folder: Path, band: tuple[float, float] | None = None
) -> SystemFile:
    """The system in a mapping of a file's form; other files are named relative to `folder`.

    `band` (Hz) is that of the question, which components are reduced for. Raises InputError.
    """
    if "components" in document:
        from squeal.io.components import assembly_file  # which no other system needs

        return assembly_file(document, at, folder, read_system, band)
    return matrices_file(document, at, folder)
