"""kahanmaps geometry: the same numbers as text and as JSON, and errors that say what to type."""


def test_text_and_json_have_the_same_curve(kahanmaps):
    text = kahanmaps("geometry nahm_tetrahedral --start 1,2 --eps 1/10").out
    (plane,) = kahanmaps("geometry nahm_tetrahedral --start 1,2 --eps 1/10 --json").json["planes"]
    assert plane["delta"] == "1/16875"
    assert plane["gamma"] == "16874/16875"
    assert plane["order"] is None
    assert f"j-invariant\t{plane['j']}\n" in text
    assert "rotation number\t[0.0367013173715" in text
    assert plane["rotations"][0]["numbers"][0].startswith("[0.0367013173715")
    assert "translation\t(0, 134992/16875), infinite order" in text
    assert plane["point"] == ["0", "134992/16875"]
    assert "  bad primes\t2, 5, 11, 13, 59\n" in text
    assert plane["bad_primes"]["bad"] == ["2", "5", "11", "13", "59"]


def test_orbits_without_a_curve_are_undecided_and_wrong_points_are_refused(kahanmaps):
    outcome = kahanmaps("geometry lorenz --start 1,2,3 --eps 1/10")
    assert outcome.status == 3
    assert outcome.err.startswith("Error: undecided: no curve of genus 0 or 1 was found")
    outcome = kahanmaps("geometry paper_m2 --start 1,2 --eps 1/10")
    assert outcome.status == 2
    assert "found a point with 2 coordinates, expected 4" in outcome.err
