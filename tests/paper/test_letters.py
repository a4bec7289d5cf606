"""The letters for which the library has code of its own are what the formulas of the paper give.

Objects of a member take the chain, the associated systems, the integrals and Pi from the library; changed ones have
none of its code but that of a quadratic system and its Kahan map, and compute everything from A and the third
derivatives of H.
"""

import random

import pytest
from flint import fmpq
from paper.members import member, values

from kahanmaps.algebra.fields import QQ
from kahanmaps.paper import specialize

# Letter -> what gives it, for every index i of a root.
LETTERS = {
    "H_i": lambda o, i: o.H(o.x, i),
    "nabla H_i": lambda o, i: o.gradient_of_chain(i, o.x),
    "f_i": lambda o, i: o.value(o.f_(i), o.x),
    "f_i'": lambda o, i: o.jac(o.f_(i), o.x),
    "B_i": lambda o, i: o.B(i),
    "B_s": lambda o, i: o.B_signs([-1 if j <= i else 1 for j in o.each]),
    "x~": lambda o, i: o.step(o.f, o.x, times=i + 1),
    "dPhi": lambda o, i: o.jacobian_of_step(o.f_(i), o.x),
    "H~": lambda o, i: o.H_tilde(o.x),
    "K~_i": lambda o, i: o.integral(o.g_(i), o.x),
    "modified H": lambda o, i: o.modified_H(o.x),
    "Pi": lambda o, i: o.Pi(o.x),
}


@pytest.mark.parametrize("name", ["m=2, split", "m=3, split"])
@pytest.mark.parametrize("letter", LETTERS)
def test_a_letter_of_the_library_is_that_of_the_formulas(name, letter):
    result = member(name)
    roots = specialize.rational_roots(result)
    library = specialize.point_over(result, QQ, roots, fmpq(1, 7), random.Random(name), 3)
    formulas = library.changed(base=None, known_chi=None, draw=library.vector)
    other = formulas.changed(third=library.third * fmpq(2), roots=roots[::-1], draw=library.vector)
    ours, theirs, wrong = ([values(LETTERS[letter](o, i)) for i in o.each] for o in (library, formulas, other))
    assert ours == theirs
    assert ours != wrong
