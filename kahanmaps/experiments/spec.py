"""The spec of a batch in TOML: each experiment is a task for many systems and many values of its options.

    [experiments.commute]
    task = "check-commute"
    system = "family"                        # or a name of the catalogue, a path, or a list of these
    options = { draw = "generic" }           # equal for all tasks
    zip = [["m", "steps"]]                   # axes that vary together; all other axes are combined

    [experiments.commute.axes]               # one value, a list, a range, or a list with ranges in it
    m = "2..5"
    steps = [20, 15, 10, 5]
    seed = "0..9999"
    eps = ["1/10", "0.05", "1/3..2/3 step 1/6"]

    [experiments.commute.limits]             # of one task; a top-level table [limits] is for all experiments
    time = "60 s"
    memory = "1 GB"
    digits = 20000

All mistakes in a spec are reported together, each with its key. The file docs/batch.md lists all keys, and the module
experiment.py reads the table of an experiment.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from kahanmaps.documents.toml_text import TomlKind
from kahanmaps.errors import SystemFileError, reading
from kahanmaps.experiments.experiment import Experiment, ExperimentReader, SpecDocument

MAX_BYTES = 4_000_000  # maximal size of a spec file
MAX_TASKS = 1_000_000  # maximal number of tasks in all experiments of a spec, unless the caller allows more
EXPERIMENT_NAME = r"[A-Za-z0-9_.+-]{1,80}"
_MAX_LISTED = 3  # maximal number of experiments that a message names


class SpecError(SystemFileError):
    """Raised for a spec with mistakes; the message lists all of them, each with its key."""


_TOML = TomlKind("spec", MAX_BYTES, SpecError)


@dataclass(frozen=True)
class Spec:
    """The experiments of a spec, and the system documents to which their tasks refer."""

    name: str
    experiments: tuple[Experiment, ...]
    documents: Mapping[str, str]

    @property
    def size(self) -> int:
        """The number of tasks in all experiments."""
        return sum(experiment.size for experiment in self.experiments)


def read_spec(path: str | Path, *, max_tasks: int = MAX_TASKS, skip_bad: bool = False) -> Spec:
    """Read a spec from a TOML file; relative paths of system files in it start from the folder of this file.

    If `skip_bad`, systems that cannot be read or that the task cannot use are skipped and listed. Raises SpecError with
    all mistakes, and InputError if the spec file cannot be read.
    """
    data = _TOML.read(path)
    with reading(path):
        return parse_spec(data, str(path), folder=Path(path).parent, max_tasks=max_tasks, skip_bad=skip_bad)


def parse_spec(
    text: str | bytes,
    where: str = "spec",
    *,
    folder: Path | None = None,
    max_tasks: int = MAX_TASKS,
    skip_bad: bool = False,
) -> Spec:
    """Read a spec from TOML text; messages call the text `where`.

    >>> table = '[experiments.a]\\ntask = "orbit"\\nsystem = "lorenz"\\n'
    >>> spec = parse_spec(table + 'axes = {eps = ["0.1", "1/7"], seed = "0..4"}')
    >>> spec.size, spec.experiments[0][0].options["eps"]
    (10, '1/10')
    >>> parse_spec('[experiments.a]\\ntask = "orbot"\\nsystem = "lorenz"')  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    kahanmaps.experiments.spec.SpecError: spec: 1 mistake
      experiments.a.task: there is no task 'orbot', expected one of ...; did you mean orbit?
    """
    document = SpecDocument(_TOML.document(text, where), folder or Path(), skip_bad)
    experiments = []
    for name, table in (document.valid_value("experiments") or {}).items():
        if not re.fullmatch(EXPERIMENT_NAME, name):
            expected = "expected a name of at most 80 letters, digits and the characters _ . + -"
            document.mistake(f"experiments.{name}", expected)
        if isinstance(table, dict) and (experiment := ExperimentReader(document, name).read()) is not None:
            experiments.append(experiment)
    spec = Spec(document.valid_value("name") or "", tuple(experiments), document.documents)
    if spec.size > max_tasks:
        largest_first = sorted(experiments, key=lambda experiment: -experiment.size)
        sizes = ", ".join(f"{experiment.name} has {experiment.product}" for experiment in largest_first[:_MAX_LISTED])
        more = f" and {len(largest_first) - _MAX_LISTED} more" if len(largest_first) > _MAX_LISTED else ""
        sentence = f"found {spec.size:,} tasks, expected at most {max_tasks:,} (--max-tasks allows more): {sizes}{more}"
        document.mistake("experiments", sentence)
    if document.mistakes:
        raise SpecError(where, document.mistakes)
    return spec
