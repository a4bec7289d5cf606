"""Right-hand sides as equations, in files, those of XPP too: what they mean, and what is told where they cannot be
meant.
"""

import pytest
from flint import fmpq
from helpers import together

import kahanmaps as km
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.errors import InputError

PLAIN = km.parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x*y", "-x"]', "plain").system
WRITTEN = [
    """rhs = "x' = x*y; y' = -x" """,
    """rhs = "dx/dt = x*y; dy/dt=-x;" """,
    """rhs = "d x / d t=x*y\\nd y/dt = -x" """,
    'rhs = """\nx\' = x*y\n\ny\' = -x\n"""',
    """rhs = ["x' = x*y", "y′ = -x"]""",
    """rhs = ["x'=x*y; dy/dt = -x"]""",
    """rhs = "dx/dt = x*y, dy/dt = -x" """,
    """rhs = "x'[t] == x[t]*y[t], y'[t] == -x[t]" """,
    """rhs = "{x'[t] == x[t]*y[t], D[y[t], t] == -x[t]}" """,
    """rhs = "[diff(x(t), t) = x(t)*y(t), diff(y(t), t) = -x(t)]" """,
    """rhs = "eqs := {diff(x(t), t) = x(t)*y(t), diff(y(t), t) = -x(t)};" """,
    """rhs = "eqs = [x' = x*y, y' = -x];" """,
    """rhs = "D(x)(t) = x(t)*y(t); Derivative(y(t), t) = -x(t)" """,
    """rhs = "x_dot = x*y; ydot = -x" """,
    """rhs = "dx(t)/dt = x(t)*y(t); dydt = -x(t)" """,
    """rhs = "ẋ = x*y; y’ = -x" """,
    """rhs = "x'(t) = x*y; y(t)' = -x(t)" """,
]


@pytest.mark.parametrize("rhs", WRITTEN)
def test_equations_are_read_as_the_system_that_they_mean(rhs):
    file = km.parse_system(f"[system]\n{rhs}", "plain")
    assert file.system == PLAIN
    assert km.parse_system(file.to_toml(), "again").system == PLAIN


def test_parameters_stand_in_equations():
    text = "[system]\nrhs = \"x' = a*x*y; y' = -x\"\n[parameters]\na = 2"
    file = km.parse_system(text, "parameters")
    assert [str(polynomial) for polynomial in file.system.rhs] == ["2*x*y", "-x"]
    assert with_symbols(file, ["a"]).symbols == ("a",)


@pytest.mark.parametrize(
    "text",
    ["x'' = x^2 - x - 2*x'", "d^2x/dt^2 = x^2 - x - 2*dx/dt", "x_ddot = x^2 - x - 2*x_dot", "x″ = x^2 - x - 2*x′"],
)
def test_an_equation_of_second_order_has_a_velocity_and_a_note_says_its_name(text):
    file = km.System(text)
    assert str(file.system) == "x' = vx\nvx' = x^2 - x - 2*vx"
    assert file.notes == ("x'' is read with a velocity, the variable vx: x' = vx",)


def test_an_index_becomes_part_of_a_name_that_no_other_has():
    file = km.System("x[0]' = x[0] - x[1]; x[1]' = x0*x[0]", x0=3)
    assert str(file.system) == "x_0' = x_0 - x1\nx1' = 3*x_0"
    assert file.notes == ("x[0] is called x_0", "x[1] is called x1")


REFUSED = {
    "x''' = x": "x' = u; u' = v; v' = ...",
    "a = 2; x' = a*x": "-p a=2",
    "x(0) = 1, x' = x": "--start",
    "x~ = x*y": "--image",
    "x(t+1) = x": "--image",
    "dx = x*y; dy = x": "did you mean dx/dt",
    r"\dot{x} = x y": "LaTeX is not read: write x' = ...",
    r"\ddot x = -x": "LaTeX is not read: write x'' = ...",
    r"\frac{dx}{dt} = x y": "LaTeX is not read: write x' = ...",
    "x' = y'; y' = x": "a derivative of y on the right side of the equation for x",
    "x' = y; x' = 1": "two equations for x",
    "x' = x = y": "an equation such as x' = x*y",
    "= x": "an equation such as x' = x*y",
    "x' = (x; y' = x": "a bracket is opened that is not closed",
    "x' = x); y' = x": "a bracket is closed that was not opened",
    "x' = [x)*y; y' = x": "without its '('",
    "x' =": "found nothing, expected an expression",
    "x' = sin(x)": "looks like a function call",
    "x' = ′": "found the character",
    "d^2x/dt = x": "an equation such as",
    "D[x[t], t] == __import__('os')": "found",
    "ξ' = x": "an equation such as",
    "x' = eps^2*x; eps' = x": "rename it",
    "x' = x^3": 'write discretization = "polarised" into',
    "x' = x^4": 'write discretization = "polarised" and degree = 4 into',
    "x'" * 100_000 + " = x": "expected an equation",
    "(" * 100_000 + "x' = x": "a bracket is opened",
    "x' = " + "(" * 100_000 + "x" + ")" * 100_000: "characters, expected at most",
    "x" + "'" * 100_000 + " = 1": "order 1 or 2",
    "x' = 1;" * 300_000: "characters, expected at most",
    "x[" + "9" * 10_000 + "]' = 1": "an equation such as",
}


@together("text, words", REFUSED.items())
def test_what_is_no_equation_is_refused_with_what_to_write(text, words):
    with pytest.raises(InputError) as caught:
        km.System(text)
    assert words in str(caught.value)
    assert len(str(caught.value)) < 2000


@pytest.mark.parametrize("word", ["polarised", "polarized"])
def test_a_cubic_field_is_read_with_the_discretization_that_the_message_names(word):
    result = km.parse_system(f'[system]\nrhs = "x\' = x^3"\ndiscretization = "{word}"').map
    assert result.title == "polarised map"
    assert result.at("1/4").step(["1/2", "1/3"]) == (fmpq(1, 3), fmpq(3, 5))  # as in maps/polarised.py


LORENZ = """# the Lorenz equations, as XPP's own example has them
init x=-7.5  y=-3.6  z=30
par r=27  s=10 , b=2.66666
x'=s*(-x+y)
Y'=r*X-y-x*z
dz/dt=-b*z+x*y
aux e=x^2+sin(y)
@ dt=.025, total=40, xplot=x
done
this is not read
"""


def test_equations_and_parameters_are_read_exactly():
    file = km.parse_system(LORENZ, "lorenz.ode")
    assert (file.name, file.variables) == ("lorenz", ("x", "y", "z"))
    assert file.parameters == {"r": 27, "s": 10, "b": fmpq(266666, 100000)}
    assert file.system == km.load("lorenz", s=10, r=27, b="2.66666").system


def test_what_is_left_out_is_said():
    assert km.parse_system(LORENZ, "lorenz.ode").notes == (
        "names are in lower case: XPP does not distinguish upper and lower case",
        "the initial values x = -7.5, y = -3.6, z = 30 are left out: --start gives them, in the order of the variables",
        "left out, being about the integration: aux, @",
    )


@pytest.mark.parametrize(
    ("lines", "rhs"),
    [
        ("q=x+y\nx'=q*x\ny'=2*q", ["x^2 + x*y", "2*x + 2*y"]),
        ("x'=q*x\ny'=r\nq=x+1\nr=q-y", ["x^2 + x", "x - y + 1"]),  # definitions follow their use
        ("par a=3\n!b=a/2\nx'=b*y\ny'=-x", ["3/2*y", "-x"]),
        ("p a=1,b=-2 c=.5\nnumber d=1e-3\nx'=a*x+b*y\ny'=c+d", ["x - 2*y", "501/1000"]),
        ("x(0)=1\nx'=y\\\n+1\ny'=x", ["y + 1", "x"]),
        ("x''=-x+x^2", ["vx", "x^2 - x"]),
    ],
)
def test_values_and_definitions_stand_in_the_places_of_their_names(lines, rhs):
    assert [str(f) for f in km.parse_system(lines, "a.ode").system.rhs] == rhs


@pytest.mark.parametrize(
    ("lines", "line"),
    [
        ("x'=x\nf(v)=v*v", "line 2"),
        ("x'=x\nmarkov z 2\n{0} {1}\n{1} {0}", "line 2"),
        ("x[0..20]'=x[j]", "line 1"),
        ("x(t+1)=x", "line 1"),
        ("par a=1;b=2\nx'=x", "line 1"),
        ("x'=x\nglobal 1 x-1 {x=0}", "line 2"),
        ("", "found no equations"),
        ("# nothing", "found no equations"),
        ("par a=b\nx'=a*x", "parameters.a"),
        ("par a\nx'=a*x", "line 1: found the parameter 'a' without a value, expected one: par a=0"),
        ("par b=1, a c=2\nx'=a*x", "par a=0"),
        ("par eps=1\nx'=eps*x", "rename it"),
        ("x'=x^3", 'discretization = "polarised"'),
        ("\x00\x1b[31m", "line 1"),
        ("q=x\n" + "q=q*q\n" * 100 + "x'=q", "characters after its definitions are inserted"),
        ("\n".join(f"f{k}(x)=x" for k in range(1000)), "and 950 more"),
    ],
)
def test_what_would_change_the_equations_is_refused_with_its_line(lines, line):
    with pytest.raises(InputError) as caught:
        km.parse_system(lines, "a.ode")
    assert line in str(caught.value)
    assert "\x1b" not in str(caught.value)
