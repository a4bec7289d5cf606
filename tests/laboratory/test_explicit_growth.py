"""Growth of maps that are given by formulas: exceptional hypersurfaces by the affine Jacobian, and published rates."""

import pytest
from degree_helpers import by_formulas

from kahanmaps.documents.catalog import load
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.singular import written
from kahanmaps.laboratory.singular.singularities import singularities
from kahanmaps.maps.projective import homogeneous_map

DIMENSION_5 = "b; c; d; e; 3/(b*c*d*e) - a - b - c - d - e"


@pytest.mark.parametrize(
    ("variables", "image"),
    [
        ("x,y", "y; -x + 1/y^3"),
        ("x,y", "y; (1 + y)/x"),
        ("x,y", "y/1000; -1000*x + 7/(y^2 - 3)"),
        ("x,y", "x*(1 - y)/(1 + x*y); y*(x + 1)^2/(x - y^2)"),
        ("x,y,z", "y; z; (y + z^2)/(x*(1 + y*z))"),
        ("a,b,c,d", "b; c; d; 3/(b*c*d) - a - b - c - d"),
        ("x,y", "x + y^2; y"),  # contracts nothing but infinity
    ],
)
def test_the_affine_jacobian_has_the_factors_of_the_homogeneous_one(variables, image, monkeypatch):
    forms = homogeneous_map(by_formulas(variables, image).at(1))
    expanded, degree = written.written(forms)
    monkeypatch.setattr(written, "_is_short", lambda size, degree: False)
    by_affine_map, same_degree = written.written(forms)
    assert (sorted(map(repr, by_affine_map)), same_degree) == (sorted(map(repr, expanded)), degree)


@pytest.mark.parametrize("name", ["lotka_volterra", "euler_top", "dressing_chain_3"])
def test_the_affine_jacobian_of_kahan_maps(name):
    forms = homogeneous_map(load(name).map.at(1)).forms
    homogeneous = written._critical_factors(forms, len(forms) * (forms[0].total_degree() - 1))
    finite = {str(factor.subs({"z": 1})): k for factor, k in homogeneous}
    finite.pop("1", None)
    assert {str(factor): k for factor, k in written.factors_at_finite_points(forms)} == finite


def test_the_hypersurfaces_of_a_map_of_dimension_5_are_written():
    run = singularities(by_formulas("a,b,c,d,e", "b; c; d; e; 1/(b*c*d*e) - a"), 1)
    assert (str(run.verdict), run.critical_degree) == ("confined", 24)
    assert [(h.polynomial, h.multiplicity) for h in run.hypersurfaces] == [(x, 6) for x in "edcb"]


@pytest.mark.parametrize(
    ("variables", "image"),
    [("a,b,c,d", "b; c; d; 3/(b*c*d) - a - b - c - d"), ("a,b,c,d,e", DIMENSION_5)],
)
def test_published_maps_of_dimension_4_and_5_have_derived_quadratic_growth(variables, image):
    growth = degree_growth(by_formulas(variables, image), max_terms=20)
    assert (str(growth.growth), growth.derived is not None) == ("quadratic", True)


@pytest.mark.parametrize(("k", "rate"), [(3, "3"), (5, "5"), (4, "t^2 - 4*t + 1"), (6, "t^2 - 6*t + 1")])
def test_the_published_rates_of_a_planar_family(k, rate):
    growth = degree_growth(by_formulas("x,y", f"y; -x + 1/y^{k}"), enclosed=False)
    assert growth.derived is not None
    assert growth.dynamical_degree.text.endswith(rate)
