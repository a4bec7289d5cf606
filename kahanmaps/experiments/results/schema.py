"""The tables of a database of results, and by what its file is known."""

from __future__ import annotations

# A change that older versions cannot read counts it up. Format 2 is this one with two more columns, which nobody reads.
FORMATS = (1, 2)
APPLICATION_ID = 0x4B61684D  # "KahM": by this a file is known to be ours

SKIPPED = """CREATE TABLE IF NOT EXISTS skipped (
    experiment INTEGER NOT NULL, system TEXT NOT NULL, reason TEXT NOT NULL, PRIMARY KEY (experiment, system)
) WITHOUT ROWID"""
SCHEMA = f"""
CREATE TABLE document (digest TEXT PRIMARY KEY NOT NULL, text TEXT NOT NULL);
CREATE TABLE task (id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, text TEXT NOT NULL);
-- id: also the place among the experiments
CREATE TABLE experiment (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, definition TEXT NOT NULL, digest TEXT NOT NULL,
    limits TEXT NOT NULL, total INTEGER NOT NULL, tasks INTEGER NOT NULL
);
-- number: from 0 without gaps. The same task may be planned twice.
CREATE TABLE plan (
    experiment INTEGER NOT NULL, number INTEGER NOT NULL, task INTEGER NOT NULL, PRIMARY KEY (experiment, number)
) WITHOUT ROWID;
-- Systems of an experiment that could not be used when it was planned. Databases of earlier versions lack the table.
{SKIPPED};
CREATE INDEX plan_of_task ON plan (task, experiment, number);
CREATE TABLE result (
    task INTEGER PRIMARY KEY, outcome TEXT NOT NULL, verdict TEXT, seconds REAL NOT NULL, attempts INTEGER NOT NULL,
    peak_memory INTEGER, host TEXT NOT NULL, finished TEXT NOT NULL, versions TEXT NOT NULL, message TEXT NOT NULL,
    stderr TEXT NOT NULL, result TEXT
);
-- Whatever is only counted is read from here: the pages of the table itself are full of results.
CREATE INDEX result_summary ON result (task, outcome, verdict, seconds);
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = 1;
"""
