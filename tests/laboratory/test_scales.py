"""Answers go along with x -> D x, permutations of the variables and of time: every search on a system and its images.

D has entries up to 10^6 and down to 1/10^6. What a search finds for an image is moved back to the variables of the
system, exactly, and is what it finds there.
"""

import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import pytest
from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps import Laboratory, commuting_systems, find_densities, find_integrals, find_poisson, linear_symmetries
from kahanmaps.algebra.polynomials import RationalFunction, primitive_part, ring
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import darboux_polynomials

FIELDS = {
    "lorenz": ["10*(y - x)", "x*(28 - z) - y", "x*y - 20*z"],  # x^2 - 20 z
    "euler": ["y*z", "-2*x*z", "x*y"],
    "volterra": ["x*(y - z)", "y*(z - x)", "z*(x - y)"],
    "periodic": ["x*(y - w)", "y*(z - x)", "z*(w - y)", "w*(x - z)"],
    "conjugate": ["x^2 + 2*y^2 - 1", "2*x*y"],  # conjugate lines of special members of a pencil
    "double": ["(x + 3*y)^2 - 3*x*y", "x*y"],  # x + 3 y, and y = 0 twice
    "predators": ["x*(1 - y)", "y*(x - 1)"],
    "weighted": ["y", "x^2"],
}
MAPS = {"lyness": ["y", "(y + 5)/x"], "todd": ["y", "z", "(3 + y + z)/x"], "fibonacci": ["y", "x*y"]}
D = [Fraction(100000), Fraction(1, 7), Fraction(3, 10**6), Fraction(1000, 999)]


@dataclass(frozen=True)
class Image:
    """An image of a system: y_place[i] = scale[i] x_i, and time runs `speed` times as fast."""

    file: SystemFile
    scale: list[Fraction]
    place: list[int]
    speed: Fraction

    def back(self, function: RationalFunction | fmpq_mpoly) -> RationalFunction:
        """A function of y and eps as one of x and eps."""
        if isinstance(function, fmpq_mpoly):
            function = RationalFunction(function, function.context().constant(1))
        context = function.numerator.context()
        gens, moved = context.gens(), list(context.gens())
        for i, (place, c) in enumerate(zip(self.place, self.scale, strict=True)):
            moved[place] = gens[i] * fmpq(c.numerator, c.denominator)
        if len(gens) > len(self.place):
            moved[-1] = gens[-1] / fmpq(self.speed.numerator, self.speed.denominator)
        return RationalFunction(*(P.compose(*moved, ctx=context) for P in (function.numerator, function.denominator)))

    @property
    def matrix(self) -> fmpq_mat:
        """y = matrix x."""
        M = fmpq_mat(len(self.place), len(self.place))
        for i, (place, c) in enumerate(zip(self.place, self.scale, strict=True)):
            M[place, i] = fmpq(c.numerator, c.denominator)
        return M


def image_of(name: str, how: str) -> Image:
    """The system itself ("same"), or one of its images."""
    formulas = FIELDS.get(name) or MAPS[name]
    names = ["x", "y", "z", "w"][: len(formulas)]
    n = len(names)
    scale = D[:n] if how == "scaled" else [Fraction(1)] * n
    place = [(i + 1) % n for i in range(n)] if how == "permuted" else list(range(n))
    speed = Fraction(10**6 + 3, 7) if how == "faster" else Fraction(1)
    old = {x: f"({names[place[i]]}/({scale[i]}))" for i, x in enumerate(names)}
    moved = [""] * n
    for i, text in enumerate(formulas):
        inside = re.sub("[a-z]", lambda match: old[match[0]], text)
        moved[place[i]] = f"({scale[i] * speed})*({inside})"
    section = "[system]\nrhs" if name in FIELDS else "[map]\nimage"
    return Image(parse_system(f"variables = {names}\n{section} = {moved}"), scale, place, speed)


@cache
def found_for(search, name: str, how: str, *arguments, **options):
    """The image, and what a search finds for it; for the system itself that is wanted several times."""
    image = image_of(name, how)
    return image, search(image.file, *arguments, **options)


def both(search, name: str, how: str, *arguments, **options):
    """What a search finds for the system itself, the image, and what it finds for that."""
    return found_for(search, name, "same", *arguments, **options)[1], *found_for(
        search, name, how, *arguments, **options
    )


def primitive(P: fmpq_mpoly) -> str:
    """A polynomial up to a factor."""
    return str(primitive_part(P)[1])


def span(polynomials) -> str:
    """The space of polynomials, the same text for each basis."""
    monomials = sorted({tuple(m) for P in polynomials for m in P.monoms()})
    return f"{monomials} {fmpq_mat([[P[m] for m in monomials] for P in polynomials]).rref()[0]}"


def cases(*names):
    """Each of them with other scales, the first one also with its variables permuted and with another time."""
    return [*((name, "scaled") for name in names), (names[0], "permuted"), (names[0], "faster")]


@pytest.mark.parametrize(("name", "how"), cases("lorenz", "euler", "conjugate", "double", "weighted"))
def test_darboux_polynomials_of_flows(name, how):
    result, image, moved = both(darboux_polynomials, name, how, 2, flow=True)
    assert (result.reason, moved.reason) == ("", "")
    expected = {primitive(P) for space in result.spaces for P in space.polynomials}
    assert {primitive(image.back(P).numerator) for space in moved.spaces for P in space.polynomials} == expected
    if name != "weighted":  # and with a wrong scale they are no others
        wrong = Image(image.file, [*image.scale[:-1], image.scale[-1] * 2], image.place, image.speed)
        assert {primitive(wrong.back(P).numerator) for entry in moved.spaces for P in entry.polynomials} != expected


@pytest.mark.parametrize(("name", "how"), cases("euler", "volterra", "lyness", "todd", "fibonacci"))
def test_darboux_polynomials_of_maps(name, how):
    result, image, moved = both(darboux_polynomials, name, how, 3)
    assert (result.reason, moved.reason) == ("", "")
    assert result.spaces
    expected = sorted(span(space.polynomials) for space in result.spaces)
    back = [[image.back(P).numerator for P in space.polynomials] for space in moved.spaces]
    assert sorted(map(span, back)) == expected
    assert all(space.verdict.holds for space in moved.spaces)


INTEGRALS = ["euler", "lorenz", "volterra", "conjugate", "lyness", "todd"]


@pytest.mark.parametrize(
    ("name", "how", "flow"),
    [(*case, flow) for case in cases(*INTEGRALS) for flow in (False, True) if case[0] in FIELDS or not flow],
)
def test_integrals(name, how, flow):
    """As many as there, and moved back they are integrals there: all is proved."""
    result, image, moved = both(find_integrals, name, how, flow=flow, max_degree=4)
    assert (len(result.integrals), result.reason) == (len(moved.integrals), moved.reason)
    assert len(result.time_dependent) == len(moved.time_dependent)
    laboratory = Laboratory(result.file, flow=flow)
    assert all(laboratory.verdict_on(image.back(integral.function))[0].holds for integral in moved.integrals)
    for item in moved.time_dependent:
        back, speed = image.back(item.integral.function), fmpq(image.speed.numerator, image.speed.denominator)
        factor = RationalFunction(item.factor.numerator / speed, item.factor.denominator)
        assert laboratory.verdict_on(back, factor=factor)[0].holds
    if how == "scaled" and moved.integrals and not flow:  # what is not moved back is none
        assert not all(laboratory.verdict_on(integral.function)[0].holds for integral in moved.integrals)


@pytest.mark.parametrize(("name", "how"), cases("euler", "conjugate", "double", "predators", "lyness", "todd"))
def test_densities(name, how):
    result, image, moved = both(find_densities, name, how)
    assert result.densities
    expected = sorted(primitive(entry.function.numerator) for entry in result.densities)
    assert sorted(primitive(image.back(entry.function).numerator) for entry in moved.densities) == expected


@pytest.mark.parametrize(("name", "how"), cases("predators", "volterra", "conjugate", "lyness"))
def test_poisson_tensors(name, how):
    """{y_i, y_j} is scale_i scale_j {x_i, x_j}: all tensors together span the same space."""
    spaces = []
    for item, tensors in (found_for(find_poisson, name, which, 3) for which in ("same", how)):
        n, entries = len(item.place), []
        context = ring([*"xyzw"[:n], "eps", *(f"d{i}" for i in range(n))])
        d = context.gens()[n + 1 :]
        for tensor in tensors.tensors:
            rows, total = tensor.tensor.rows, context.constant(0)
            for i in range(n):
                for j in range(i):
                    back = item.back(rows[item.place[i]][item.place[j]])
                    assert back.denominator.is_constant()
                    c = item.scale[i] * item.scale[j]
                    moved = back.numerator.compose(*context.gens()[: n + 1], ctx=context) * d[i] * d[j]
                    total += moved / fmpq(c.numerator, c.denominator) / back.denominator.leading_coefficient()
            entries.append(primitive_part(total)[1])
        spaces.append(sorted(str(entry if entry.leading_coefficient() > 0 else -entry) for entry in entries))
    assert spaces[0]
    assert spaces[0] == spaces[1]


def symmetries_of(file):
    return linear_symmetries(file.system)


@pytest.mark.parametrize(("name", "how"), cases("predators", "euler", "volterra", "periodic", "weighted"))
def test_symmetries(name, how):
    """Matrix and all: S for y is M S M^-1; in dimension 4 only permutations of scaled variables are sought."""
    result, image, moved = both(symmetries_of, name, how)
    assert (result.order, result.reversing_order) == (moved.order, moved.reversing_order)
    assert len(result.infinitesimal) == len(moved.infinitesimal)
    M = image.matrix
    expected = {(str(M * t.S * M.inv()), t.reversing) for t in (*result.signed, *result.others)}
    assert {(str(t.S), t.reversing) for t in (*moved.signed, *moved.others)} == expected
    assert len(expected) > 1


def quadratic_fields_of(file):
    return commuting_systems(file.system, "quadratic")


@pytest.mark.parametrize(("name", "how"), cases("euler", "conjugate", "predators", "double"))
def test_commuting_fields(name, how):
    """g for y is M g(M^-1 y), and runs faster as f does."""
    result, image, moved = both(quadratic_fields_of, name, how)
    assert result.complete
    assert moved.complete
    assert len(result.families) == len(moved.families)
    assert result.dimension == moved.dimension
    inverse, speed = image.matrix.inv(), fmpq(image.speed.numerator, image.speed.denominator)
    back = {
        str(g.system.composed(image.matrix, [fmpq(0)] * len(image.place)).transformed(inverse).scaled(1 / speed))
        for g in moved.solutions
    }
    assert back == {str(g.system) for g in result.solutions}
