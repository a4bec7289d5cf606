"""A page: a title, what it is about, sections with ids that stay the same, and how to make it again.

The page is one file. It asks nothing of a network, it has no JavaScript (but explore_page.py), and the same input gives
the same bytes.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256

from kahanmaps.display import markup
from kahanmaps.display.checks import Room
from kahanmaps.plots.recipe import Recipe
from kahanmaps.reports.pictures import Pictures
from kahanmaps.reports.stylesheet import font_face, stylesheet

CHARACTERS = 6_000  # of one formula, about; and of one line of text
ROOM = Room(CHARACTERS, CHARACTERS, CHARACTERS, 100)  # a reader can check a witness that is whole
_LONGEST_SYSTEM = 200_000


@dataclass(frozen=True)
class Section:
    """A part of a page: its id, to be linked to, its title as text, and its HTML."""

    id: str
    title: str
    html: str


def page(
    title: str,
    lead: str,
    sections: Sequence[Section],
    pictures: Pictures,
    recipe: Recipe,
    seed: int | None = None,
    script: str = "",
) -> str:
    """The whole page. `title` is text, `lead` is HTML; sections that are empty are left out.

    `recipe` and `seed` (None where nothing is drawn at random) say how it was made. Its policy lets browsers load
    nothing and run no script but `script`, which it names by its hash.
    """
    digest = b64encode(sha256(script.encode()).digest()).decode()
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; font-src data:; base-uri 'none'"
    policy += f"; form-action 'none'; script-src '{f'sha256-{digest}' if script else 'none'}'"
    program = f"<script>{script}</script>\n" if script else ""
    note = Section("pictures", "Pictures", f"<p>{text(pictures.note)}</p>" if pictures.note else "")
    present = [section for section in (*sections, note, _remake(recipe, seed)) if section.html]
    links = "".join(f'<li><a href="#{one.id}">{markup.escape(one.title)}</a></li>' for one in present)
    body = "\n".join(
        f'<section aria-labelledby="{one.id}">\n<h2 id="{one.id}">{markup.escape(one.title)}</h2>\n'
        f"{one.html}\n</section>"
        for one in present
    )
    font = font_face() if "<math" in lead + body else ""
    name = markup.escape(title)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<meta http-equiv="Content-Security-Policy" content="{policy}"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<meta name="generator" content="kahanmaps {recipe.version}"/>
<link rel="icon" href="data:,"/>
<title>{name}</title>
<style>{font}{stylesheet()}</style>
</head>
<body>
<header>
<h1>{name}</h1>
<p class="lead">{lead}</p>
</header>
<nav aria-label="Sections"><ul>{links}</ul></nav>
<main>
{body}
</main>
{program}</body>
</html>
"""


def wide(table: str) -> str:
    """A table that is scrolled by itself where the page is too narrow for it."""
    return f'<div class="wide">{table}</div>'


def text(words: object) -> str:
    """Text as HTML; what is far too long for a page loses its middle."""
    return markup.escape(markup.shortened(words, CHARACTERS))


def statements(lines: Sequence[tuple[str, str]]) -> str:
    """Lines of a word, which is HTML, and what it says, which is HTML."""
    if not lines:
        return ""
    rows = (f"<li><span>{word}</span><div>{what}</div></li>" for word, what in lines)
    return "\n".join(['<ul class="statements">', *rows, "</ul>"])


def _remake(recipe: Recipe, seed: int | None) -> Section:
    rows = [("version", f"kahanmaps {markup.escape(recipe.version)}")]
    if recipe.command:
        rows.insert(0, ("command", f"<code>{text(recipe.command)}</code>"))
    if seed is not None:
        rows.append(("seed", str(seed)))
    inside = wide(markup.definitions(rows))
    if recipe.system:
        shown = markup.escape(markup.shortened(recipe.system, _LONGEST_SYSTEM))
        inside += "\n" + markup.details(
            "The system file, to be saved as NAME.toml and given as SYSTEM", f"<pre>{shown}</pre>"
        )
    return Section("remake", "How to make this page again", inside)
