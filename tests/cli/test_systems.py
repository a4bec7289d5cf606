"""kahanmaps systems: the catalogue, listed, shown, and printed as files to copy and change."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from kahanmaps.systems import catalog
from kahanmaps.systems.files import parse_system

over_names = pytest.mark.parametrize("name", catalog.names())


# The list


def test_every_system_has_a_line(kahanmaps):
    listed = {line.split()[0]: int(line.split()[1]) for line in kahanmaps("systems").out.splitlines()}
    assert listed == {name: catalog.load(name).system.dim for name in catalog.names()}


def test_the_list_for_scripts_has_the_same_systems(kahanmaps):
    systems = kahanmaps("systems --json").json["systems"]
    assert [system["name"] for system in systems] == list(catalog.names())
    assert all(set(system) == {"name", "dim", "kind", "title", "parameters"} for system in systems)


# One system


@over_names
def test_a_system_is_shown_with_equations_facts_and_sources(kahanmaps, name):
    shown = kahanmaps("systems", name)
    file = catalog.load(name)
    assert shown.status == 0
    assert shown.out.startswith(f"{name}: {file.catalog['title']}\n")
    assert str(file.system) in shown.out
    assert all(f"* {fact}" in shown.out for fact in file.catalog["facts"])
    assert shown.out.count("source: ") == len(file.catalog["sources"])


@over_names
def test_a_system_is_shown_for_scripts(kahanmaps, name):
    shown = kahanmaps("systems", name, "--json").json
    assert set(shown) == {
        "name",
        "dim",
        "kind",
        "title",
        "parameters",
        "variables",
        "rhs",
        "integrals",
        "density",
        "facts",
        "convention",
        "sources",
        "document",
    }
    assert (shown["name"], shown["dim"]) == (name, len(shown["rhs"]))


@over_names
def test_the_file_that_is_printed_reads_back_equal(kahanmaps, name):
    assert parse_system(kahanmaps("systems", name, "--toml").out, name) == catalog.load(name)


def test_parameters_are_set_in_equations_and_files(kahanmaps):
    shown = kahanmaps("systems euler_top -p a1=1/2 -p a3=0.25 --json").json
    assert shown["rhs"] == ["x2*x3/2", "-2*x1*x3", "x1*x2/4"]
    toml = tomllib.loads(kahanmaps("systems euler_top -p a1=1/2 -p a3=0.25 --toml").out)
    assert toml["parameters"] == {"a1": "1/2", "a2": "-2", "a3": "1/4"}


def test_a_file_of_ones_own_is_shown_as_well(kahanmaps, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('variables = ["x"]\n[system]\nrhs = ["x^2"]\n')
    assert kahanmaps("systems", path).out == "mine\nx' = x^2\n"


def test_the_catalogue_is_found_from_every_folder(kahanmaps, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("lorenz").write_text("not this one")
    assert kahanmaps("systems lorenz --json").json["dim"] == 3
