"""Right-hand sides as equations, in files: what they mean, and what is told where they cannot be meant."""

import pytest

import kahanmaps as km
from kahanmaps.documents.symbols import with_symbols

PLAIN = km.parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x*y", "-x"]', "plain").system
WRITTEN = [
    """rhs = "x' = x*y; y' = -x" """,
    """rhs = "dx/dt = x*y; dy/dt=-x;" """,
    """rhs = "d x / d t=x*y\\nd y/dt = -x" """,
    'rhs = """\nx\' = x*y\n\ny\' = -x\n"""',
    """rhs = ["x' = x*y", "y′ = -x"]""",
    """rhs = ["x'=x*y; dy/dt = -x"]""",
]


@pytest.mark.parametrize("rhs", WRITTEN)
def test_equations_are_read_as_the_system_that_they_mean(rhs):
    file = km.parse_system(f"[system]\n{rhs}", "plain")
    assert file.system == PLAIN
    assert km.parse_system(file.to_toml(), "again").system == PLAIN


def test_the_variables_have_the_order_of_the_list_where_there_is_one():
    file = km.parse_system('variables = ["y", "x"]\n[system]\nrhs = "x\' = x*y; y\' = -x"', "order")
    assert file.variables == ("y", "x")
    assert [str(polynomial) for polynomial in file.system.rhs] == ["-x", "y*x"]


def test_one_text_may_hold_right_hand_sides_alone():
    assert km.parse_system('variables = ["x", "y"]\n[system]\nrhs = "x*y; -x"', "alone").system == PLAIN


def test_parameters_stand_in_equations():
    text = "[system]\nrhs = \"x' = a*x*y; y' = -x\"\n[parameters]\na = 2"
    file = km.parse_system(text, "parameters")
    assert [str(polynomial) for polynomial in file.system.rhs] == ["2*x*y", "-x"]
    assert with_symbols(file, ["a"]).symbols == ("a",)
