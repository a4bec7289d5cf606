"""Tasks as a child does them: systems from their recipes, options from their canonical texts, results of plain data."""

import json
from typing import Any

from kahanmaps.documents.files import SystemFile
from kahanmaps.experiments.registry import task_kind
from kahanmaps.experiments.results.records import canonical
from kahanmaps.experiments.results.system_spec import spec_of, system_from


def made(file: SystemFile) -> SystemFile:
    """The system as a child has it: from the recipe of the file."""
    documents: dict[str, str] = {}
    return system_from(spec_of(file, documents), documents.__getitem__)


def member(m: int = 2, seed: int = 1, **recipe: Any) -> SystemFile:
    return system_from({"family": {"draw": "eigenvalues", "m": m, "seed": seed, **recipe}}, {}.__getitem__)


def perform(name: str, system: SystemFile | None, **requested: Any) -> dict[str, Any]:
    """What a task gives, with the defaults of its kind for what is not asked; it has to be plain data."""
    kind = task_kind(name)
    given = {key: value if key == "other" else kind.options[key].read(value) for key, value in requested.items()}
    result = kind.perform(system, {**kind.defaults, **given})
    assert json.loads(canonical(result)) == result
    return result
