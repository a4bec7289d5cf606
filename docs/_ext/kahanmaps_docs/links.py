"""Links between files of the project as links between pages, where the file is a page."""

from __future__ import annotations

import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]

# What lies outside docs/ and has a page in it.
PAGES = {
    "README.md": "docs/index.md",
    "CHANGELOG.md": "docs/changelog.md",
    "CONTRIBUTING.md": "docs/contributing.md",
    "examples": "docs/examples.md",
    "examples/dysts": "docs/dysts.md",
    "examples/dysts/README.md": "docs/dysts.md",
    "examples/dysts/results.md": "docs/dysts-results.md",
    "examples/mass_action": "docs/mass-action.md",
    "examples/mass_action/README.md": "docs/mass-action.md",
    "examples/mass_action/results.md": "docs/mass-action-results.md",
    "examples/members": "docs/study.md",
    "examples/members/README.md": "docs/study.md",
    "examples/members/results.md": "docs/study-results.md",
}
LINK = re.compile(r"(?<!`)(\[[^\]\[]*\]\()([^)\s#:]+)(#[^)\s]*)?(\))")
_CODE = re.compile(r"(^```.*?^```[ ]*$|``.+?``|`[^`\n]+`(?!\]))", re.MULTILINE | re.DOTALL)


def outside_code(text: str) -> list[tuple[bool, str]]:
    """The text in pieces, each with whether it is text (and not code)."""
    return [(k % 2 == 0, piece) for k, piece in enumerate(_CODE.split(text))]


def with_links_for(page: Path, origin: Path, text: str) -> str:
    """The Markdown of the file `origin`, its local links as they have to be in `page`."""

    def moved(match: re.Match[str]) -> str:
        target = (origin.parent / match[2]).resolve()
        if not target.is_relative_to(ROOT):
            raise ValueError(f"{origin}: the link {match[2]} leads out of the project")
        name = str(target.relative_to(ROOT))
        there = ROOT / PAGES.get(name.rstrip("/"), name)
        return match[1] + os.path.relpath(there, page.parent) + (match[3] or "") + match[4]

    return "".join(LINK.sub(moved, piece) if is_text else piece for is_text, piece in outside_code(text))
