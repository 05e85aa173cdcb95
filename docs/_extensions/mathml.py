"""Formulas as MathML, which browsers draw by themselves: no script, nothing to fetch."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

SHORT = re.compile(r"\\[td]?frac\d")
LOGGER = logging.getLogger(__name__)


def converted(node: nodes.Element, block: bool) -> str:
    """The MathML of a node's formula; one that cannot be converted is a warning."""
    try:
        if SHORT.search(node.astext()):
            raise ValueError("the converter reads \\frac12 as 12 over what follows")
        found = str(latex2mathml.tex2mathml(node.astext(), as_block=block))
    except Exception as error:
        LOGGER.warning("formula %r: %s", node.astext(), error, location=node)
        return ""
    # bars are brackets here, of one size and without the space around a relation
    return re.sub(r"<mo[^>]*>[|∣]</mo>", '<mo stretchy="false" lspace="0" rspace="0">|</mo>', found)


def inline(translator: Any, node: nodes.Element) -> None:
    """A formula within a line."""
    translator.body.append(converted(node, block=False))
    raise nodes.SkipNode


def display(translator: Any, node: nodes.Element) -> None:
    """A formula of its own, which may scroll where the screen is narrow."""
    translator.body.append(f'<div class="formula" tabindex="0">{converted(node, block=True)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
