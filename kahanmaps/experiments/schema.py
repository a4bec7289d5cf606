"""The tables of a database of results, and by what its file is known."""

from __future__ import annotations

FORMAT = 2  # of the tables below; a change that older versions cannot read counts it up. Format 1 is read, too.
APPLICATION_ID = 0x4B61684D  # "KahM": by this a file is known to be ours

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

# Format 2. A new file is made in format 1 and upgraded, so that there is one way to it, and one text of the tables.
UPGRADE = """
-- Of the other columns of the row, and of the key of the task: what is read is what was written. The texts of tasks,
-- documents and definitions have digests already, and plans and indexes say the same twice, which SQLite compares.
ALTER TABLE experiment ADD COLUMN checksum INTEGER;
ALTER TABLE result ADD COLUMN checksum INTEGER;
PRAGMA user_version = 2;
"""
