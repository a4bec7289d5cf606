"""Specs: what they say becomes tasks, with one key for one question; nothing is enumerated before it is asked for."""

import json
import tracemalloc
from itertools import product

import pytest
from flint import fmpq, fmpq_poly
from helpers import refuses, together
from specs import COMMUTE, FAMILY, LORENZ, mistakes, only, option, task_of, tasks

from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.files import parse_system
from kahanmaps.experiments.options import FAMILY as OF_FAMILY
from kahanmaps.experiments.results.records import TaskLimits, canonical
from kahanmaps.experiments.results.system_spec import document_text, family_spec, find_file, spec_of, system_from
from kahanmaps.experiments.spec import parse_spec, read_spec
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.random_members import (
    random_eigenvalues,
    random_member,
    random_member_with_chi,
    random_member_with_eigenvalues,
)


def test_the_last_axis_runs_fastest_and_systems_slowest():
    text = LORENZ.replace('"lorenz"', '["lorenz", "riccati"]') + 'axes = {eps = [1, 2], seed = "0..2"}'
    results = [(task.system["name"], task.options["eps"], task.options["seed"]) for task in tasks(text) if task.system]
    assert results == list(product(["lorenz", "riccati"], ["1", "2"], [0, 1, 2]))


def test_zipped_axes_run_together():
    text = FAMILY + 'zip = [["m", "steps"]]\naxes = {m = "2..4", eps = [1, 2], steps = [30, 20, 10]}'
    results = [(task.value("m"), task.value("eps"), task.value("steps")) for task in tasks(text)]
    assert results == [(m, eps, steps) for m, steps in [(2, 30), (3, 20), (4, 10)] for eps in "12"]


@pytest.mark.parametrize(
    ("axes", "eps"), [("time_step = 0.2", ["1/10"]), ('time_step = [7, "1..2"]', ["7/2", "1/2", "1"])]
)
def test_the_time_step_is_twice_eps(axes, eps):
    assert option(LORENZ + f"axes = {{{axes}}}", "eps") == eps


def test_rows_of_a_zip_may_not_repeat_nor_values_of_other_axes():
    text = LORENZ + "ZIP\naxes = {eps = 1, parameters = {s = [1, 1, 2], r = [5, 5, 6]}}"
    zipped = text.replace("ZIP", 'zip = [["parameters.s", "parameters.r"]]')
    refuses(r"zip\[1\]: found equal values at positions 1 and 2", only, zipped)
    refuses(r"axes\.parameters\.s\[2\]: found 1, the same value as in place 1", only, text.replace("ZIP", ""))


def test_paths_of_systems_are_relative_to_the_folder_of_the_spec(folder, tmp_path_factory, monkeypatch):
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    (folder / "study.toml").write_text(LORENZ.replace("lorenz", "members/../rotor.toml") + "axes = {eps = 1}")
    (experiment,) = read_spec(folder / "study.toml").experiments
    assert experiment[0].value("parameters.a") == "2"


@pytest.mark.parametrize(
    ("system", "names"),
    [
        ('["rotor.toml", "lorenz"]', ["rotor", "lorenz"]),
        ('"members/*.toml"', ["one", "two"]),
        ('["lorenz", "*/[p-z]*.toml"]', ["lorenz", "two"]),
    ],
)
def test_systems_are_names_paths_patterns_or_lists_of_these(folder, system, names):
    result = tasks(LORENZ.replace('"lorenz"', system) + "axes = {eps = 1}", folder=folder)
    assert [task.system["name"] for task in result if task.system] == names


def test_a_second_system_is_a_recipe_like_the_first(folder):
    text = COMMUTE + 'system = "lotka_volterra"\naxes = {other = ["harmonic", "rotor.toml"]}'
    result = tasks(text, folder=folder)
    spec = parse_spec(text, folder=folder)
    assert [task.options["other"]["name"] for task in result] == ["harmonic", "rotor"]
    named = {task.options["other"]["document"] for task in result}
    assert named | {task.system["document"] for task in result} == set(spec.documents)
    assert all(isinstance(json.loads(text), dict) for text in spec.documents.values())


SAME_KEYS = [
    (LORENZ + "axes = {eps = 0.1}", LORENZ + 'options = {eps = "2/20"}'),
    (LORENZ + "axes = {eps = 1000.5}", LORENZ + "axes = {eps = 1_000.5}"),
    (LORENZ + "axes = {eps = 1}", LORENZ + 'axes = {eps = 1, steps = 100, arithmetic = "exact", seed = 0}'),
    (LORENZ + "axes = {eps = 1}", LORENZ + 'axes = {eps = 1, parameters = {s = 10, b = "16/6"}}\nlimits = {time = 5}'),
    (LORENZ + 'axes = {eps = 1, start = "1/2, -1/3, 0"}', LORENZ + 'axes = {eps = 1, start = "0.5,-2/6,0"}'),
    (LORENZ + "axes = {eps = 1, max_digits = 9}", LORENZ + "axes = {eps = 1}\nlimits = {digits = 9}"),
    (FAMILY + "axes = {eps = 1, m = 2}", FAMILY + 'axes = {eps = 1, m = 2, draw = "eigenvalues", size = 2}'),
    (FAMILY + 'axes = {eps = 1, chi = "t^2-2"}', FAMILY + 'axes = {eps = 1, chi = "2*t^2 - 4", size = 1}'),
    ('[experiments.b]\ntask = "orbit"\nsystem = ["lorenz"]\naxes = {eps = 1}', LORENZ + "axes = {eps = 1}"),
]
OTHER_KEYS = [
    (LORENZ + "axes = {eps = 0.1}", LORENZ + "axes = {time_step = 0.1}"),
    (LORENZ + "axes = {eps = 1}", LORENZ + "axes = {eps = 1}\nlimits = {digits = 9}"),
    (LORENZ + "axes = {eps = 1}", LORENZ + "axes = {eps = 1, parameters = {s = 11}}"),
    (LORENZ + "axes = {eps = 1}", LORENZ.replace("orbit", "heights") + "axes = {eps = 1}"),
    (LORENZ + 'axes = {eps = 1, start = "1,2,3"}', LORENZ + 'axes = {eps = 1, start = "1,3,2"}'),
    (FAMILY + "axes = {eps = 1, m = 2}", FAMILY + 'axes = {eps = 1, m = 2, draw = "generic"}'),
    (FAMILY + "axes = {eps = 1, m = 2}", FAMILY + 'axes = {eps = 1, m = 2, signs = "1,-1"}'),
    (FAMILY + 'axes = {eps = 1, eigenvalues = "1,2"}', FAMILY + 'axes = {eps = 1, eigenvalues = "2,1"}'),
    (
        COMMUTE + 'system = "lorenz"\naxes = {other = "euler_top"}',
        COMMUTE + 'system = "euler_top"\naxes = {other = "lorenz"}',
    ),
]


@pytest.mark.parametrize(
    ("first", "second", "is_same"), [(*pair, True) for pair in SAME_KEYS] + [(*pair, False) for pair in OTHER_KEYS]
)
def test_the_same_question_has_the_same_key_and_another_one_another_key(first, second, is_same):
    assert (task_of(first).key == task_of(second).key) is is_same


BOTH = LORENZ + 'axes = {eps = [1, 2], seed = "0..2"}'
DEFINITIONS = [
    (LORENZ + "axes = {eps = [0.1, 1]}", LORENZ + "axes = {time_step = [0.2, 2]}", True),
    (LORENZ + "axes = {eps = [0.1, 1]}", LORENZ + "axes = {eps = [0.1, 1]}\noptions = {steps = 100}", True),
    (LORENZ + 'axes = {eps = 1, seed = "0..5 step 2"}', LORENZ + 'axes = {eps = 1, seed = "0..4 step 2"}', True),
    (BOTH, BOTH.replace(".a]", ".b]") + "\nlimits = {time = 1}", True),
    (BOTH, BOTH + "\noptions = {parameters = {s = 10}}", True),
    (FAMILY + "axes = {eps = 1, m = [2, 3]}", FAMILY + "axes = {eps = 1, m = [2, 3]}\noptions = {size = 2}", True),
    (BOTH, BOTH.replace("0..2", "0..3"), False),
    (BOTH, BOTH.replace("[1, 2]", "[2, 1]"), False),
    (BOTH, LORENZ + 'axes = {seed = "0..2", eps = [1, 2]}', False),
    (BOTH, BOTH + "\nlimits = {digits = 5}", False),
    (BOTH, BOTH.replace("0..2", "0..4 step 2"), False),
    (BOTH, BOTH.replace("lorenz", "euler_top"), False),
    (BOTH, BOTH.replace("orbit", "heights"), False),
    # The same tasks, but a range is never spelt out to compare it: planning finds the tasks again by their keys.
    (BOTH, BOTH.replace('"0..2"', "[0, 1, 2]"), False),
]


@together("first, second, is_same", DEFINITIONS)
def test_experiments_have_the_same_definition_where_they_say_the_same(first, second, is_same):
    assert (only(first).definition == only(second).definition) is is_same


@pytest.mark.parametrize(
    ("name", "written", "limit"),
    [
        ("time", "1.5", 1.5), ("time", '"90s"', 90.0), ("time", '"1.5 min"', 90.0), ("time", '"2 h"', 7200.0),
        ("time", '"1 d"', 86400.0), ("time", "1e3", 1000.0), ("time", '" 5 "', 5.0), ("time", '"none"', None),
        ("memory", "1000", 1000), ("memory", '"500 MB"', 500_000_000), ("memory", '"4.35 GB"', 4_350_000_000),
        ("memory", '"2GiB"', 2**31), ("memory", '"1 KiB"', 1024), ("memory", '"1 TB"', 10**12),
        ("memory", "2_000_000", 2_000_000), ("memory", '"none"', None),
    ],
)  # fmt: skip
def test_a_limit_is_in_seconds_or_bytes_unless_it_says_otherwise(name, written, limit):
    assert getattr(only(LORENZ + f"axes = {{eps = 1}}\nlimits = {{{name} = {written}}}").limits, name) == limit


def test_the_limits_of_an_experiment_come_before_those_of_all():
    common = 'limits = {time = 5, memory = "1 MB", digits = 50}\n'
    spec = parse_spec(common + LORENZ + "axes = {eps = 1}\nlimits = {time = 7}")
    assert spec.experiments[0].limits == TaskLimits(7.0, 1_000_000)
    assert spec.experiments[0][0].options["max_digits"] == 50


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ('seed = "1..1e18", steps = "1..1e9", eps = "1..1e18"', "x 1,000,000,000 steps x"),
        ('eps = "1..1e6", seed = "1..1e6", steps = "1..5"', "a has 1,000,000 eps+seed x 5 steps"),
    ],
)
def test_absurd_products_are_refused_in_no_time_and_space(axes, message):
    text = LORENZ + f"axes = {{{axes}}}" + ('\nzip = [["eps", "seed"]]' if "1..5" in axes else "")
    tracemalloc.start()
    try:
        ((key, sentence),) = mistakes(text)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert key == "experiments"
    assert "expected at most 1,000,000 (--max-tasks allows more)" in sentence
    assert message in sentence
    assert peak < 50_000_000  # 1 MB


TURNING = 'name = "rotor"\nvariables = ["x", "y"]\n[parameters]\na = "2"\n[system]\nrhs = ["a*y", "-x*y"]\n'
CATALOG = '[catalog]\ntitle = "Rotor"\nfacts = ["Measured: it turns."]\n'


def drawn(**values):
    """The random member of a recipe, with values as a spec has them."""
    recipe = family_spec({k: OF_FAMILY[k].read(v) if k in OF_FAMILY else v for k, v in values.items()})
    return system_from(recipe, {}.__getitem__).member


@pytest.mark.parametrize(
    ("values", "member"),
    [
        ({"m": 2}, lambda: random_member_with_eigenvalues(random_eigenvalues(2, 0), 0)),
        ({"m": 3, "seed": 7, "size": 5}, lambda: random_member_with_eigenvalues(random_eigenvalues(3, 7), 7, 5)),
        ({"m": 3, "seed": 7, "draw": "generic", "size": 4}, lambda: random_member(3, 7, 4)),
        ({"eigenvalues": "1/2,-3", "seed": 7}, lambda: random_member_with_eigenvalues([fmpq(1, 2), -3], 7)),
        ({"chi": "2*t^2 - 4", "seed": 7, "size": 3}, lambda: random_member_with_chi(fmpq_poly([-2, 0, 1]), 7, 3)),
    ],
)
def test_a_random_member_is_the_one_that_the_library_draws(values, member):
    assert drawn(**values) == member()


def test_signs_pick_an_associated_system():
    plain = drawn(m=2, seed=1)
    assert drawn(m=2, seed=1, signs="1,-1") == FamilyMember(plain.A, plain.H, (1, -1))


def test_every_system_of_the_catalogue_reads_back_equal():
    for name in names():
        documents: dict[str, str] = {}
        recipe = json.loads(canonical(spec_of(load(name), documents)))
        assert system_from(recipe, documents.__getitem__) == load(name)


@pytest.mark.parametrize(
    ("text", "is_same"),
    [
        (TURNING + CATALOG, True),  # what is told about a system is not the system
        ("# a remark\n" + TURNING.replace("\n", "\r\n").replace('"2"', "2.0"), True),
        (TURNING.replace('"2"', '"3"'), False),
        (TURNING.replace("-x*y", "x*y"), False),
        (TURNING.replace("rotor", "motor"), False),  # reports print the name
        (TURNING + '[integrals]\nI = "x^2"\n', False),
        (TURNING + '[density]\nphi = "x"\n', False),
    ],
)
def test_a_recipe_is_another_one_when_the_file_says_something_else(text, is_same):
    documents: dict[str, str] = {}
    recipe = spec_of(parse_system(TURNING), documents)
    assert documents == {recipe["document"]: document_text(parse_system(TURNING))}
    assert (spec_of(parse_system(text), {}) == recipe) is is_same


@pytest.mark.parametrize(("reference", "name"), [("lorenz", "lorenz"), ("./rotor.toml", "rotor")])
def test_a_word_is_a_name_of_the_catalogue_and_a_path_is_relative_to_the_folder(tmp_path, reference, name):
    for file in ("lorenz", "rotor.toml"):
        (tmp_path / file).write_text(TURNING)
    assert find_file(reference, tmp_path).name == name
