"""The JSON schema of batch specs: their shape, and the names of tasks and options, those that there are now."""

from __future__ import annotations

import json
from typing import Any

from kahanmaps.experiments.experiment import PARAMETERS
from kahanmaps.experiments.experiment_reader import TIME_STEP
from kahanmaps.experiments.options import FAMILY, VOCABULARY
from kahanmaps.experiments.registry import task_kinds
from kahanmaps.experiments.shape import shape_schema
from kahanmaps.experiments.spec import EXPERIMENT_NAME

_VALUE = {"type": ["string", "integer", "number", "boolean"]}
_VALUES = {"anyOf": [_VALUE, {"type": "array", "items": _VALUE, "minItems": 1}]}


def spec_schema() -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of what a batch spec in TOML is read as.

    It knows which keys, tasks and options there are, not which options a task has and which values make sense: that is
    what `read_spec` says. Numbers may be quoted or not.

    >>> "orbit" in spec_schema()["$defs"]["experiment"]["properties"]["task"]["enum"]
    True
    """
    found: dict[str, Any] = _untitled(shape_schema())
    text = json.dumps(found).replace("_ExperimentShape", "experiment").replace("_LimitsShape", "limits")
    found = json.loads(text)
    found["properties"]["experiments"]["propertyNames"] = {"pattern": f"^{EXPERIMENT_NAME}$"}
    experiment = found["$defs"]["experiment"]["properties"]
    experiment["task"]["enum"] = sorted(task_kinds())
    experiment["options"] |= _table(_VALUE)
    experiment["axes"] |= _table(_VALUES)
    return {"description": "Experiments, each a task for many systems and many values of its options.", **found}


def _table(value: dict[str, Any]) -> dict[str, Any]:
    """A table of options by name, each with a value of this kind."""
    options = {name: {"description": option.help, **value} for name, option in {**VOCABULARY, **FAMILY}.items()}
    options[TIME_STEP] = {"description": "the time step, 2 eps, instead of eps", **value}
    parameters = {
        "description": "values for parameters of the systems",
        "type": "object",
        "additionalProperties": value,
    }
    return {
        "properties": {**options, PARAMETERS.removesuffix("."): parameters},
        "patternProperties": {f"^{PARAMETERS.replace('.', '[.]')}": value},
        "additionalProperties": False,
    }


def _untitled(part: Any) -> Any:
    """Without the titles that pydantic makes of the names of fields."""
    if isinstance(part, dict):
        return {key: _untitled(value) for key, value in part.items() if not (key == "title" and isinstance(value, str))}
    return [_untitled(item) for item in part] if isinstance(part, list) else part
