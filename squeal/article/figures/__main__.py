"""`python -m squeal.article.figures MODULE ARGUMENT ... --out FILE`: draws one figure.

Beside the PDF stands a text file with the figure's alternative text, in ASCII since LaTeX reads it.
"""

import argparse
import pkgutil
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from squeal.article import figures
from squeal.article.records import call
from squeal.cli.streams import exit_code
from squeal.plots.style import save

NAMES = tuple(m.name for m in pkgutil.iter_modules(figures.__path__) if m.name[0] != "_")


def main(given: Sequence[str] | None = None) -> int:
    """Draw a figure; 2 with a reason if it cannot be drawn from what it is given."""
    parser = argparse.ArgumentParser(description="Draw a figure of the report.")
    parser.add_argument("module", choices=NAMES, metavar="MODULE", help=", ".join(NAMES))
    parser.add_argument("arguments", nargs="*", metavar="ARGUMENT", help="what it is drawn from")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="PDF (with a text), SVG or PNG"
    )
    chosen = parser.parse_args(given)
    return exit_code(chosen.module, lambda: _run(chosen))


def _run(chosen: argparse.Namespace) -> int:
    """Draw a figure from its arguments and save it."""
    drawing = call(import_module(f"{figures.__name__}.{chosen.module}").draw, chosen.arguments)
    drawing.alternative.encode("ascii")  # raises where a format could not hold the text
    save(drawing, chosen.out, text=chosen.out.suffix == ".pdf")
    return 0


if __name__ == "__main__":
    sys.exit(main())
