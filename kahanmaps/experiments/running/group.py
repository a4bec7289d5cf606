"""A group of jobs done by one command, for engines that run commands: JSON in, records out.

    python -m kahanmaps.experiments.running.group < group.json

The input is {"documents": {DIGEST: TEXT, ...}, "jobs": [{"task": TEXT, "limits": {"time": S, "memory": BYTES}}, ...]};
for every job there comes one line, the record, as soon as it is there. A job whose child is killed from outside is lost
at once: whoever has sent it tries it again, elsewhere maybe. The exit status is 0 whatever the tasks did.
"""

from __future__ import annotations

import json
import os
import select
import sys
from typing import IO

from kahanmaps.experiments.results.records import Job, Limits, Task, canonical
from kahanmaps.experiments.running.children import LocalChildren
from kahanmaps.processes import end_with_parent


def main(source: IO[str], target: IO[str]) -> None:
    """Do the jobs that `source` describes, one after the other."""
    group = json.load(source)
    jobs = [Job(Task.from_text(job["task"]), Limits(**job["limits"])) for job in group["jobs"]]
    children = LocalChildren(1, group["documents"].__getitem__, tries=1)
    try:
        for job in jobs:
            children.submit(job)
            while children.in_flight:
                for record in children.wait(60.0):
                    target.write(canonical(record.to_json()) + "\n")
                    target.flush()
    finally:
        children.close()


def _require_reader(stream: IO[str]) -> None:
    """End if nobody reads: the parent died before it could be known who that is."""
    if hasattr(select, "poll"):
        poll = select.poll()
        poll.register(stream.fileno(), 0)
        if any(events & select.POLLERR for _, events in poll.poll(0)):
            os._exit(1)


if __name__ == "__main__":
    end_with_parent(os.getppid())
    _require_reader(sys.stdout)
    main(sys.stdin, sys.stdout)
