"""HTML pages: a title, a lead, sections with stable ids, and instructions on how to reproduce the page.

A page is a single file, made from page.html, a template of Jinja2. It needs no network, and JavaScript only for
explore.py; equal input gives equal bytes. The template escapes text, but not `Html`. Formulas are converted from LaTeX
to MathML.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from hashlib import sha256
from html import unescape
from importlib import resources
from typing import Any
from xml.etree import ElementTree

from kahanmaps.algebra.printing import format_number
from kahanmaps.display import markup
from kahanmaps.display.latex import formula, typeset
from kahanmaps.display.systems import equations_html
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, printable
from kahanmaps.version import __version__

CHARACTERS = 6_000  # maximal number of characters of a line of text, and approximately of a formula
_MAX_SYSTEM = 200_000  # maximal number of characters of a system file on a page
_MAX_EQUATIONS = 40  # maximal number of equations of a system on a page
# Matches LaTeX commands with their arguments, and words of at least two letters.
_COMMANDS_AND_WORDS = re.compile(r"\\(?:text|mathrm|begin|end)\{[^{}]*\}|\\[A-Za-z]+|[A-Za-z]{2,}")
# LaTeX commands in names with special characters -> the characters; latex2mathml prints these commands literally.
_TEXT_COMMANDS = {
    r"\textbackslash{}": r"\backslash ",
    r"\textasciicircum{}": r"\wedge ",
    r"\textasciitilde{}": r"\sim ",
}


class Html(str):
    """A text in HTML, which the template does not escape."""

    __slots__ = ()

    def __html__(self) -> str:
        return self


@dataclass(frozen=True)
class PageSection:
    """A section of a page: an id, a title, and content of several kinds; a section without content is omitted."""

    id: str
    title: str
    conclusion: tuple[str, str] | None = None  # (verdict, sentence), printed in large letters
    paragraphs: Sequence[str] = ()
    items: Sequence[str] = ()  # entries of a list
    statements: Sequence[tuple[str, str]] = ()  # pairs of a status and a sentence
    pieces: Sequence[str] = ()
    folded: Sequence[tuple[str, str]] = ()  # pairs of a summary and the content that a click on it unfolds
    claims: Sequence[Mapping[str, Any]] = ()
    explore: Mapping[str, Any] | None = None  # data of the interactive orbit, see explore.py

    def __bool__(self) -> bool:
        return any(getattr(self, field.name) for field in fields(self)[2:])


def page(
    title: str,
    lead: str,
    sections: Sequence[PageSection],
    *,
    command: str = "",
    seed: int | None = None,
    file: SystemFile | None = None,
    script: str = "",
) -> str:
    """Return a page as HTML; empty sections are omitted. `script` is the only JavaScript that the browser may run.

    `command`, `seed` (None if nothing is random) and `file` are part of the instructions on how to reproduce the page.
    """
    remake: list[tuple[str, str]] = [("command", Html(f"<code>{text(command)}</code>"))] if command else []
    remake += [("version", f"kahanmaps {__version__}")]
    remake += [("seed", str(seed))] if seed is not None else []
    html = page_template().render(
        title=title,
        lead=lead,
        sections=[section for section in sections if section],
        remake=remake,
        system_file="" if file is None else Html(markup.escape(markup.abbreviate(file.to_toml(), _MAX_SYSTEM))),
        script=Html(script),
        script_hash=f"sha256-{b64encode(sha256(script.encode()).digest()).decode()}" if script else "",
        version=__version__,
        font=Html(font_face()),
    )

    def with_mathml(span: re.Match[str]) -> str:
        return re.sub(r"\\\((.*?)\\\)", lambda piece: mathml(unescape(piece[1])), span[0])

    return re.sub(r'<span class="formula">.*?</span>', with_mathml, html)


@cache
def font_face() -> str:
    """Return a CSS rule that embeds the font of formulas.

    A browser needs a font with a MATH table in order to place exponents and primes.
    """
    font = resources.files("kahanmaps.reports") / "fonts" / "kahanmaps-math.woff"
    code = b64encode(font.read_bytes()).decode("ascii")
    return f'@font-face {{ font-family: "kahanmaps math"; src: url(data:font/woff;base64,{code}) format("woff"); }}'


@cache
def page_template() -> Any:
    """Return the Jinja2 template of all pages. Raises InputError if the packages of the extra [report] are missing."""
    try:
        import latex2mathml.converter  # noqa: F401 (only to test whether it is installed)
        from jinja2 import Environment
    except ImportError as error:
        needed = "a report needs Jinja2 and latex2mathml"
        raise InputError(f"{needed} ({error}): pip install 'kahanmaps[report]'") from error

    def printable_value(value: Any) -> Any:
        return value if hasattr(value, "__html__") else printable(markup.abbreviate(value, CHARACTERS))

    environment = Environment(autoescape=True, finalize=printable_value, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string((resources.files("kahanmaps.reports") / "page.html").read_text(encoding="utf-8"))


@cache
def mathml(latex: str) -> str:
    r"""Convert LaTeX to MathML, with the LaTeX as `alttext`; if this fails, return the LaTeX as code.

    latex2mathml rarely raises an error for invalid input, so its output is parsed and searched for unknown commands.
    """
    from latex2mathml.converter import convert

    # A name of several letters would look like a product, so it is set upright, with spaces around it.
    source = _COMMANDS_AND_WORDS.sub(lambda word: word[0] if word[0][0] == "\\" else rf"\mathrm{{{word[0]}}}", latex)
    source = re.sub(r"(?<=[\w}]) (?=\\mathrm)|(?<=[A-Za-z]{2}\}) (?=[A-Za-z\\(])", r" \\, ", source)
    for command, replacement in _TEXT_COMMANDS.items():
        source = source.replace(command, replacement)
    try:
        text = convert(source)
        is_known = all(re.match(r"\\\w", element.text or "") is None for element in ElementTree.fromstring(text).iter())
    except Exception:  # of latex2mathml: its own, KeyError or IndexError; of the parser: ParseError
        is_known = False
    if not is_known:
        return f"<code>{markup.escape(latex)}</code>"
    sign = "<mo>&#x0003D;</mo><mo>&#x02212;</mo>"  # after = the minus sign is a prefix, not a binary operator
    text = text.replace(sign, sign.replace("><mo>&#x02212", '><mo form="prefix">&#x02212'))
    return re.sub("^<math[^>]*>", lambda _: f'<math alttext="{markup.escape(latex)}">', text)


def text(words: object) -> Html:
    """Return a text as HTML; it is shortened if it is too long for a page."""
    return Html(markup.escape(markup.abbreviate(words, CHARACTERS)))


def wide(table: str) -> Html:
    """Return a table that readers can scroll horizontally on a narrow page."""
    return Html(f'<div class="wide">{table}</div>')


def system_section(file: SystemFile) -> PageSection:
    """Return the section of a page with the equations, parameters and Hamiltonian of a system."""
    if file.is_quadratic:
        pieces = [Html(f"<p>{equations_html(file.system, CHARACTERS, _MAX_EQUATIONS)}</p>")]
    else:
        pieces = [Html(f"<pre>{text(file.map)}</pre>")]
    if file.parameters:
        values = ", ".join(f"{name} = {format_number(value)}" for name, value in file.parameters.items())
        pieces.append(Html(f"<p>with {text(values)}</p>"))
    if file.hamiltonian is not None:
        kind = "the standard J" if file.hamiltonian.is_standard else "a constant J of the file"
        H_html = formula(file.hamiltonian.H, "H", CHARACTERS)
        flow = typeset(r"\dot{x} = J \nabla H", False)
        pieces.append(Html(f"<p>{flow} with {kind}, {H_html}</p>"))
    return PageSection("system", "The system", pieces=pieces)
