"""The page about a batch: how far each experiment has come, its numbers in tables, and their pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from kahanmaps.display import markup
from kahanmaps.display.experiments import status_table, table_html
from kahanmaps.errors import counted
from kahanmaps.experiments.summary import summarise
from kahanmaps.reports.page import Origin, Section, page, text, wide
from kahanmaps.reports.pictures import Pictures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kahanmaps.experiments.store import Store
    from kahanmaps.experiments.summary import Summary
    from kahanmaps.plots.style import Style

_ROWS = 400


def batch_page(
    store: Store, title: str, origin: Origin, pictures: Pictures, by: Sequence[str], values: Sequence[str]
) -> str:
    """The page about all experiments of a database; `by` and `values` are those of `summarise`.

    What depends on the machine, times above all, is left out.
    """
    status = store.status()
    summary = summarise(store.rows(missing=True), list(by) or ["experiment"], list(values) or None, stable=True)
    tables = "\n".join(wide(table_html(table, _ROWS)) for table in summary.tables(6))
    definitions = "\n".join(
        f"<h3>{text(one.name)}</h3>\n{markup.details('Definition', f'<pre>{text(one.definition)}</pre>')}"
        for one in store.experiments()
    )
    done = sum(sum(one.outcomes.values()) for one in status)
    every = sum(one.tasks for one in status)
    lead = f"{counted(len(status), 'experiment')}, {done} of {every} tasks done"
    sections = [
        Section("status", "How far it has come", f"{wide(status_table(status))}\n{_counts_figure(summary, pictures)}"),
        Section("summary", "Summary", tables if done else "<p>There are no results yet.</p>"),
        Section("distributions", "Distributions", _distributions(summary, values, pictures)),
        Section("experiments", "The experiments", definitions),
        Section("pictures", "Pictures", f"<p>{text(pictures.note)}</p>" if pictures.note else ""),
    ]
    return page(title, lead, sections, origin)


def _counts_figure(summary: Summary, pictures: Pictures) -> str:
    """What became of the tasks of each group."""
    if not summary.groups:
        return ""

    def drawing(style: Style) -> Figure:
        from kahanmaps.plots.batch import draw_batch

        return draw_batch(summary, (), style)

    caption = f"What became of the tasks, by {', '.join(summary.by)}."
    return pictures.draw("counts", caption, f"{caption} The tables have the numbers.", drawing)


def _distributions(summary: Summary, values: Sequence[str], pictures: Pictures) -> str:
    """The distribution of the numbers that were asked for, in each group."""
    if not values:
        return ""

    def drawing(style: Style) -> Figure:
        from kahanmaps.plots.batch import draw_batch

        return draw_batch(summary, values, style)

    caption = f"Distribution of {', '.join(values)} by {', '.join(summary.by)}."
    return pictures.draw("distributions-figure", caption, f"{caption} The table above has the quantiles.", drawing)
