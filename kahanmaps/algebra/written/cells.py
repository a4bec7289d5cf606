"""Text in the cells of tables that spreadsheets read, and lines of them."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from io import StringIO

# An integer, p/q or a decimal. The bound on the exponent keeps 1e999999999 from filling the memory of who reads it.
NUMBER = re.compile(r"[+-]?(?:[0-9]+/0*[1-9][0-9]*|(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?)")
# What a spreadsheet would run. An apostrophe in front makes it text; since texts that begin with apostrophes and then
# so get one more, taking one away leads back to what was there.
_FORMULA = re.compile(r"'*[=+\-@\t\r\n]")


def guarded(text: str) -> str:
    """The text, with an apostrophe where a spreadsheet would run it; numbers never get one.

    >>> [guarded(text) for text in ("-3", "-1/2", "=HYPERLINK(1)", "-x", "'-x")]
    ['-3', '-1/2', "'=HYPERLINK(1)", "'-x", "''-x"]
    """
    return "'" + text if _FORMULA.match(text) and not NUMBER.fullmatch(text) else text


def csv_line(cells: Iterable[str]) -> str:
    """A line of a CSV file."""
    # The csv module may quote only those line ends that are in its terminator: with both of them there, no cell can
    # break a line, whatever the version of Python.
    line = StringIO(newline="")
    csv.writer(line, lineterminator="\r\n").writerow(cells)
    return line.getvalue().removesuffix("\r\n") + "\n"
