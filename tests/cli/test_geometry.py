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


def test_components_and_density_are_proved_or_supported(kahanmaps):
    text = kahanmaps("geometry nahm_tetrahedral --start 1,2 --eps 1/10").out
    assert "real components\t1\norbit\tdense in the real components that it visits (proved: " in text
    record = kahanmaps("geometry paper_m2 --start 1,2,3,5 --eps 1/10 --json").json
    assert record["components"] == 2
    assert (record["closure"]["dense"], record["closure"]["status"]) == (None, "supported")
    text = kahanmaps("geometry paper_m3_irreducible --start 1,2,3,4,5,6 --eps 1/10").out
    assert "0.74486177j, on a connected torus of real dimension 2\n" in text
    assert "Zariski dense (proved: no two curves are isogenous modulo 211)" in text


def test_a_system_that_is_not_declared_as_a_member_is_recognized(kahanmaps):
    outcome = kahanmaps("geometry --vars x,y --rhs 3*y^2 --rhs=-3*x^2 --start 1,2 --eps 1/10")
    assert "k^3\t-2187/46225" in outcome.out


def test_the_curve_of_an_orbit_of_another_map_is_found(kahanmaps):
    text = kahanmaps("geometry mcmillan --start 1/3,2/5").out
    assert "Weierstrass model\ty^2 = x^3 + A x + B, A = -7323, B = 229622\n" in text
    record = kahanmaps("geometry mcmillan --start 1/3,2/5 --json").json
    assert (record["genus"], record["A"], record["B"], record["order"]) == (1, "-7323", "229622", None)
    assert f"j-invariant\t{record['j']}\n" in text


def test_orbits_without_a_curve_are_undecided_and_wrong_points_are_refused(kahanmaps):
    outcome = kahanmaps("geometry lorenz --start 1,2,3 --eps 1/10")
    assert outcome.status == 3
    assert outcome.err.startswith("Error: undecided: no curve of genus 0 or 1 was found")
    outcome = kahanmaps("geometry paper_m2 --start 1,2 --eps 1/10")
    assert outcome.status == 2
    assert "found a point with 2 coordinates, expected 4" in outcome.err
