"""Systems that cannot be read: a spec names all of them at once, or leaves them out, with a list in the database."""

import pytest

from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.run import plan
from kahanmaps.experiments.spec import SpecError, read_spec

GOOD = "[system]\nrhs = \"x' = y; y' = -x\"\n"
FILES = {
    "a.toml": GOOD,
    "b.toml": '[system]\nrhs = "x\' = z"\n',
    "c.toml": "nonsense",
    "d.toml": GOOD.replace("-x", "x*y"),
}
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


@pytest.mark.parametrize(
    "system", ['"members/*.toml"', '["members/a.toml", "members/b.toml", "members/c.toml", "nosuch"]']
)
def test_all_bad_files_are_named_at_once(spec, system):
    with pytest.raises(SpecError) as caught:
        read_spec(spec(ORBITS.replace('"members/*.toml"', system)))
    said = str(caught.value)
    assert "members/b.toml: 1 mistake" in said
    assert "members/c.toml: 1 mistake" in said
    assert "a.toml: " not in said
    assert ("unknown system 'nosuch'" in said) is ("nosuch" in system)


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
    with pytest.raises(SpecError, match=f"system.2.: {messages}"):
        read_spec(text)
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
