"""System files and batch specs satisfy their schemas, and what a schema refuses the reader refuses, too."""

import tomllib
from pathlib import Path

import pytest
from schema_helpers import mistakes

from kahanmaps.documents import reader
from kahanmaps.documents.files import SystemFileError, parse_system
from kahanmaps.experiments.options import FAMILY, VOCABULARY
from kahanmaps.experiments.registry import task_kinds
from kahanmaps.experiments.spec import SpecError, parse_spec
from kahanmaps_cli.schema_files import schema

ROOT = Path(__file__).parents[2]
CATALOG = ROOT / "kahanmaps" / "documents" / "catalog"


def test_a_system_file_has_the_same_keys_for_the_schema_and_for_the_reader():
    parts = schema("system-file")["$defs"]
    found = {"": parts["system_file"], "catalog": parts["catalog_section"]}
    found |= {key: parts["system_file"]["properties"][key] for key in (*reader.KINDS, "density")}
    found["composition.of"] = parts["composition_part"]
    assert {key: set(part["properties"]) for key, part in found.items()} == reader.KEYS


@pytest.mark.parametrize("path", sorted(CATALOG.glob("*.toml")), ids=lambda path: path.stem)
def test_a_file_of_the_catalogue_satisfies_the_schema(path):
    assert mistakes("system-file", tomllib.loads(path.read_text())) == []


@pytest.mark.parametrize("options", ["--m 2 --seed 3 --signs 1,-1", "--m 1 --generic", "--chi t^2-2"])
def test_what_family_new_writes_satisfies_the_schema(kahanmaps, options):
    assert mistakes("system-file", tomllib.loads(kahanmaps(f"family new {options} -q").out)) == []


BAD_FILES = [
    'variables = ["x"]\n[system]\nrhs = ["x"]\n[hamiltonian]\nH = "x"\nJ = "standard"',
    'variables = ["1x"]\n[system]\nrhs = ["x"]',
    'variables = ["eps"]\n[system]\nrhs = ["1"]',
    'variables = ["x"]\n[system]\nrsh = ["x"]',
    'variables = ["x"]\n[system]\nrhs = ["x"]\n[parameters]\neps = 1',
    'variables = ["x"]\n[system]\nrhs = [" "]',
    'variables = ["x"]\n[system]\nrhs = ["x"]\n[parameters]\na = "1+1"',
    'variables = ["x", "y"]\n[hamiltonian]\nH = "x"\nJ = "Standard"',
    '[family]\nA = [["1", "0"], ["0", "1"]]\nH = "x1^3"\nsigns = [0]',
    'variables = ["x"]\n[system]\nrhs = ["x"]\n[density]\npsi = "1"',
    'variables = ["x"]\n[system]\nrhs = ["x"]\n[catalog]\ngrowth = "cubic"',
]


@pytest.mark.parametrize("text", BAD_FILES)
def test_what_the_schema_refuses_in_a_system_file_is_refused_by_the_reader_as_well(text):
    assert mistakes("system-file", tomllib.loads(text))
    with pytest.raises(SystemFileError):
        parse_system(text)


@pytest.mark.parametrize("path", sorted((ROOT / "examples").rglob("*.toml")), ids=lambda path: path.stem)
def test_a_file_of_the_examples_satisfies_its_schema(path):
    found = tomllib.loads(path.read_text(encoding="utf-8"))
    assert mistakes("batch-spec" if "experiments" in found else "system-file", found) == []


EXPERIMENT = '[experiments.a]\ntask = "orbit"\nsystem = "weierstrass"\n'
GOOD_SPECS = [
    EXPERIMENT + 'options = { time_step = 0.1, seed = "0" }\naxes = { steps = "1..3", "parameters.g2" = ["1/2", 3] }',
    EXPERIMENT + 'options = { eps = 1 }\nlimits = { time = "none", memory = "1.5 GiB", digits = 7 }',
    EXPERIMENT + 'axes = { eps = [1, 2], seed = ["0..1"] }\nzip = [["eps", "seed"]]',
]
BAD_SPECS = [
    'name = "empty"',
    EXPERIMENT.replace("orbit", "orbot"),
    EXPERIMENT + 'option = { eps = "1" }',
    EXPERIMENT + 'options = { epss = "1" }',
    EXPERIMENT + "options = { eps = [1, 2] }",
    EXPERIMENT + 'options = { eps = "1" }\nlimits = { time = "1 parsec" }',
    EXPERIMENT + 'options = { eps = "1" }\nlimits = { digits = 0 }',
    EXPERIMENT + 'axes = { eps = [1, 2] }\nzip = ["eps"]',
    EXPERIMENT.replace("experiments.a", 'experiments."a b"') + 'options = { eps = "1" }',
    '[experiments.a]\nsystem = "weierstrass"',
]


@pytest.mark.parametrize("text", GOOD_SPECS)
def test_a_spec_that_is_read_satisfies_the_schema(text):
    assert parse_spec(text).size > 0
    assert mistakes("batch-spec", tomllib.loads(text)) == []


@pytest.mark.parametrize("text", BAD_SPECS)
def test_what_the_schema_refuses_in_a_spec_is_refused_by_the_reader_as_well(text):
    assert mistakes("batch-spec", tomllib.loads(text))
    with pytest.raises(SpecError):
        parse_spec(text)


def test_the_schema_of_specs_knows_every_task_and_option():
    experiment = schema("batch-spec")["$defs"]["experiment"]["properties"]
    assert set(experiment["task"]["enum"]) == set(task_kinds())
    known = {*VOCABULARY, *FAMILY, "time_step", "parameters"}
    assert set(experiment["options"]["properties"]) == set(experiment["axes"]["properties"]) == known
