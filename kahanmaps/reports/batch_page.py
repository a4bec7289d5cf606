"""The page about a batch: how far each experiment has come, its numbers in tables, and their pictures."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from typing import TYPE_CHECKING

from kahanmaps.display import markup
from kahanmaps.display.experiments import status_table, table_html
from kahanmaps.errors import counted
from kahanmaps.experiments.results.records import Outcome
from kahanmaps.experiments.results.summary import summarise
from kahanmaps.reports.page import Section, page, text, wide
from kahanmaps.reports.pictures import Pictures

if TYPE_CHECKING:
    from kahanmaps.experiments.results.store import Store
    from kahanmaps.plots.recipe import Recipe

_ROWS = 400
_EXCEPTIONS = 100
_KEY = 12  # letters of a key, enough to find its task
_USUAL = ("proved", "supported", None)


def batch_page(
    store: Store, title: str, recipe: Recipe, pictures: Pictures, by: Sequence[str], values: Sequence[str]
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
        Section("status", "Progress", wide(status_table(status))),
        Section("summary", "Summary", tables if done else "<p>There are no results yet.</p>"),
        Section("exceptions", "Exceptional tasks", _exceptions(store)),
        Section("experiments", "The experiments", definitions),
    ]
    return page(title, lead, sections, pictures, recipe)


def _exceptions(store: Store) -> str:
    """The tasks that failed, were refuted or stayed undecided, the first hundred of them; empty where there is none."""
    found = (
        (row.experiment, row.number, row.task, row.record)
        for row in store.rows()
        if row.record is not None and (row.record.outcome != Outcome.OK or row.record.verdict not in _USUAL)
    )
    rows = [
        (
            text(experiment),
            str(number),
            f"<code>{text(task.key[:_KEY])}</code>",
            markup.verdict(record.verdict or record.outcome),
            text(record.message.splitlines()[0] if record.message else ""),
        )
        for experiment, number, task, record in islice(found, _EXCEPTIONS)
    ]
    if not rows:
        return ""
    more = f"<p>… and {rest} more</p>" if (rest := sum(1 for _ in found)) else ""
    about = "<p>What <code>kahanmaps batch show KEY --db FILE</code> tells all about.</p>"
    return about + wide(markup.table(["experiment", "number", "key", "what became of it", "message"], rows)) + more
