"""A page: a title, what it is about, sections with ids that stay the same, and how to make it again.

The page is one file, made by page.html, a template of Jinja2. It asks nothing of a network, it has no JavaScript (but
that of explore.py), and the same input gives the same bytes. What is text here is escaped by the template; `Html` is
HTML already. Formulas come as LaTeX and become MathML, which browsers show by themselves.
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
from kahanmaps.display.latex import formula
from kahanmaps.display.systems import equations_html
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, printable
from kahanmaps.version import __version__

CHARACTERS = 6_000  # of one formula, about; and of one line of text
_LONGEST_SYSTEM = 200_000
_MAX_EQUATIONS = 40
# Commands with the words that belong to them, and words.
_WORDS = re.compile(r"\\(?:text|mathrm|begin|end)\{[^{}]*\}|\\[A-Za-z]+|[A-Za-z]{2,}")
# Commands of text, for names with such characters, which latex2mathml would print as they stand.
_TEXT_COMMANDS = {
    r"\textbackslash{}": r"\backslash ",
    r"\textasciicircum{}": r"\wedge ",
    r"\textasciitilde{}": r"\sim ",
}


class Html(str):
    """Text that is HTML already: the template does not escape it."""

    __slots__ = ()

    def __html__(self) -> str:
        return self


@dataclass(frozen=True)
class Section:
    """A part of a page: its id, to be linked to, its title, and what stands in it; left out where that is nothing."""

    id: str
    title: str
    conclusion: tuple[str, str] | None = None  # in large letters: a word, a sentence
    paragraphs: Sequence[str] = ()
    items: Sequence[str] = ()  # of a list
    statements: Sequence[tuple[str, str]] = ()  # a word and what it says
    pieces: Sequence[str] = ()
    folded: Sequence[tuple[str, str]] = ()  # what is unfolded by a click, and what is seen then
    claims: Sequence[Mapping[str, Any]] = ()
    explore: Mapping[str, Any] | None = None  # the orbit that moves, of explore.py

    def __bool__(self) -> bool:
        return any(getattr(self, field.name) for field in fields(self)[2:])


def page(
    title: str,
    lead: str,
    sections: Sequence[Section],
    *,
    command: str = "",
    seed: int | None = None,
    file: SystemFile | None = None,
    script: str = "",
) -> str:
    """The whole page; sections that are empty are left out. `script` is the one program that browsers may run.

    `command`, `seed` (None where nothing is drawn at random) and `file` say how it was made.
    """
    remake: list[tuple[str, str]] = [("command", Html(f"<code>{text(command)}</code>"))] if command else []
    remake += [("version", f"kahanmaps {__version__}")]
    remake += [("seed", str(seed))] if seed is not None else []
    html = page_template().render(
        title=title,
        lead=lead,
        sections=[section for section in sections if section],
        remake=remake,
        system_file="" if file is None else Html(markup.escape(markup.shortened(file.to_toml(), _LONGEST_SYSTEM))),
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
    """The font of formulas as a rule of a stylesheet, which nothing has to be fetched for.

    Without a font that has a table for mathematics, browsers do not know where exponents and primes belong.
    """
    font = resources.files("kahanmaps.reports") / "fonts" / "kahanmaps-math.woff"
    code = b64encode(font.read_bytes()).decode("ascii")
    return f'@font-face {{ font-family: "kahanmaps math"; src: url(data:font/woff;base64,{code}) format("woff"); }}'


@cache
def page_template() -> Any:
    """The template of all pages. Raises InputError where the extra [report] is not installed."""
    try:
        import latex2mathml.converter  # noqa: F401 (whether it is there)
        from jinja2 import Environment
    except ImportError as error:
        needed = "a report needs Jinja2 and latex2mathml"
        raise InputError(f"{needed} ({error}): pip install 'kahanmaps[report]'") from error

    def shown(value: Any) -> Any:
        return value if hasattr(value, "__html__") else printable(markup.shortened(value, CHARACTERS))

    environment = Environment(autoescape=True, finalize=shown, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string((resources.files("kahanmaps.reports") / "page.html").read_text(encoding="utf-8"))


@cache
def mathml(latex: str) -> str:
    r"""A formula as MathML, with its LaTeX as `alttext`; as code where it cannot be converted.

    latex2mathml raises for few mistakes: what it gives is parsed, and unknown commands that it leaves are seen.
    """
    from latex2mathml.converter import convert

    # A name of several letters would look like a product: it is set upright, apart from the factors beside it.
    known = _WORDS.sub(lambda word: word[0] if word[0][0] == "\\" else rf"\mathrm{{{word[0]}}}", latex)
    known = re.sub(r"(?<=[\w}]) (?=\\mathrm)|(?<=[A-Za-z]{2}\}) (?=[A-Za-z\\(])", r" \\, ", known)
    for command, other in _TEXT_COMMANDS.items():
        known = known.replace(command, other)
    try:
        text = convert(known)
        is_known = all(re.match(r"\\\w", element.text or "") is None for element in ElementTree.fromstring(text).iter())
    except Exception:  # one of latex2mathml's own, KeyError, IndexError or ParseError
        is_known = False
    if not is_known:
        return f"<code>{markup.escape(latex)}</code>"
    sign = "<mo>&#x0003D;</mo><mo>&#x02212;</mo>"  # a sign behind = is none between terms
    text = text.replace(sign, sign.replace("><mo>&#x02212", '><mo form="prefix">&#x02212'))
    return re.sub("^<math[^>]*>", lambda _: f'<math alttext="{markup.escape(latex)}">', text)


def text(words: object) -> Html:
    """Text as HTML; what is far too long for a page loses its middle."""
    return Html(markup.escape(markup.shortened(words, CHARACTERS)))


def wide(table: str) -> Html:
    """A table that is scrolled by itself where the page is too narrow for it."""
    return Html(f'<div class="wide">{table}</div>')


def system_section(file: SystemFile) -> Section:
    """Equations, parameters and the Hamiltonian of a system."""
    if file.is_quadratic:
        pieces = [Html(f"<p>{equations_html(file.system, CHARACTERS, _MAX_EQUATIONS)}</p>")]
    else:
        pieces = [Html(f"<pre>{text(file.map)}</pre>")]
    if file.parameters:
        values = ", ".join(f"{name} = {format_number(value)}" for name, value in file.parameters.items())
        pieces.append(Html(f"<p>with {text(values)}</p>"))
    if file.hamiltonian is not None:
        kind = "the standard J" if file.hamiltonian.is_standard else "a constant J of the file"
        shown = formula(file.hamiltonian.H, "H", CHARACTERS)
        pieces.append(Html(f"<p>x' = J grad H(x) with {kind}, {shown}</p>"))
    return Section("system", "The system", pieces=pieces)
