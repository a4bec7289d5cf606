"""JSON schemas of files and of what --json prints: those written down in schemas/, and that of batch specs.

What several of them share is in schemas/common.json, and a printed schema carries the parts of it that it needs.
"""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from kahanmaps.checks.table import CHECKS

DIALECT = "https://json-schema.org/draft/2020-12/schema"
# Commands whose output has no schema of the command's own name.
ALIASES = {
    **dict.fromkeys(CHECKS, "check"),
    "family-new": "system-file",
}

_COMMON = "common.json"
_SPEC = "batch-spec"
_SPEC_TITLE = "A batch spec (TOML): what batch run is to do"
_SHARED = f"{_COMMON}#/$defs/"


def schema_titles() -> dict[str, str]:
    """The names of all schemas with their titles, in the order of the alphabet."""
    found = {_SPEC: _SPEC_TITLE}
    for file in (files("kahanmaps_cli") / "schemas").iterdir():
        if file.name.endswith(".json") and file.name != _COMMON:
            found[file.name.removesuffix(".json")] = _read(file.name)["title"]
    return dict(sorted(found.items()))


def schema(name: str) -> dict[str, Any]:
    """One schema, complete in itself. Raises InputError for a name that there is not."""
    from kahanmaps.errors import InputError, suggestion
    from kahanmaps.experiments.spec import spec_schema
    from kahanmaps.version import __version__

    known = schema_titles()
    name = ALIASES.get(name, name)
    if name not in known:
        hint = suggestion(name, [*known, *ALIASES]) or "; 'kahanmaps schema' lists them"
        raise InputError(f"there is no schema {name[:60]!r}{hint}")
    found = {"title": _SPEC_TITLE, **spec_schema()} if name == _SPEC else _bundled(_read(f"{name}.json"))
    return {"$schema": DIALECT, "$comment": f"kahanmaps {__version__}", **found}


def _read(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((files("kahanmaps_cli") / "schemas" / name).read_text(encoding="utf-8"))
    if name == "check.json":  # the one file that all checks share names them as their table does
        checks = [check.name for check in CHECKS.values()]
        found["title"] = f"check-{', -'.join(checks)} --json"
        found["properties"]["check"]["enum"] = checks
    return found


def _bundled(found: dict[str, Any]) -> dict[str, Any]:
    """The schema with the shared parts that it refers to, and those that they refer to, in its own $defs."""
    shared = _read(_COMMON)["$defs"]
    parts: dict[str, Any] = {}
    wanted = _references(found)
    while wanted:
        name = wanted.pop()
        if name not in parts:
            parts[name] = shared[name]
            wanted |= _references(shared[name])
    own = found.get("$defs", {})
    bundled = {**found, "$defs": {**own, **dict(sorted(parts.items()))}}
    local: dict[str, Any] = json.loads(json.dumps(bundled).replace(f'"{_SHARED}', '"#/$defs/'))
    return local


def _references(part: Any) -> set[str]:
    """The names of the shared parts that a part of a schema refers to."""
    if isinstance(part, list):
        return set().union(*map(_references, part))
    if not isinstance(part, dict):
        return set()
    below = set().union(*map(_references, part.values()))
    target = part.get("$ref", "")
    return below | {target.removeprefix(_SHARED)} if str(target).startswith(_SHARED) else below
