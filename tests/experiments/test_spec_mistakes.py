"""Mistakes of specs: every one is told once, at its place, all at once; so are all systems that cannot be read."""

import re
from pathlib import Path

import pytest
from helpers import refuses, table, together
from hypothesis import given, settings
from hypothesis import strategies as st
from specs import LORENZ, mistakes

from kahanmaps.experiments.results.records import Task
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.run import plan
from kahanmaps.experiments.spec import Spec, SpecError, parse_spec, read_spec


def test_a_spec_error_counts_its_mistakes_and_shows_them():
    said = r"^study.toml: 2 mistakes\n  name: .*\n  experiments.a.task: there is no task 'orbot', expected one of"
    refuses(said, parse_spec, 'name = 5\n[experiments.a]\ntask = "orbot"', "study.toml", error=SpecError)


CASES = {
    heading: [tuple(part.replace("\\n", "\n") for part in line.split(" => ")) for line in lines]
    for heading, lines in table(Path(__file__).with_name("spec_mistakes.txt")).items()
}
SYSTEMS = CASES.pop("a system")


@together("text, expected", [case for cases in CASES.values() for case in cases])
def test_a_mistake_is_reported_once_with_its_key(text, expected):
    required = [words.split(": ", 1) for words in expected.split(" ;; ")]
    result = mistakes(text)
    assert [key for key, _ in result] == [key for key, _ in required]
    assert all(message.startswith(words) for (_, message), (_, words) in zip(result, required, strict=True))


@pytest.mark.parametrize(("system", "expected"), SYSTEMS)
def test_a_wrong_system_is_reported_once_with_its_key(folder, monkeypatch, system, expected):
    monkeypatch.chdir(folder)
    text = LORENZ.replace('"lorenz"', system) + "axes = {eps = 1" + (", m = 2}" if "family" in system else "}")
    ((result, messages),) = mistakes(text, folder=folder)
    key, sentence = expected.split(": ", 1)
    assert result == f"experiments.a.{key}"
    assert messages.startswith(sentence.replace("FOLDER", str(folder)))


def test_nothing_in_a_message_is_obeyed_by_a_terminal():
    text = LORENZ + 'axes = {"\\u001b[31m" = 1, eps = "\\u001b[1m"}\nzip = [["eps", "\\u001b[0m"]]\n"\\u0007" = 1'
    text += '\n[experiments.b]\ntask = "\\u001b[1m"\nsystem = "\\u001b[1m"'
    with pytest.raises(SpecError) as caught:
        parse_spec(text)
    assert all(c.isprintable() or c == "\n" for c in str(caught.value))


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
def test_invalid_toml_is_refused_in_a_sentence(text, sentence):
    ((key, messages),) = mistakes(text)
    assert key == "TOML"
    assert messages.split(" (")[0] == sentence.split(" (")[0]


KEYS = ["task", "system", "options", "axes", "zip", "limits", "eps", "time_step", "m", "seed", "parameters", "name"]
KEYS = st.sampled_from([*KEYS, "other"])
LEAVES = st.sampled_from(
    [
        "1", "0", "-1", "true", "0.1", "[]", "{}", '"orbit"', '"check-commute"', '"family"', '"lorenz"', '"1..3"',
        '"1..0"', "1979-05-27", '""', "[1, 1]", '["eps", "m"]', '[["eps", "m"]]', '"*.toml"', "inf", '["1..2", 2]',
    ]
)  # fmt: skip


@st.composite
def documents(draw):
    lines = [f"{draw(KEYS)} = {draw(LEAVES)}"] if draw(st.booleans()) else []
    for name in draw(st.lists(st.sampled_from("ab"), unique=True)):
        lines.append(f"[experiments.{name}]")
        lines.append(f"task = {draw(LEAVES)}" if draw(st.booleans()) else 'task = "orbit"')
        for key in draw(st.lists(KEYS.filter(lambda key: key != "task"), unique=True, max_size=4)):
            inner = ", ".join(f"{k} = {draw(LEAVES)}" for k in draw(st.lists(KEYS, unique=True, max_size=3)))
            lines.append(f"{key} = {draw(st.one_of(LEAVES, st.just(f'{{{inner}}}')))}")
    return "\n".join(lines)


@settings(max_examples=30)
@given(documents())
def test_every_document_is_a_spec_or_a_list_of_mistakes(tmp_path_factory, text):
    try:
        spec = parse_spec(text, folder=tmp_path_factory.getbasetemp() / "nothing")
    except SpecError as error:
        assert len(set(error.mistakes)) == len(error.mistakes)  # noqa: PT017
    else:
        assert isinstance(spec, Spec)
        assert all(Task.from_text(e[0].text) == e[0] for e in spec.experiments)


GOOD = "[system]\nrhs = \"x' = y; y' = -x\"\n"
FILES = {"a.toml": GOOD, "b.toml": '[system]\nrhs = "x\' = z"\n', "c.toml": "?", "d.toml": GOOD.replace("-x", "x*y")}
SPEC = '[experiments.o]\ntask = "{task}"\nsystem = {system}\noptions = {{ {options} }}\n'
ORBITS = SPEC.format(task="orbit", system='"members/*.toml"', options='eps = "1/10", steps = 2')


@pytest.fixture
def spec(tmp_path):
    (tmp_path / "members").mkdir()
    for name, text in FILES.items():
        (tmp_path / "members" / name).write_text(text)

    def written(text):
        path = tmp_path / "spec.toml"
        path.write_text(text)
        return path

    return written


@pytest.mark.parametrize("system", ['"members/*.toml"', '["members/a.toml", "members/b.toml", "members/c.toml", "no"]'])
def test_all_bad_files_are_named_at_once(spec, system):
    with pytest.raises(SpecError) as caught:
        read_spec(spec(ORBITS.replace('"members/*.toml"', system)))
    said = re.findall(r"members/\w\.toml: \d mistake|unknown system '\w+'", str(caught.value))
    unknown = ["unknown system 'no'"] if '"no"' in system else []
    assert said == ["members/b.toml: 1 mistake", "members/c.toml: 1 mistake", *unknown]


@pytest.mark.parametrize(
    ("text", "skip_bad"),
    [(ORBITS, True), ('on_error = "skip"\n' + ORBITS, False), (ORBITS + 'on_error = "skip"\n', False)],
)
def test_they_are_left_out_where_that_is_asked_for(spec, text, skip_bad):
    [experiment] = read_spec(spec(text), skip_bad=skip_bad).experiments
    assert [task.system["name"] for task in experiment.tasks()] == ["a", "d"]
    assert [system for system, _ in experiment.skipped] == ["members/b.toml", "members/c.toml"]
    assert all("1 mistake" in reason for _, reason in experiment.skipped)


def test_a_system_of_the_wrong_kind_for_the_task_is_left_out_too(spec):
    text = SPEC.format(task="family-space", system='["members/a.toml", "paper_m2"]', options="")
    [experiment] = read_spec(spec(text), skip_bad=True).experiments
    assert [task.system["name"] for task in experiment.tasks()] == ["paper_m2"]
    assert "expected one of kind [family]" in experiment.skipped[0][1]


def test_a_file_that_says_the_same_as_another_is_named_with_it_or_left_out(spec, tmp_path):
    (tmp_path / "members" / "copy").mkdir()
    (tmp_path / "members" / "copy" / "a.toml").write_text(GOOD)
    text = spec(ORBITS.replace('"members/*.toml"', '["members/a.toml", "members/copy/*.toml"]'))
    messages = "found a twice, expected every system once: members/copy/a.toml says the same as members/a.toml"
    refuses(f"system.2.: {messages}", read_spec, text, error=SpecError)
    [experiment] = read_spec(text, skip_bad=True).experiments
    assert [task.system["name"] for task in experiment.tasks()] == ["a"]
    assert experiment.skipped == (("members/copy/a.toml", messages),)


def test_the_list_is_in_the_database_and_follows_the_plan(spec, tmp_path):
    path = spec(ORBITS)
    with Store.open(tmp_path / "a.db", create=True) as store:
        plan(read_spec(path, skip_bad=True), store)
        assert [system for system, _ in store.status()[0].skipped] == ["members/b.toml", "members/c.toml"]
        (tmp_path / "members" / "b.toml").write_text(GOOD.replace("-x", "-2*x"))
        plan(read_spec(path, skip_bad=True), store)
        [status] = store.status()
        assert (status.tasks, [system for system, _ in status.skipped]) == (3, ["members/c.toml"])
        with Store.open(tmp_path / "b.db", create=True) as other:
            other.merge(tmp_path / "a.db")
            assert other.status()[0].skipped == status.skipped
