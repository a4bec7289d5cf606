"""kahanmaps convert, certificate: whole files or standard output, and what was wrong where there is none."""


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


def test_the_command_in_the_comment_writes_the_same_certificate_again(kahanmaps):
    first = kahanmaps("certificate --vars=x,y '--image=y; (3 + y)/x' --for gp --integral '(x+1)*(y+1)*(x+y+3)/(x*y)'")
    assert (first.status, first.err) == (0, "")
    (line,) = [line for line in first.out.splitlines() if "kahanmaps certificate" in line]
    assert kahanmaps(line.split("kahanmaps ", 2)[2]).out == first.out


def test_a_false_claim_is_refuted_with_status_1_and_writes_nothing(kahanmaps, tmp_path):
    outcome = kahanmaps("certificate euler_top --for rocq --integral x1^2+x2^2 -o", tmp_path / "top.v")
    assert (outcome.status, outcome.out) == (1, "")
    assert outcome.err == "refuted: I1 is not conserved: no certificate can be written\n"
    assert list(tmp_path.iterdir()) == []


def test_a_certificate_goes_to_a_file(kahanmaps, tmp_path):
    path = tmp_path / "top.v"
    outcome = kahanmaps("certificate euler_top --for rocq --claim F1 -o", path)
    assert (outcome.status, outcome.out) == (0, "")
    assert outcome.err == f"{path}: euler_top: a certificate for rocq, {len(path.read_text().splitlines())} lines\n"
    assert kahanmaps("certificate euler_top --for rocq --claim F1 -q -o", path).err == ""


def test_a_system_of_which_nothing_is_known_is_refused_with_what_to_type(kahanmaps):
    outcome = kahanmaps("certificate lorenz --for gp")
    assert outcome.status == 2
    assert "kahanmaps find-integrals lorenz --toml" in outcome.err
