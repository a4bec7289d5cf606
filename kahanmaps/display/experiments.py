"""How a database of results and its summary look in a notebook."""

from __future__ import annotations

from collections.abc import Sequence

from kahanmaps.display import markup
from kahanmaps.displayed import html_form
from kahanmaps.experiments.results.store import ExperimentStatus, Store, StoreError
from kahanmaps.experiments.results.summary import Summary, Table

_ROWS = 40


@html_form.register
def store_html(store: Store) -> str:
    """How far each experiment has come."""
    try:
        status = store.status()
    except StoreError as error:  # closed
        return markup.titled("database of results", f"<p>{markup.escape(error)}</p>")
    inside = status_table(status[:_ROWS])
    if len(status) > _ROWS:
        inside += f"\n<p>… and {len(status) - _ROWS} more experiments</p>"
    return markup.titled("database of results", inside)


def status_table(status: Sequence[ExperimentStatus]) -> str:
    """A row for each experiment: its tasks, and what became of them."""
    rows = [
        (
            markup.escape(markup.shortened(one.name)),
            str(one.tasks),
            str(one.missing),
            "<br/>".join(f"{count} {markup.escape(word)}" for word, count in sorted(one.outcomes.items())),
            "<br/>".join(f"{count} {markup.verdict(word)}" for word, count in sorted(one.verdicts.items())),
        )
        for one in status
    ]
    return markup.table(["experiment", "tasks", "missing", "outcomes", "verdicts"], rows)


@html_form.register
def summary_html(summary: Summary) -> str:
    """The tables of a summary."""
    return markup.titled("summary", "\n".join(table_html(table, _ROWS) for table in summary.tables(6)))


def table_html(table: Table, most: int | None = None) -> str:
    """One table of a summary, at most so many of its rows."""
    rows = [[markup.escape(cell) for cell in row] for row in table.rows[:most]]
    more = len(table.rows) - len(rows)
    return markup.table(table.columns, rows, table.title) + (f"\n<p>… and {more} more rows</p>" if more else "")


def summary_markdown(summary: Summary) -> str:
    """A summary as tables for a Markdown file."""
    return "\n".join(table_markdown(table) for table in summary.tables(6))


def table_markdown(table: Table) -> str:
    """One table for a Markdown file."""
    rule = ["---"] * table.words + ["---:"] * (len(table.columns) - table.words)
    rows = (table.columns, rule, *table.rows)
    return "".join("| " + " | ".join(map(markup.markdown, row)) + " |\n" for row in rows)
