"""What was found as one HTML page: formulas, verdicts, pictures, and how to do it again."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import Any

from kahanmaps.checks.claims import Report
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError
from kahanmaps.experiments.results.store import Store
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.plots.recipe import Recipe
from kahanmaps.reports.analysis_page import analysis_page
from kahanmaps.reports.batch_page import batch_page
from kahanmaps.reports.claims_page import claims_page
from kahanmaps.reports.explore_page import explore_page
from kahanmaps.reports.pictures import Pictures
from kahanmaps.whole_files import write_whole


def report_html(
    found: Analysis | Report | Sequence[Report] | Store,
    *,
    file: SystemFile | None = None,
    title: str | None = None,
    pictures: bool = True,
    command: str = "",
    left_out: Sequence[str] = (),
    by: Sequence[str] = (),
    values: Sequence[str] = (),
    explore: bool = False,
    until: float = inf,
) -> str:
    """A page about what was found: one HTML text that needs no network, and no JavaScript unless it is to `explore`.

    Args:
        found: an `Analysis`, the `Report` of `verify` or of a check, several of checks of one system, or a `Store`.
        file: the system that reports are about, for its equations and pictures; an Analysis brings its own.
        title: the title (default: the name of the system).
        pictures: whether to draw; without matplotlib the page says that there are none, and how to get them.
        command: the command line that makes the page, to be told in it.
        left_out: sentences on what does not apply, to be told as notes.
        by: for a Store, the names to group its results by (default: the experiment).
        values: for a Store, the numbers to summarise, with a picture of their distributions (default: all, without).
        explore: for an Analysis, a page on which eps and the start of an orbit are moved by sliders.
        until: no picture is begun after this value of time.monotonic(); the page says so.

    Returns:
        The page, the same text for the same input (and the same version of matplotlib). Formulas are exact; those of
        more than about 6000 characters are cut, and say so.

    Raises:
        InputError: for something else, no reports, and names that no result of a Store has.

    >>> from kahanmaps.checks.conserve import check_integrals
    >>> from kahanmaps.documents.catalog import load
    >>> top = load("euler_top")
    >>> text = report_html(check_integrals(top), file=top, pictures=False)
    >>> text[:15], text.count("</details>")
    ('<!DOCTYPE html>', 3)
    """
    drawn = Pictures(pictures, until)
    title = (title or "").strip()
    if explore:
        if not isinstance(found, Analysis):
            raise InputError(f"found {type(found).__name__}, expected an Analysis: it is what can be explored")
        return explore_page(found, title or _title(found.file), Recipe(command, found.file.to_toml()))
    if isinstance(found, Analysis):
        return analysis_page(found, title or _title(found.file), Recipe(command, found.file.to_toml()), drawn)
    if isinstance(found, Store):
        return batch_page(found, title or "A batch", Recipe(command), drawn, by, values)
    reports = list(found) if isinstance(found, Sequence) else [found]
    if not reports or not all(isinstance(report, Report) for report in reports):
        kinds = ", ".join(sorted({type(report).__name__ for report in reports})) or "nothing"
        raise InputError(f"found {kinds}, expected an Analysis, a Report, several of them, or a Store")
    recipe = Recipe(command, "" if file is None else file.to_toml())
    name = str(reports[0].context.get("system", "")) if file is None else _title(file)
    what = "The paper, statement by statement" if reports[0].check == "verify" else "Checks"
    return claims_page(reports, title or f"{what}: {name}", recipe, drawn, file, left_out)


def write_report(path: str | Path, found: Any, **options: Any) -> None:
    """Write the page of `report_html` to a file, whole or not at all; the options are those of `report_html`."""
    write_whole(Path(path), report_html(found, **options).encode())


def _title(file: SystemFile) -> str:
    """What the catalogue calls it; equations from the command line have no name and stand for themselves, if short."""
    return str(file.catalog.get("title", "")) or file.label
