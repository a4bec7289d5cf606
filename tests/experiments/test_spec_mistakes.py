"""Mistakes of specs: every one is told once, at its place, all at once.

Whatever the bytes are, reading them gives a Spec or raises InputError (SpecError for the contents of the file), and
nothing else.
"""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specs import COMMUTE, FAMILY, LORENZ, SPACE, UNIVERSAL, keys, mistakes

from kahanmaps.errors import InputError
from kahanmaps.experiments import spec as spec_module
from kahanmaps.experiments.records import Task
from kahanmaps.experiments.spec import Spec, SpecError, parse_spec, read_spec

# Mistakes


TEN = """
name = 5
[experiments.first]
task = "orbit"
system = "lorens"
colour = "red"
axes = { eps = [0.1, 0], stpes = 5, steps = -1 }
zip = [["eps"]]
limits = { time = "5 minutes" }
[experiments.second]
task = "orbot"
[experiments.third]
task = "verify-universal"
"""


def test_a_spec_error_counts_its_mistakes_and_shows_them():
    with pytest.raises(SpecError) as caught:
        parse_spec(TEN, "study.toml")
    lines = str(caught.value).splitlines()
    assert lines[0] == "study.toml: 10 mistakes"
    assert "  experiments.second.task: there is no task 'orbot', expected one of" in str(caught.value)


MANY = """
colour = "red"
limits = { time = 0, memory = "1 XB", digits = 0, ram = 1 }
[experiments.shape]
task = 5
system = [1]
options = 5
axes = []
zip = ["eps"]
limits = 7
foo = 1
[experiments."no name"]
task = "orbit"
system = "lorenz"
axes = { eps = "1..2 step 0", seed = [], start = "1,2", at = "x", method = "jmp" }
[experiments.twice]
task = "heights"
system = ["euler_top", "euler_top", "nix.toml"]
options = { time_step = 1, steps = [1, 2], every = "1..2", parameters = { b1 = 1, a1 = 1 } }
axes = { eps = [1, "2/2"], parameters = { a1 = [1, 2] }, seed = [1, 2], report = true }
zip = [["seed", "sed"], ["parameters.a1", "seed"], []]
[experiments.member]
task = "verify"
system = "lorenz"
limits = { digits = 5 }
options = { other = "lorenz", sections = "0" }
[experiments.drawn]
task = "check-commute"
system = ["family", "lorenz"]
axes = { m = 2, chi = "t", draw = "generic", other = 5, parameters = { a = 1 }, signs = "2" }
[experiments.unsaid]
task = "orbit"
[experiments.empty]
"""


def test_a_large_spec_is_told_every_mistake_with_its_key():
    assert sorted(keys(MANY)) == sorted(
        ["colour", "limits.time", "limits.memory", "limits.digits", "limits.ram"]
        + [f"experiments.shape.{k}" for k in ("task", "system", "options", "axes", "zip[1]", "limits", "foo")]
        + ["experiments.no name"]
        + [f"experiments.no name.axes.{k}" for k in ("eps", "seed", "at", "method")]
        + [f"experiments.twice.{k}" for k in ("system[2]", "system[3]", "options.steps", "options.every")]
        + [f"experiments.twice.{k}" for k in ("options.parameters.b1", "axes.eps", "axes.eps[2]", "axes.report")]
        + [f"experiments.twice.{k}" for k in ("axes.parameters.a1", "zip[1]", "zip[2]", "zip[3]")]
        + [f"experiments.member.{k}" for k in ("system", "limits.digits", "options.other", "options.sections")]
        + [f"experiments.drawn.{k}" for k in ("system", "axes.chi", "axes.chi", "axes.other", "axes.parameters.a")]
        + ["experiments.drawn.axes.signs"]
        + ["experiments.unsaid.system", "experiments.unsaid.axes.eps"]
        + ["experiments.empty.task"]
    )


# Text after LORENZ, key, beginning of the sentence. One mistake each.
ONE_MISTAKE = [
    ("axes = {eps = 0}", "axes.eps", "found 0, expected another number: at eps = 0 the Kahan map is the identity"),
    ('axes = {eps = "-1..1"}', "axes.eps", "found 0, expected another number"),
    ("axes = {eps = []}", "axes.eps", "found an empty list, expected at least one value"),
    ("axes = {eps = [0.1, 1, \"1/10\"]}", "axes.eps[3]", "found '1/10', the same value as in place 1"),
    ('axes = {eps = "1..5 step 0"}', "axes.eps", "found a range of step 0"),
    ("axes = {eps = {a = 1}}", "axes.eps", "found {'a': 1}, expected a number"),
    ("axes = {eps = 1979-05-27}", "axes.eps", "found 1979-05-27, expected a number"),
    ("axes = {eps = 1, stpes = 3}", "axes.stpes", "orbit has no such option, expected one of eps, steps, start, at, "),
    ("axes = {eps = 1}\noptions = {steps = [3]}", "options.steps", "found a list, expected one value; lists and range"),
    ("axes = {eps = 1}\noptions = {steps = \"1..3\"}", "options.steps", "found 3 values, expected one; lists and rang"),
    ("axes = {eps = 1, time_step = 2}", "axes.time_step", "found axes.eps as well, expected one of the two (the time"),
    ("axes = {time_step = 2}\noptions = {eps = 1}", "axes.time_step", "found options.eps as well, expected one of the"),
    ("axes = {eps = 2, parameters = 5}", "axes.parameters", "found 5, expected a table of parameters"),
    ("axes = {eps = 2, parameters = {s = []}}", "axes.parameters.s", "found an empty list"),
    ("axes = {eps = 2, parameters = {sigma = 1}}", "axes.parameters.sigma", "lorenz has no such parameter, its parame"),
    (
        "axes = {eps = 2, parameters = {s = 1}}\noptions = {parameters = {s = 1}}",
        "axes.parameters.s",
        "found options.parameters.s as well, expected one of the two",
    ),
    ("", "axes.eps", "missing, expected the paper's epsilon; the time step is 2 eps (in axes or options)"),
    ("axes = 5", "axes", "found 5, expected a table of options with lists or ranges of values"),
    ("axes = {eps = 1}\ncolour = 1", "colour", "unknown key, expected one of task, system, options, axes, zip, limits"),
    ("axes = {eps = 1}\nparameters = {s = 1}", "parameters", "unknown key"),
    ("axes = {eps = 1}\nzip = [\"eps\"]", "zip[1]", "found 'eps', expected a list of lists of axes"),
    ("axes = {eps = 1, seed = 1}\nzip = [[\"eps\", 1]]", "zip[1][2]", "found 1, expected a list of lists of axes"),
    ("axes = {eps = 1, seed = 1}\nzip = [[\"eps\", \"sed\"]]", "zip[1]", "sed is not an axis; did you mean seed?"),
    ("axes = {eps = 1}\nzip = [[\"eps\", \"steps\"]]\noptions = {steps = 1}", "zip[1]", "steps is not an axis"),
    (
        "axes = {eps = [1, 2], seed = [1, 2], steps = [1, 2]}\nzip = [[\"eps\", \"seed\"], [\"steps\", \"eps\"]]",
        "zip[2]",
        "found eps twice, expected every axis in one zip at most",
    ),
    (
        "axes = {time_step = [1, 2], seed = [1, 2, 3]}\nzip = [[\"time_step\", \"seed\"]]",
        "zip[1]",
        "eps has 2, seed has 3 values, expected as many in each: a zip takes them together",
    ),
    ("axes = {time_step = 0, seed = 1}\nzip = [[\"eps\", \"seed\"]]", "axes.time_step", "found 0"),  # and no other
    ("axes = {eps = 1, parameters = {s = []}}\nzip = [[\"eps\", \"parameters.s\"]]", "axes.parameters.s", "found an e"),
    ("axes = {eps = 1}\nlimits = {time = 0}", "limits.time", "found 0, expected 0.001 to 1e+09 s, or none"),
    ("axes = {eps = 1}\nlimits = {time = \"5 minutes\"}", "limits.time", "found '5 minutes', expected seconds, or a t"),
    ("axes = {eps = 1}\nlimits = {memory = \"1 KB\"}", "limits.memory", "found '1 KB', expected bytes, or a text like"),
    ("axes = {eps = 1}\nlimits = {digits = 0}", "limits.digits", "found 0, expected a whole number of digits, at leas"),
    ("axes = {eps = 1}\nlimits = {ram = 5}", "limits.ram", "unknown key, expected one of time, memory, digits"),
    ("axes = {eps = 1, max_digits = 5}\nlimits = {digits = 5}", "limits.digits", "found axes.max_digits as well"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "key", "sentence"), ONE_MISTAKE)
def test_a_mistake_of_an_experiment_is_told_once_with_its_key(text, key, sentence):
    ((found, told),) = mistakes(LORENZ + text)
    assert found == f"experiments.a.{key}"
    assert told.startswith(sentence)


SYSTEMS = [
    ("5", "system", 'found 5, expected "family", a name of the catalogue, a path, or a list of these'),
    ('""', "system", "found '', expected"),
    ('["lorenz", 5]', "system", "found ['lorenz', 5], expected"),
    ("[]", "system", "found an empty list, expected at least one system"),
    ('"lorens"', "system", "found the unknown system 'lorens', did you mean lorenz?"),
    ('["lorenz", "nix.toml"]', "system[2]", "cannot read the system file"),
    ('"wrong.toml"', "system", "FOLDER/wrong.toml: 1 mistake\n  system.rhs[1]: found a polynomial of degree 3"),
    ('["lorenz", "lorenz"]', "system[2]", "found lorenz twice, expected every system once"),
    ('["members/one.toml", "members/*.toml"]', "system[2]", "found one twice, expected every system once"),
    ('"nix/*.toml"', "system", "found 0 files like 'nix/*.toml', expected 1 to 10000"),
    ('"/*.toml"', "system", "found '/*.toml', expected a pattern that ends in .toml and is relative to the folder"),
    ('"members/*"', "system", "found 'members/*', expected a pattern that ends in .toml"),
    ('"**/"', "system", "found '**/', expected a pattern that ends in .toml"),
    (
        '"members/notes.txt"',
        "system",
        "found 'members/notes.txt', expected a name of the catalogue or a path that ends",
    ),
    ('"members"', "system", "found "),
    (r'"a\u0000b.toml"', "system", "cannot read the system file"),
    (r'"a\u0000*.toml"', "system", "found "),
    ('["family", "lorenz"]', "system", 'found "family" among others, expected it alone: make another experiment'),
]


@pytest.mark.parametrize(("system", "key", "sentence"), SYSTEMS)
def test_a_wrong_system_is_told_once_with_its_key(folder, monkeypatch, system, key, sentence):
    monkeypatch.chdir(folder)
    text = LORENZ.replace('"lorenz"', system) + "axes = {eps = 1" + (", m = 2}" if "family" in system else "}")
    ((found, told),) = mistakes(text, folder=folder)
    assert found == f"experiments.a.{key}"
    assert told.startswith(sentence.replace("FOLDER", str(folder)))


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        ("eps = 1", [("axes.m", "missing, expected m (half the dimension), eigenvalues or chi in axes or options")]),
        ('eps = 1, m = 2, chi = "t^2 - 2"', [("axes.chi", "found axes.m as well, expected one of m and chi")]),
        ('eps = 1, m = 2, eigenvalues = "1,2"', [("axes.eigenvalues", "found axes.m as well")]),
        ('eps = 1, draw = "generic", chi = "t^2 - 2"', [("axes.chi", "found axes.draw as well")]),
        ('eps = 1, chi = "t +"', [("axes.chi", "found the end of the text")]),
        ('eps = 1, m = 2, chi = "t +"', [("axes.chi", "found the end"), ("axes.chi", "found axes.m as well")]),
        ("eps = 1, m = 17", [("axes.m", "found 17, expected a whole number from 1 to 16")]),
        (
            'eps = 1, m = 2, draw = "genric"',
            [("axes.draw", "found 'genric', expected one of eigenvalues, generic; did")],
        ),
        ('eps = 1, m = 2, signs = "1,0"', [("axes.signs", "found 0, expected 1 or -1")]),
        ("eps = 1, m = 2, parameters = {a = 1}", [("axes.parameters.a", "orbit has no such option")]),
    ],
)
def test_wrong_options_of_a_random_member_are_told_with_their_keys(axes, expected):
    found = mistakes(FAMILY + f"axes = {{{axes}}}")
    assert [key for key, _ in found] == [f"experiments.a.{key}" for key, _ in expected]
    assert all(told.startswith(words) for (_, told), (_, words) in zip(found, expected, strict=True))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            '[experiments.a]\ntask = "verify"\nsystem = "lorenz"',
            [("system", "lorenz is of kind [system], expected one of")],
        ),
        (
            '[experiments.a]\ntask = "verify"\nsystem = ["paper_m2", "lorenz"]',
            [("system[2]", "lorenz is of kind [system], expected one of kind [family]")],
        ),
        (
            COMMUTE + 'system = "lorenz"',
            [("system", "lorenz is of kind [system], expected one of kind [family], or a se")],
        ),
        (COMMUTE + 'system = "lorenz"\naxes = {other = "eulertop"}', [("axes.other", "found the unknown system")]),
        (COMMUTE + 'system = "lorenz"\naxes = {other = ["euler_top", "nix.toml"]}', [("axes.other[2]", "cannot read")]),
        (
            COMMUTE + 'system = "lorenz"\naxes = {other = ["euler_top", "euler_top"]}',
            [("axes.other[2]", "found euler_top twi")],
        ),
        (COMMUTE + 'system = "lorenz"\naxes = {other = []}', [("axes.other", "found [], expected a file")]),
        (COMMUTE + 'system = "lorenz"\naxes = {other = 5}', [("axes.other", "found 5, expected a file")]),
        (
            COMMUTE + 'system = "lorenz"\noptions = {other = ["riccati"]}',
            [("options.other", "found a list, expected one")],
        ),
        (
            COMMUTE + 'system = "lorenz"\noptions = {other = "family"}',
            [("options.other", "found the unknown system 'family'")],
        ),
        (
            COMMUTE + 'system = "family"\naxes = {m = 1, eps2 = 1}',
            [("axes.eps2", "found no other, expected one"), ("axes.eps2", "found no eps, expected one")],
        ),
        (SPACE + 'system = "paper_m2"\nlimits = {digits = 0}', [("limits.digits", "found 0, expected a whole number")]),
        (
            LORENZ + "axes = {eps = 1, seed = 1}\nzip = [['eps', 'seed'], ['eps']]",
            [("zip[2]", "found ['eps'], expected at least two axes")],
        ),
        (
            UNIVERSAL + 'system = "lorenz"\naxes = {m = 2}',
            [("system", "found 'lorenz', expected none: verify-universal")],
        ),
        (UNIVERSAL, [("axes.m", "missing, expected half the dimension (in axes or options)")]),
        (UNIVERSAL + "axes = {n = 2}", [("axes.n", "verify-universal has no such"), ("axes.m", "missing")]),
        (
            UNIVERSAL + "axes = {m = 2, parameters = {a = 1}}",
            [("axes.parameters.a", "verify-universal has no such option")],
        ),
        (UNIVERSAL + "axes = {m = 2, parameters = 5}", [("axes.parameters", "verify-universal has no such option")]),
        (UNIVERSAL + "axes = {m = 2, time_step = 5}", [("axes.time_step", "verify-universal has no such option")]),
        (
            UNIVERSAL + "axes = {m = 2}\noptions = {controls = 1}",
            [("options.controls", "found 1, expected true or false")],
        ),
        (SPACE + 'system = "paper_m2"\nlimits = {digits = 5}', [("limits.digits", "family-space has no digit budget")]),
        (
            '[experiments.a]\ntask = "orbit"\naxes = {eps = 1}',
            [("system", 'missing, expected "family", a name of the cat')],
        ),
        ('[experiments.a]\ntask = "orbot"\nsystem = "lorenz"', [("task", "there is no task 'orbot', expected one of")]),
        ('[experiments.a]\ntask = "orbot"', [("task", "there is no task 'orbot', expected one of")]),
        (
            '[experiments.a]\ntask = 5\nsystem = "lorenz"',
            [("task", "found 5, expected the name of a task, e.g. check-comm")],
        ),
        ("[experiments.a]", [("task", "missing, expected the name of a task, e.g. check-commute")]),
    ],
)
def test_what_does_not_fit_the_task_is_told_with_its_key(text, expected):
    found = mistakes(text)
    assert [key for key, _ in found] == [f"experiments.a.{key}" for key, _ in expected]
    assert all(told.startswith(words) for (_, told), (_, words) in zip(found, expected, strict=True))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", [("experiments", "missing, expected at least one table [experiments.NAME]")]),
        ("experiments = {}", [("experiments", "found {}, expected at least one table [experiments.NAME]")]),
        ("experiments = 5", [("experiments", "found 5, expected at least one table")]),
        ("[experiments]\na = 5", [("experiments.a", "found 5, expected a table")]),
        ("[[experiments]]\na = 5", [("experiments", "found [{'a': 5}], expected at least one table")]),
        (
            "colour = 1\n" + LORENZ + "axes = {eps = 1}",
            [("colour", "unknown key, expected one of name, limits, experime")],
        ),
        (
            "nam = 1\n" + LORENZ + "axes = {eps = 1}",
            [("nam", "unknown key, expected one of name, limits, experiments; di")],
        ),
        ("name = 5\n" + LORENZ + "axes = {eps = 1}", [("name", "found 5, expected text")]),
        (
            "limits = 5\n" + LORENZ + "axes = {eps = 1}",
            [("limits", "found 5, expected a table with time, memory, digits")],
        ),
        ("limits = {time = 0}\n" + LORENZ + "axes = {eps = 1}", [("limits.time", "found 0")]),
        (
            "limits = {ram = 0}\n" + LORENZ + "axes = {eps = 1}",
            [("limits.ram", "unknown key, expected one of time, memor")],
        ),
    ],
)
def test_a_mistake_outside_the_experiments_is_told_with_its_key(text, expected):
    found = mistakes(text)
    assert [key for key, _ in found] == [key for key, _ in expected]
    assert all(told.startswith(words) for (_, told), (_, words) in zip(found, expected, strict=True))


@pytest.mark.parametrize("name", ["a b", "", "a/b", "ä", "a" * 81, "\\u001b[31m", "a\\nb"])
def test_a_name_of_an_experiment_is_short_and_plain(name):
    ((key, sentence),) = mistakes(LORENZ.replace(".a]", f'."{name}"]') + "axes = {eps = 1}")
    assert key.startswith("experiments.")
    assert key.isprintable()
    assert sentence == "expected a name of at most 80 letters, digits and the characters _ . + -"


def test_nothing_in_a_message_is_obeyed_by_a_terminal():
    text = LORENZ + 'axes = {"\\u001b[31m" = 1, eps = "\\u001b[1m"}\nzip = [["eps", "\\u001b[0m"]]\n"\\u0007" = 1'
    text += '\n[experiments.b]\ntask = "\\u001b[1m"\nsystem = "\\u001b[1m"'
    with pytest.raises(SpecError) as caught:
        parse_spec(text)
    assert all(c.isprintable() or c == "\n" for c in str(caught.value))


# Texts that are no spec


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a = ", "Invalid value (at end of document)"),
        ("a = 1\na = 2", "Cannot overwrite a value (at line 2, column 6)"),
        (b"\xff", "not UTF-8 text: invalid start byte at byte 0"),
        (b'a = "\xc3"', "not UTF-8 text: invalid continuation byte at byte 5"),
        ("a = " + "[" * 100_000, "cannot be read: nested too deeply"),
        ("a = " + "1" * 5000, "cannot be read: write long numbers in quotes"),
    ],
)
def test_what_is_no_toml_is_told_in_a_sentence(text, sentence):
    ((key, told),) = mistakes(text)
    assert key == "TOML"
    assert told.split(" (")[0] == sentence.split(" (")[0]


def test_a_spec_is_not_larger_than_its_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(spec_module, "MAX_BYTES", 1000)
    path = tmp_path / "study.toml"
    path.write_text((LORENZ + "axes = {eps = 1}\n").ljust(1000))
    assert read_spec(path).size == 1
    path.write_text((LORENZ + "axes = {eps = 1}\n").ljust(1001))
    with pytest.raises(InputError, match=r"study\.toml is larger than 1000 bytes, the limit for a spec"):
        read_spec(path)


@pytest.mark.parametrize("name", ["nix.toml", "", "a\0b"])
def test_a_spec_that_cannot_be_read_is_told_in_a_sentence(tmp_path, name):
    with pytest.raises(InputError, match="cannot read the spec"):
        read_spec(f"{tmp_path}/{name}")


KEYS = st.sampled_from(
    [
        "task",
        "system",
        "options",
        "axes",
        "zip",
        "limits",
        "eps",
        "time_step",
        "m",
        "seed",
        "parameters",
        "name",
        "other",
    ]
)
LEAVES = st.sampled_from(
    [
        "1", "0", "-1", "true", "0.1", "[]", "{}", '"orbit"', '"check-commute"', '"family"', '"lorenz"', '"1..3"',
        '"1..0"', "1979-05-27", '""', "[1, 1]", '["eps", "m"]', '[["eps", "m"]]', '"*.toml"', "inf", '["1..2", 2]',
    ]
)  # fmt: skip


@st.composite
def documents(draw: Any) -> str:
    lines = [f"{draw(KEYS)} = {draw(LEAVES)}"] if draw(st.booleans()) else []
    for name in draw(st.lists(st.sampled_from("ab"), unique=True)):
        lines.append(f"[experiments.{name}]")
        lines.append(f"task = {draw(LEAVES)}" if draw(st.booleans()) else 'task = "orbit"')
        for key in draw(st.lists(KEYS.filter(lambda key: key != "task"), unique=True, max_size=4)):
            inner = ", ".join(f"{k} = {draw(LEAVES)}" for k in draw(st.lists(KEYS, unique=True, max_size=3)))
            lines.append(f"{key} = {draw(st.one_of(LEAVES, st.just(f'{{{inner}}}')))}")
    return "\n".join(lines)


@settings(max_examples=150)
@given(documents())
def test_every_document_is_a_spec_or_a_list_of_mistakes(tmp_path_factory, text):
    try:
        spec = parse_spec(text, folder=tmp_path_factory.getbasetemp() / "nothing")
    except SpecError as error:
        assert len(set(error.mistakes)) == len(error.mistakes)  # noqa: PT017
    else:
        assert isinstance(spec, Spec)
        assert all(Task.from_text(e[0].text) == e[0] for e in spec.experiments)


@settings(max_examples=100)
@given(st.binary(max_size=60))
def test_every_sequence_of_bytes_is_a_spec_or_wrong_input(data):
    with pytest.raises(InputError):
        parse_spec(data)


def test_a_system_file_is_told_from_a_spec():
    with pytest.raises(SpecError, match="a system file is for the other commands"):
        parse_spec('variables = ["x"]\n[system]\nrhs = ["x"]\n')
