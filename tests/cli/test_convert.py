"""kahanmaps convert: whole files or standard output, and what was wrong where there is none."""


def test_the_command_in_the_comment_makes_the_same_file_again(kahanmaps):
    line = "convert --vars=I,y --rhs=I*y --rhs='-2/3*I^2' --to pari --what map,jacobian --name two"
    first = kahanmaps(line).out
    (messages,) = [text for text in first.splitlines() if "kahanmaps convert" in text]
    assert kahanmaps(messages.split("kahanmaps ", 2)[2]).out == first


def test_an_inline_system_becomes_a_system_file(kahanmaps, tmp_path):
    system = "--vars x,y --rhs=a*x*y --rhs=-x^2 -p a=2/3"
    path = tmp_path / "own.toml"
    assert kahanmaps(f"convert {system} --to toml -o", path).status == 0
    start = "--start 1,2 --eps 1/10 --steps 3 --format csv"
    assert kahanmaps("orbit", path, start).out == kahanmaps(f"orbit {system} {start}").out
    assert kahanmaps("convert", path, "--to toml").out == path.read_text()
    assert kahanmaps("convert", path, "--to toml -p a=1").out != path.read_text()


def test_a_file_is_written_whole_and_named_on_standard_error(kahanmaps, tmp_path):
    path = tmp_path / "top.jl"
    outcome = kahanmaps("convert euler_top --to julia -o", path)
    assert (outcome.status, outcome.out) == (0, "")
    assert outcome.err == f"{path}: euler_top for julia, {len(path.read_text().splitlines())} lines\n"
    assert [file.name for file in tmp_path.iterdir()] == ["top.jl"]
    assert path.read_text() == kahanmaps("convert euler_top --to julia").out
    assert kahanmaps("convert euler_top --to julia -q -o", path).err == ""
