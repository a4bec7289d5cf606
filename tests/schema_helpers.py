"""What the tests of JSON schemas share: what is wrong with data, and which schema a command line has."""

from functools import cache
from typing import Any

from jsonschema import Draft202012Validator

from kahanmaps_cli.schema_files import ALIASES, schema


@cache
def validator(name: str) -> Draft202012Validator:
    """The validator of a schema, by name."""
    return Draft202012Validator(schema(name))


def mistakes(name: str, data: Any) -> list[str]:
    """What is wrong with data, the places first."""
    return [f"{error.json_path}: {error.message[:300]}" for error in validator(name).iter_errors(data)]


def is_wrong(name: str, data: Any) -> bool:
    """Whether anything is wrong with data: as soon as one mistake is found."""
    return not validator(name).is_valid(data)


def schema_of(line: str) -> str:
    """The schema of what a command line prints."""
    words = line.split()
    name = "-".join(words[:2]) if words[0] in ("family", "batch") else words[0]
    if "--levels" in words:
        name += "-levels"
    return ALIASES.get(name, name)
