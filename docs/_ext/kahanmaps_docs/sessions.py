"""Sessions at the prompt: lines after `$ ` are commands, all else is what they print, also where it opens with #."""

from __future__ import annotations

from pygments.lexer import RegexLexer, bygroups
from pygments.token import Generic, Text


class ConsoleLexer(RegexLexer):
    """Colours for the ```console blocks of the pages."""

    name = "console"
    aliases = ("console",)
    tokens = {  # noqa: RUF012 (so Pygments wants it)
        "root": [
            (r"^(\$ )(.*\n)", bygroups(Generic.Prompt, Generic.Strong)),
            (r".*\n", Text),
        ]
    }
