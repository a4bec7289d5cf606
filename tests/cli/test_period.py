"""kahanmaps period: members that do not say so; what it says of others is in said.txt."""

M3 = "paper_m3 --start 1,2,3,4,5,6 --eps 1/11"


def test_recognised_members_have_periods(kahanmaps):
    # the right-hand sides of paper_m3, with nothing said of A
    rhs = kahanmaps("systems paper_m3 --json").json["rhs"]
    words = " ".join(f"--rhs='{text}'" for text in rhs)
    command = f"--vars x1,x2,x3,x4,x5,x6 {words} --start 1,2,3,4,5,6 --eps 1/11 --arithmetic mod:10007 --json"
    hidden = kahanmaps(f"period {command}").json
    assert hidden["structure"].startswith("a recognised member")
    assert hidden["period"] == kahanmaps(f"period {M3} --arithmetic mod:10007 --json").json["period"]
