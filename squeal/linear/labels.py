"""Labels of rows: of data frames, and of files."""

from collections import Counter
from collections.abc import Hashable, Mapping

from squeal.errors import InputError

Label = Hashable
"""Of a row: what an index of pandas or xarray holds, of files (node, degree of freedom)."""


def row_name(label: Label) -> str:
    """The label of a row in words, the levels of one that has several between colons."""
    levels = label if isinstance(label, tuple) else (label,)
    return ":".join(map(str, levels))


def labels_of(matrix: object) -> tuple[list[Label], list[Label]] | None:
    """The labels of rows and columns of a data frame (pandas) or a data array (xarray) that has
    them; None of any other matrix."""
    if hasattr(matrix, "columns") and hasattr(matrix, "index"):
        return list(matrix.index), list(matrix.columns)
    indexes = getattr(matrix, "indexes", {})
    labels = [list(indexes[name]) for name in getattr(matrix, "dims", ()) if name in indexes]
    if len(labels) != 2:
        return None
    return labels[0], labels[1]


def rows_in_words(count: int) -> str:
    """How many rows, such as "2 rows"."""
    if count == 1:
        return "1 row"
    return f"{count} rows"


def refuse_other_labels(labels: Mapping[str, list[Label]]) -> None:
    """Refuse data frames whose rows or columns have other labels, or another order, than those of
    the first, and a label that stands there twice. Raises InputError.

    labels: those of the rows and those of the columns of each data frame, by what messages call
    them, such as "index of K mu"; empty without data frames.
    """
    if not labels:
        return
    first = next(iter(labels))
    count_of = Counter(labels[first])
    if len(count_of) < len(labels[first]):
        (repeated, count), *_ = count_of.most_common(1)
        raise InputError(
            f"{first}: the label {row_name(repeated)} stands there {count} times; each row needs "
            "a label of its own"
        )
    for name, others in labels.items():
        if others != labels[first]:
            raise InputError(
                f"{name}: other labels, or in another order, than {first}; labelled matrices must "
                "have the same labels in the same order as rows and as columns "
                "(frame.loc[labels, labels] sorts them)"
            )
