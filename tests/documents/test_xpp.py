"""Files of XPP (.ode): the equations and parameters that they say, and the lines that are refused."""

import pytest
from flint import fmpq

import kahanmaps as km
from kahanmaps.errors import InputError

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
        "names are in lower case: XPP does not tell upper from lower case",
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
