"""HTML elements that notebooks and reports share; the HTML is well-formed XML, and its bytes are reproducible.

The elements set neither background nor font, so that they fit into light and dark pages. Verdicts such as *proved* have
a symbol besides a color, so that they can be distinguished without colors.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from kahanmaps.errors import counted, printable
from kahanmaps.maps.convention import eps_record_suffix

# Verdict -> symbol and color; the color is mixed with that of the text, for a contrast above 4.5 on white and on black.
SYMBOLS = {
    "proved": ("✓", "#1a9f4b"),
    "completed": ("✓", "#1a9f4b"),
    "supported": ("≈", "#0e8fa8"),
    "derived": ("≋", "#0e8fa8"),
    "measured": ("~", "#3f7ae0"),
    "estimated": ("?", "#b8860b"),
    "refuted": ("✗", "#e0353f"),
    "undecided": ("?", "#b8860b"),
}
_ALIGN_LEFT = 'style="text-align: left"'  # Jupyter aligns the cells of a table on the right
_MAX_OPEN_ROWS = 12  # number of rows of a table that are visible before a click on the others
_MAX_CHARACTERS = 60  # maximal number of characters of a number or a name in HTML


def escape(text: object) -> str:
    """Escape a text for HTML; characters that XML forbids, such as control characters, become escapes \\xNN.

    >>> escape('<b title="x">&')
    '&lt;b title=&quot;x&quot;&gt;&amp;'
    >>> escape("a" + chr(0) + chr(27))
    'a\\\\x00\\\\x1b'
    """
    return html.escape(printable(str(text)), quote=True)


def markdown(text: object) -> str:
    """Escape a text for Markdown; the result is on one line.

    >>> markdown("<b>2*x*y|[a](b)</b>")
    '&lt;b>2\\\\*x\\\\*y\\\\|\\\\[a\\\\](b)&lt;/b>'
    """
    escaped = re.sub(r"[\\`*\[\]|]", r"\\\g<0>", " ".join(printable(str(text)).split()))
    return escaped.replace("&", "&amp;").replace("<", "&lt;")


def code(text: object) -> str:
    """Return a text as a code span in Markdown, enclosed in more backticks than occur in it in a row.

    >>> code("x < y"), code("`a`")
    ('`x < y`', '`` `a` ``')
    """
    line = re.sub(r"\s", " ", printable(str(text)))
    fence = "`" * (1 + max(map(len, re.findall("`+", line)), default=0))
    margin = " " if len(fence) > 1 else ""
    return f"{fence}{margin}{line}{margin}{fence}"


def abbreviate(text: object, width: int = _MAX_CHARACTERS) -> str:
    """Return a text of more than `width` characters as its beginning, end and length; it is not escaped.

    >>> abbreviate("1" * 100, 20)
    '11111111…11111111 (100 characters)'
    """
    whole_text = str(text)
    if len(whole_text) <= width:
        return whole_text
    kept_length = max(4, (width - 4) // 2)
    return f"{whole_text[:kept_length]}…{whole_text[-kept_length:]} ({len(whole_text)} characters)"


def eps_phrase(record: Mapping[str, Any]) -> str:
    """Return the eps and the time step of a JSON record as text; long numbers are shortened.

    >>> eps_phrase({"eps": "1/10", "time_step": "1/5"})
    'eps = 1/10 (time step 2 eps = 1/5)'
    """
    step = record["time_step"] and abbreviate(record["time_step"])
    return eps_record_suffix({**record, "eps": abbreviate(record["eps"]), "time_step": step}).removeprefix(", ")


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Return an HTML table; `headings` and `caption` are text, cells are HTML. The last cell of a short row fills it.

    >>> print(table(["n"], [["<b>3</b>"]]))
    <table><thead><tr><th scope="col" style="text-align: left">n</th></tr></thead><tbody>
    <tr><td style="text-align: left"><b>3</b></td></tr>
    </tbody></table>
    """
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    names = "".join(f'<th scope="col" {_ALIGN_LEFT}>{escape(name)}</th>' for name in headings)
    names = f"<thead><tr>{names}</tr></thead>" if names else ""
    body = [list(row) for row in rows]
    width = max(map(len, (headings, *body)))
    lines = []
    for *cells, last in body:
        colspan = f' colspan="{width - len(cells)}"' if len(cells) + 1 < width else ""
        line = "".join(f"<td {_ALIGN_LEFT}>{cell}</td>" for cell in cells)
        lines.append(f"<tr>{line}<td{colspan} {_ALIGN_LEFT}>{last}</td></tr>")
    return "\n".join([f"<table>{title}{names}<tbody>", *lines, "</tbody></table>"])


def folded_table(rows: Sequence[Sequence[str]], head: Sequence[str] = ()) -> str:
    """Return a table in HTML that shows its first 12 rows; a click on the number of other rows shows all.

    >>> folded_table([["a"]]) == table((), [["a"]]), "<summary>3 more lines</summary>" in folded_table([["a"]] * 15)
    (True, True)
    """
    open_rows, more_rows = rows[:_MAX_OPEN_ROWS], rows[_MAX_OPEN_ROWS:]
    if not more_rows:
        return table(head, rows)
    more = f"<details><summary>{counted(len(more_rows), 'more line')}</summary>\n{table(head, more_rows)}\n</details>"
    return f"{table(head, open_rows)}\n{more}"


def definitions(rows: Iterable[tuple[str, str]]) -> str:
    """Return a table of two columns in HTML: in each row a word (text) and its meaning (HTML)."""
    lines = [
        f'<tr><th scope="row" style="text-align: left; vertical-align: top">{escape(word)}</th>'
        f"<td {_ALIGN_LEFT}>{value}</td></tr>"
        for word, value in rows
    ]
    return "\n".join(["<table><tbody>", *lines, "</tbody></table>"])


def bullet_list(entries: Iterable[str]) -> str:
    """Return an HTML list; the entries are HTML."""
    return "\n".join(["<ul>", *(f"<li>{entry}</li>" for entry in entries), "</ul>"])


def verdict(word: object) -> str:
    """Return a verdict such as *proved* in HTML with its symbol and color; any other word has none.

    >>> verdict("note")
    '<span class="verdict">note</span>'
    """
    text = str(word)
    if text not in SYMBOLS:
        return f'<span class="verdict">{escape(text)}</span>'
    mark, color = SYMBOLS[text]
    style = f"color: color-mix(in srgb, currentColor 35%, {color}); white-space: nowrap"
    return f'<span class="verdict {text}" style="{style}"><span aria-hidden="true">{mark}</span> {text}</span>'


def block(title: str, content: str, remark_text: str = "") -> str:
    """Return a block of HTML; its title and the optional remark are text, its content is HTML."""
    remark = f" — {escape(remark_text)}" if remark_text else ""
    return f"<div><p><strong>{escape(title)}</strong>{remark}</p>\n{content}\n</div>"
