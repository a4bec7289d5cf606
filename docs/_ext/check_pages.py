"""Looks through built pages: every link inside them leads somewhere, and nothing has to be fetched to read them.

python docs/_ext/check_pages.py docs/_build/html
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

VISITED = {"a"}  # what a reader may follow; everything else that has an address is fetched with the page


class Page(HTMLParser):
    """The addresses and the anchors of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[tuple[str, str]] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        """Called for every element."""
        for name, value in attributes:
            if name in ("id", "name") and value:
                self.anchors.add(value)
            elif name in ("href", "src") and value:
                self.addresses.append((tag, value))


def mistakes(folder: Path) -> list[str]:
    """All links of the pages in a folder that lead nowhere, and what would come from the network."""
    folder = folder.resolve()
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.html"))}
    result = [] if pages else [f"{folder} has no pages"]
    for path, page in pages.items():
        for tag, address in page.addresses:
            parts = urlsplit(address)
            link = f"{path.relative_to(folder)}: {address}"
            if parts.scheme or parts.netloc:
                if tag not in VISITED and parts.scheme != "data":
                    result.append(f"{link} has to be fetched")
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                result.append(f"{link} is not there")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                result.append(f"{link} is no place on that page")
    return result


if __name__ == "__main__":
    messages = mistakes(Path(sys.argv[1]))
    print(*messages, sep="\n", end="\n" if messages else "", file=sys.stderr)
    sys.exit(bool(messages))
