"""Text tables for people: numbers, columns, and long lists cut short."""

from collections.abc import Mapping, Sequence

SHOWN = 40  # rows; a longer table shows its two ends
WORDS = {"marginal": "marginal (undamped, nothing grows)"}
"""What a verdict means, where its word alone does not say it."""


def columns_with(parameters: Sequence[str], others: Mapping[str, str]) -> dict[str, str]:
    """Columns of a table and their units: parameters, which have none, and then others.

    A parameter with the name of one of the others is called parameter.NAME.
    """
    names = [f"parameter.{name}" if name in others else name for name in parameters]
    return dict.fromkeys(names, "") | dict(others)


def in_words(verdict: str) -> str:
    """A verdict, or a sentence that begins with one, for people."""
    word, colon, rest = verdict.partition(":")
    return WORDS.get(word, word) + colon + rest


def number(value: float, digits: int = 6) -> str:
    """A number in so many digits, never "-0"."""
    return f"{value + 0.0:.{digits}g}"


def roots_in_words(count: int) -> str:
    """A number of roots: 1 root, 2 roots."""
    return f"{count} root{'' if count == 1 else 's'}"


def table(rows: Sequence[Sequence[str]], right: bool = True) -> str:
    """Rows of text as aligned columns; the first column is aligned to the left."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if right and i else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def elided(rows: Sequence[Sequence[str]], where: str, most: int = SHOWN) -> str:
    """`table` of a head and many rows, of which the middle is left out; `where` has all of them."""
    left = len(rows) - 1 - most
    if left <= 0:
        return table(rows)
    cut = 1 + most // 2
    lines = table([*rows[:cut], *rows[cut + left :]]).split("\n")
    return "\n".join([*lines[:cut], f"  ... {left} more rows (all with {where})", *lines[cut:]])
