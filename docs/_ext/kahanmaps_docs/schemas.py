"""The JSON schemas, as the command line gives them: of each its keys. The whole is long, and for programs."""

from __future__ import annotations

import contextlib
import io
import json
from typing import Any

from kahanmaps_cli.main import main
from kahanmaps_docs.markdown import code, plain, table

Schema = dict[str, Any]


def schemas() -> str:
    """Every schema that `kahanmaps schema` lists, in a section of its own."""
    return "\n".join(section(found["name"]) for found in json.loads(printed("schema", "--json"))["schemas"])


def section(name: str) -> str:
    """What a schema is of, and the keys of its objects."""
    schema = json.loads(printed("schema", name))
    about = schema.get("description", "")
    pieces = [f"(schema-{name})=\n## {name}\n", plain(schema["title"]) + ".\n", plain(about) + "\n"]
    for description, keys, required in shapes(schema, schema["$defs"]):
        if description != about:
            pieces.append(plain(description) + "\n")
        rows = [(code(key), plain(said) + " *May be missing.*" * (key not in required)) for key, said in keys.items()]
        pieces.append(table(("key", ""), rows))
    pieces.append(f"All of it: `kahanmaps schema {name}`.\n")
    return "\n".join(pieces)


def shapes(schema: Schema, definitions: Schema) -> list[tuple[str, dict[str, str], list[str]]]:
    """The kinds of objects that a schema allows: of each its description, its keys with theirs, and those required."""
    schema = resolved(schema, definitions)
    kinds = schema.get("oneOf", schema.get("anyOf", []))
    if "properties" not in schema:
        return [shape for kind in kinds for shape in shapes(kind, definitions)]
    keys = {key: resolved(value, definitions).get("description", "") for key, value in schema["properties"].items()}
    return [(schema.get("description", ""), keys, schema.get("required", []))]


def resolved(schema: Schema, definitions: Schema) -> Schema:
    """A schema with what it refers to; its own words go first."""
    if "$ref" not in schema:
        return schema
    other = resolved(definitions[schema["$ref"].removeprefix("#/$defs/")], definitions)
    properties = {**schema.get("properties", {}), **other.get("properties", {})}
    required = [*schema.get("required", []), *other.get("required", [])]
    return {**other, **schema, **({"properties": properties, "required": required} if properties else {})}


def printed(*words: str) -> str:
    """The standard output of a command. Raises RuntimeError where it does not succeed."""
    out, told = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(told):
        status = main(words)
    if status:
        raise RuntimeError(f"kahanmaps {' '.join(words)} ended with {status}: {told.getvalue()}")
    return out.getvalue()
