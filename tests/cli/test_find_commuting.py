"""kahanmaps find-commuting: what commutes, what is trivial, what stays open, and the exit status."""

import shlex


def test_the_associated_systems_of_a_member_that_does_not_say_so(kahanmaps):
    rhs = kahanmaps("systems paper_m2 --json").json["rhs"]
    words = " ".join(f"--rhs='{text}'" for text in rhs)
    out = kahanmaps(f"find-commuting --vars x1,x2,x3,x4 {words}").out.splitlines()
    kind = "fields g = B f (B a constant rational matrix)"
    assert out[0] == f"# find-commuting: inline, {kind}, every eps (the time step is 2 eps)"
    assert out[1] == "bracket\tthe g with [f, g] = 0 have dimension 2"
    assert not any("trivial" in line for line in out)
    found = [line.split("\t")[2] for line in out if line.startswith("proved\tg and -g")]
    assert len(found) == 3  # 9 solutions: 0, f, -f and three pairs
    assert any("B = [[-5, 6, 0, 0], [-4, 5, 0, 0], [0, 4, -5, -4], [-4, 0, 6, 5]]" in line for line in out)
    assert out[-1] == f"# complete: among the {kind} only these, 0, f and -f commute with f"


def test_what_is_printed_can_be_pasted(kahanmaps, tmp_path):
    out = kahanmaps("find-commuting paper_m2").out.splitlines()
    pasted = next(line.split("\t")[2] for line in out if line.startswith("proved\tg and -g"))
    outcome = kahanmaps("check-commute", *(f"'{word}'" for word in shlex.split(pasted)), "paper_m2 --json")
    assert outcome.status == 0
    assert outcome.json["holds"] is True


def test_what_stays_open_gives_3(kahanmaps):
    command = "find-commuting --vars a,b,c,d --rhs a^2 --rhs 0 --rhs 0 --rhs 0 --shape quadratic"
    outcome = kahanmaps(command)
    assert outcome.status == 3
    assert "# undecided: there may be more; the fields g with [f, g] = 0 have dimension 31" in outcome.out
    assert "undecided: the fields g with [f, g] = 0 have dimension 31" in outcome.err
    quiet = kahanmaps(command, "-q --json")
    assert (quiet.status, quiet.err, quiet.json["status"], quiet.json["verdict"]) == (3, "", "undecided", "undecided")
