"""The few pieces of HTML that notebooks and the report share; well-formed XML, always the same bytes.

Nothing here sets a background or a font: what is shown takes the colours of the page around it, light or dark. Words
such as *proved* carry a mark beside their colour, so that they can be told apart without seeing the colour.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from kahanmaps.errors import printable
from kahanmaps.maps.convention import eps_words

# A mark, and a colour to be mixed with that of the text: with a contrast above 4.5 : 1 on white and on near black.
WORDS = {
    "proved": ("✓", "#1a9f4b"),
    "completed": ("✓", "#1a9f4b"),
    "supported": ("≈", "#0e8fa8"),
    "derived": ("≋", "#0e8fa8"),
    "measured": ("~", "#3f7ae0"),
    "estimated": ("?", "#b8860b"),
    "refuted": ("✗", "#e0353f"),
    "undecided": ("?", "#b8860b"),
}
_LEFT = 'style="text-align: left"'  # Jupyter sets tables as if they were all numbers
_SHORTENED = 60  # characters of a number or a name


def escape(text: object) -> str:
    """Text as HTML that shows it and nothing else; what XML does not allow, control characters above all, is spelt out.

    >>> escape('<b title="x">&')
    '&lt;b title=&quot;x&quot;&gt;&amp;'
    >>> escape("a" + chr(0) + chr(27))
    'a\\\\x00\\\\x1b'
    """
    return html.escape(printable(str(text)), quote=True)


def markdown(text: object) -> str:
    """Text as Markdown that shows it and nothing else, on one line.

    >>> markdown("<b>2*x*y|[a](b)</b>")
    '&lt;b>2\\\\*x\\\\*y\\\\|\\\\[a\\\\](b)&lt;/b>'
    """
    marked = re.sub(r"[\\`*\[\]|]", r"\\\g<0>", " ".join(printable(str(text)).split()))
    return marked.replace("&", "&amp;").replace("<", "&lt;")


def code(text: object) -> str:
    """Text as a span of code in Markdown, fenced by more backticks than it has in a row.

    >>> code("x < y"), code("`a`")
    ('`x < y`', '`` `a` ``')
    """
    line = re.sub(r"\s", " ", printable(str(text)))
    fence = "`" * (1 + max(map(len, re.findall("`+", line)), default=0))
    margin = " " if len(fence) > 1 else ""
    return f"{fence}{margin}{line}{margin}{fence}"


def shortened(text: object, width: int = _SHORTENED) -> str:
    """The text with its middle left out where it is longer than `width`, and its length told; not yet escaped.

    >>> shortened("1" * 100, 20)
    '11111111…11111111 (100 characters)'
    """
    whole = str(text)
    if len(whole) <= width:
        return whole
    keep = max(4, (width - 4) // 2)
    return f"{whole[:keep]}…{whole[-keep:]} ({len(whole)} characters)"


def eps_phrase(record: Mapping[str, Any]) -> str:
    """For which eps a record speaks, with the time step, as text with short numbers.

    >>> eps_phrase({"eps": "1/10", "time_step": "1/5"})
    'eps = 1/10 (time step 2 eps = 1/5)'
    """
    step = record["time_step"] and shortened(record["time_step"])
    return eps_words({**record, "eps": shortened(record["eps"]), "time_step": step}).removeprefix(", ")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """A table. `head` and `caption` are text, the cells of `rows` are HTML already; the last of a short row is wide.

    >>> print(table(["n"], [["<b>3</b>"]]))
    <table><thead><tr><th scope="col" style="text-align: left">n</th></tr></thead><tbody>
    <tr><td style="text-align: left"><b>3</b></td></tr>
    </tbody></table>
    """
    above = f"<caption>{escape(caption)}</caption>" if caption else ""
    names = "".join(f'<th scope="col" {_LEFT}>{escape(name)}</th>' for name in head)
    names = f"<thead><tr>{names}</tr></thead>" if names else ""
    held = [list(row) for row in rows]
    width = max(map(len, (head, *held)))
    lines = []
    for *cells, last in held:
        wide = f' colspan="{width - len(cells)}"' if len(cells) + 1 < width else ""
        line = "".join(f"<td {_LEFT}>{cell}</td>" for cell in cells)
        lines.append(f"<tr>{line}<td{wide} {_LEFT}>{last}</td></tr>")
    return "\n".join([f"<table>{above}{names}<tbody>", *lines, "</tbody></table>"])


def definitions(rows: Iterable[tuple[str, str]]) -> str:
    """A table of two columns: a word, which is text, and what it stands for, which is HTML already."""
    lines = [
        f'<tr><th scope="row" style="text-align: left; vertical-align: top">{escape(word)}</th>'
        f"<td {_LEFT}>{what}</td></tr>"
        for word, what in rows
    ]
    return "\n".join(["<table><tbody>", *lines, "</tbody></table>"])


def listed(entries: Iterable[str]) -> str:
    """A list whose entries are HTML already."""
    return "\n".join(["<ul>", *(f"<li>{entry}</li>" for entry in entries), "</ul>"])


def verdict(word: object) -> str:
    """A word such as *proved*, with its mark and its colour; other words as they are.

    >>> verdict("note")
    '<span class="verdict">note</span>'
    """
    text = str(word)
    if text not in WORDS:
        return f'<span class="verdict">{escape(text)}</span>'
    mark, colour = WORDS[text]
    style = f"color: color-mix(in srgb, currentColor 35%, {colour}); white-space: nowrap"
    return f'<span class="verdict {text}" style="{style}"><span aria-hidden="true">{mark}</span> {text}</span>'


def titled(title: str, inside: str, more: str = "") -> str:
    """A piece of a notebook: a title, which is text, perhaps with more beside it, and HTML below."""
    beside = f" — {escape(more)}" if more else ""
    return f"<div><p><strong>{escape(title)}</strong>{beside}</p>\n{inside}\n</div>"
