"""`kahanmaps schema`, and the schemas themselves: complete, closed, described, in the words of the code."""

from collections.abc import Iterator
from typing import Any

import click
import pytest
from jsonschema import Draft202012Validator

from kahanmaps.checks.claims import Verdict
from kahanmaps.checks.table import CHECKS
from kahanmaps.documents.structured_facts import GROWTHS, VERDICTS
from kahanmaps.experiments.results.records import KEPT
from kahanmaps.invariants.growth import OF_DEGREES, OF_HEIGHTS
from kahanmaps.maps.normal_form.periods import Kind
from kahanmaps_cli.main import cli
from kahanmaps_cli.schema_files import ALIASES, schema, schema_titles


def json_commands(group: click.Group, context: click.Context, path: str = "") -> Iterator[str]:
    """The commands that have an option --json."""
    for name in group.list_commands(context):
        found = group.get_command(context, name)
        if isinstance(found, click.Group):
            yield from json_commands(found, context, f"{path}{name}-")
        elif found is not None and any("--json" in parameter.opts for parameter in found.params):
            yield f"{path}{name}"


def test_every_command_that_prints_json_has_a_schema():
    commands = set(json_commands(cli, click.Context(cli)))
    assert {name for name in commands if ALIASES.get(name, name) not in schema_titles()} == set()
    assert len(commands) > 25


@pytest.mark.parametrize("name", schema_titles())
def test_a_schema_is_one_complete_in_itself_and_in_words(name):
    found = schema(name)
    Draft202012Validator.check_schema(found)
    assert list(found)[:3] == ["$schema", "$comment", "title"]
    assert set(_references(found)) <= {f"#/$defs/{part}" for part in found.get("$defs", {})}
    assert [place for place, part in _properties(found) if not _description(part, found)] == []


@pytest.mark.parametrize("name", schema_titles())
def test_every_object_of_a_schema_is_closed(name):
    found = schema(name)
    closed_elsewhere = {
        part["$ref"].rpartition("/")[2] for part in _parts(found) if part.get("unevaluatedProperties") is False
    }
    for part in _parts({**found, "$defs": {}}):
        if part.get("type") == "object":
            assert "additionalProperties" in part or name == "batch-summary", part
    for definition, body in found.get("$defs", {}).items():
        if definition not in closed_elsewhere:
            open_ones = [part for part in _parts(body) if "properties" in part and part.get("type") == "object"]
            assert all("additionalProperties" in part for part in open_ones), definition


def _parts(part: Any) -> Iterator[dict[str, Any]]:
    if isinstance(part, dict):
        yield part
    for below in part.values() if isinstance(part, dict) else part if isinstance(part, list) else ():
        yield from _parts(below)


def _references(found: dict[str, Any]) -> Iterator[str]:
    return (part["$ref"] for part in _parts(found) if isinstance(part.get("$ref"), str))


def _properties(found: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The properties of all objects; conditions (if, then, not) describe nothing."""
    for part in _parts({key: value for key, value in found.items() if key not in ("if", "then", "else", "allOf")}):
        if part.get("type") == "object" or "unevaluatedProperties" in part:
            yield from part.get("properties", {}).items()


def _description(part: Any, found: dict[str, Any]) -> str:
    if "description" in part or "$ref" not in part:
        return part.get("description", "")
    return _description(found["$defs"][part["$ref"].rpartition("/")[2]], found)


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ("verdict", list(Verdict)),
        ("height_growth", OF_HEIGHTS),
        ("growth_class", OF_DEGREES),
    ],
)
def test_the_words_of_a_schema_are_those_of_the_code(part, words):
    assert schema("analyze")["$defs"][part]["enum"] == [str(word) for word in words]


def test_further_words_are_those_of_the_code():
    planes = schema("period")["properties"]["planes"]["items"]["properties"]
    assert planes["kind"]["enum"] == [kind.name.lower() for kind in Kind]
    assert schema("batch-run")["$defs"]["outcome"]["enum"] == [str(outcome) for outcome in KEPT]
    facts = schema("system-file")["$defs"]["catalog_section"]["properties"]
    assert facts["growth"]["enum"] == list(GROWTHS)
    assert facts["verdict"]["enum"] == list(VERDICTS)


def test_the_list_has_a_line_for_each_schema(kahanmaps):
    rows = kahanmaps("schema").out.splitlines()
    assert [row.split()[0] for row in rows] == list(schema_titles())
    assert {"system-file", "batch-spec", "check", "orbit", "family-show"} <= {row.split()[0] for row in rows}


@pytest.mark.parametrize("name", ["family-show", "family show"])
def test_a_schema_is_printed_by_its_name_or_that_of_its_command(kahanmaps, name):
    assert kahanmaps(f"schema {name}").json == schema("family-show")


@pytest.mark.parametrize("command", CHECKS)
def test_the_checks_share_a_schema(kahanmaps, command):
    assert kahanmaps(f"schema {command}").json == schema("check")
