"""Pictures of the gallery in `sphinx-build -b text`; sphinx-gallery draws HTML and LaTeX alone."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.writers.text import TextTranslator
from sphinx_gallery.directives import imgsgnode


def visit(translator: TextTranslator, node: nodes.Element) -> None:
    """Write the words of a picture, as of any other."""
    translator.visit_image(node)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the writer."""
    app.setup_extension("sphinx_gallery.gen_gallery")
    app.add_node(imgsgnode, override=True, text=(visit, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
