"""Formulas as MathML, made when the pages are: browsers show it by themselves, without scripts and without the network.

The converter is the one of docutils, which Sphinx is built on.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)


def for_the_converter(formula: str) -> str:
    r"""Return a LaTeX formula with primes and accents in the form that the converter sets correctly.

    It shows `f'` with an apostrophe, where `f^\prime` gives a prime, and takes the index of `\tilde x_i` for a lower
    limit, unless the accent shares its group with something else.
    """

    def raised(primes: re.Match[str]) -> str:
        marks, group, letter = primes.groups()
        return "^{" + r"\prime" * len(marks) + f" {group or letter or ''}" + "}"

    formula = re.sub(r"('+)(?:\^(?:\{([^{}]*)\}|(\w)))?", raised, formula)
    return re.sub(r"(\\(?:tilde|hat) ?(?:\{(?:[^{}]|\{[^{}]*\})*\}|\\[a-zA-Z]+|\w))_", r"{\1{}}_", formula)


def for_the_font(formula: str) -> str:
    """Return MathML with a space between a function and its argument, and with small slashes, braces and bars."""
    formula = re.sub(
        r"(<mo>&ApplyFunction;</mo>)(?!\s*<mo|\s*<mrow>\s*<mo)", r'\1<mspace width="0.1667em"></mspace>', formula
    )
    formula = formula.replace("\u02c9", "\u00af")  # a bar as an accent: the font has the second one only
    formula = formula.replace('<mo stretchy="false">/</mo>', '<mo stretchy="false" lspace="0" rspace="0">/</mo>')
    return re.sub(r"<mo>([{}])</mo>", r'<mo stretchy="false">\1</mo>', formula)


def mathml(node: nodes.Node, as_block: bool) -> str:
    """The formula of a node; of one that cannot be read its text, with a warning."""
    try:
        return for_the_font(str(tex2mathml(for_the_converter(node.astext()), as_block=as_block)))
    except MathError as error:
        LOGGER.warning("the formula %s cannot be read: %s", node.astext(), error, location=node)
        return str(nodes.literal(text=node.astext()))


def inline_as_mathml(translator: Any, node: nodes.math) -> None:
    """A formula in a line."""
    translator.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def block_as_mathml(translator: Any, node: nodes.math_block) -> None:
    """A displayed formula; a long one is scrolled, not the page."""
    translator.body.append('<div class="math-block" tabindex="0">')
    translator.body.append(mathml(node, as_block=True))
    translator.body.append("</div>\n")
    raise nodes.SkipNode
