"""How a page looks (page.css): one column, light or dark as the reader's system is, on paper black on white.

Formulas are set in a font of their own, which is part of the page: without a font that has a table for mathematics,
browsers do not know where exponents and primes belong.
"""

from __future__ import annotations

from base64 import b64encode
from functools import cache
from importlib import resources

FORMULAS = 'math { font-size: 1.18em; font-family: "kahanmaps math", math; }'


@cache
def stylesheet() -> str:
    """The rules of a page, those of page.css."""
    return f"\n{(resources.files('kahanmaps.reports') / 'page.css').read_text(encoding='utf-8')}{FORMULAS}"


@cache
def font_face() -> str:
    """The font of formulas as a rule of a stylesheet, which nothing has to be fetched for."""
    font = resources.files("kahanmaps.reports") / "fonts" / "kahanmaps-math.woff"
    code = b64encode(font.read_bytes()).decode("ascii")
    return f'@font-face {{ font-family: "kahanmaps math"; src: url(data:font/woff;base64,{code}) format("woff"); }}'
