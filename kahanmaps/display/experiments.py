"""Databases of results, and summaries of results, as HTML and Markdown."""

from __future__ import annotations

from kahanmaps.display import markup
from kahanmaps.display_protocols import html_form
from kahanmaps.experiments.results.store import Store, StoreError
from kahanmaps.experiments.results.summary import Summary

_MAX_ROWS = 40  # maximal number of rows of a table


@html_form.register
def store_html(store: Store) -> str:
    """Return the progress of each experiment in a database as a table in HTML."""
    try:
        status = store.status()
    except StoreError as error:  # the store is closed
        return markup.block("database of results", f"<p>{markup.escape(error)}</p>")
    rows = [
        (
            markup.escape(markup.abbreviate(experiment.name)),
            str(experiment.tasks),
            str(experiment.missing),
            "<br/>".join(f"{count} {markup.escape(word)}" for word, count in sorted(experiment.outcomes.items())),
            "<br/>".join(f"{count} {markup.verdict(word)}" for word, count in sorted(experiment.verdicts.items())),
        )
        for experiment in status[:_MAX_ROWS]
    ]
    content = markup.table(["experiment", "tasks", "missing", "outcomes", "verdicts"], rows)
    if len(status) > _MAX_ROWS:
        content += f"\n<p>… and {len(status) - _MAX_ROWS} more experiments</p>"
    return markup.block("database of results", content)


@html_form.register
def summary_html(summary: Summary) -> str:
    """Return the tables of a summary of results as HTML."""
    pieces = []
    for table in summary.tables(6):
        rows = [[markup.escape(cell) for cell in row] for row in table.rows[:_MAX_ROWS]]
        pieces.append(markup.table(table.columns, rows, table.title))
        if hidden_count := len(table.rows) - len(rows):
            pieces.append(f"<p>… and {hidden_count} more rows</p>")
    return markup.block("summary", "\n".join(pieces))


def summary_markdown(summary: Summary) -> str:
    """Return the tables of a summary of results in Markdown."""
    tables = []
    for table in summary.tables(6):
        rule = ["---"] * table.words + ["---:"] * (len(table.columns) - table.words)
        rows = (table.columns, rule, *table.rows)
        tables.append("".join("| " + " | ".join(map(markup.markdown, row)) + " |\n" for row in rows))
    return "\n".join(tables)
