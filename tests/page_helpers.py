"""A page as its reader sees it: parsed, with its text, headings, links and what it would fetch."""

import re
from dataclasses import dataclass, field
from html import unescape
from html.parser import HTMLParser
from importlib import resources
from itertools import pairwise
from unicodedata import decomposition
from xml.etree import ElementTree

from fontTools.ttLib import TTFont

_VOID = {"meta", "link", "br", "img", "hr", "input"}
_FETCHING = {"src", "srcset", "data", "poster", "background"}


@dataclass
class Page(HTMLParser):
    """An HTML page. Raises AssertionError where elements are not closed in order."""

    html: str
    ids: list[str] = field(default_factory=list)
    headings: list[tuple[int, str]] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    fetched: list[str] = field(default_factory=list)
    alttexts: list[str | None] = field(default_factory=list)
    tags: list[str] = field(default_factory=list)
    text: str = ""
    lang: str | None = None

    def __post_init__(self):
        super().__init__(convert_charrefs=True)
        self._open: list[str] = []
        self.feed(self.html)
        self.close()
        assert not self._open, f"not closed: {self._open}"

    def handle_starttag(self, tag, attrs):
        self.handle_startendtag(tag, attrs)
        if tag not in _VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag, attrs):
        results = dict(attrs)
        self.tags.append(tag)
        self.ids += [results["id"]] if "id" in results else []
        if tag == "html":
            self.lang = results.get("lang")
        if tag == "a":
            self.links.append(results.get("href", ""))
        else:
            self.fetched += [results[name] for name in ("href", "xlink:href") if name in results]
        self.fetched += [results[name] for name in _FETCHING if name in results]
        self.fetched += [name for name in results if name.startswith("on")]
        if tag == "math":
            self.alttexts.append(results.get("alttext"))
        if tag in ("h1", "h2", "h3", "h4"):
            self.headings.append((int(tag[1]), ""))

    def handle_endtag(self, tag):
        assert self._open, f"</{tag}> without a beginning"
        assert self._open.pop() == tag

    def handle_data(self, data):
        if "style" in self._open:
            assert "@import" not in data
            assert not re.search(r"url\((?!#|data:)", data)
            return
        self.text += data
        if self._open and self._open[-1] in ("h1", "h2", "h3", "h4"):
            level, before = self.headings[-1]
            self.headings[-1] = (level, before + data)


def require_sound(html: str) -> Page:
    """What every page has to be; returns it."""
    page = Page(html)
    ElementTree.fromstring(html)  # XML, which browsers need not mend
    assert html.startswith("<!DOCTYPE html>")
    assert page.lang == "en"
    assert "script" not in page.tags
    # Inside the page, or data in it: nothing is asked of a network.
    assert [entry for entry in page.fetched if not entry.startswith(("#", "data:"))] == []
    assert [link for link in page.links if link.removeprefix("#") not in page.ids] == []
    assert len(page.ids) == len(set(page.ids)), "an id twice"
    assert [level for level, _ in page.headings].count(1) == 1
    levels = [level for level, _ in page.headings]
    assert all(later <= earlier + 1 for earlier, later in pairwise(levels)), "a level left out"
    assert all(page.alttexts), "a formula without its text"
    return page


# What a browser shows for a name of one letter: "<font> 0061" is how Unicode writes the italic a.
ITALICS = {
    chr(int(decomposition(chr(code)).split()[1], 16)): chr(code)
    for code in [0x210E, *range(0x1D434, 0x1D468), *range(0x1D6E2, 0x1D71C)]
    if decomposition(chr(code))
}


def letters_of_formulas(html):
    """The letters of the formulas of a page, as they are shown; a name of one letter is shown in italics."""
    formulas = "".join(re.findall("<math.*?</math>", html, re.DOTALL))
    single = {ITALICS.get(letter, letter) for letter in re.findall("<mi>(.)</mi>", formulas)}
    return set(unescape(re.sub("<[^>]*>|\\s", "", formulas))) | single


def letters_of_the_font():
    """The letters that the font of formulas has."""
    with (resources.files("kahanmaps.reports") / "fonts" / "kahanmaps-math.woff").open("rb") as file:
        return set(map(chr, TTFont(file).getBestCmap()))
