"""Exact conversion of polynomials, rational functions, systems and maps to SymPy expressions."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import RationalFunction, names_of
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import DarbouxPolynomials
from kahanmaps.laboratory.preserve.iterates import IntegralInIterates
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import FoundTensor
from kahanmaps.laboratory.preserve.results import FoundFunction
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

_MAX_DIMENSION = 6  # maximal dimension of a map whose equations are solved


def _sympy() -> Any:
    try:
        import sympy
    except ImportError as error:
        raise InputError(f"to_sympy needs SymPy ({error}): pip install sympy") from error
    return sympy


@singledispatch
def sympy_form(value: object) -> Any:
    """Convert a value to a SymPy expression; a system or a map becomes a dict from symbols to expressions."""
    raise InputError(f"found a {type(value).__name__}, expected a function, a system or a map at one eps")


@sympy_form.register
def _number(value: fmpq) -> Any:
    return _sympy().Rational(int(value.p), int(value.q))


@sympy_form.register
def _polynomial(polynomial: fmpq_mpoly) -> Any:
    symbols = _sympy().symbols(names_of(polynomial))
    terms = {tuple(map(int, monomial)): _number(c) for monomial, c in polynomial.terms()}
    return _sympy().Poly.from_dict(terms or {(0,) * len(symbols): 0}, *symbols).as_expr()


@sympy_form.register
def _rational(function: RationalFunction) -> Any:
    return _polynomial(function.numerator) / _polynomial(function.denominator)


@sympy_form.register
def _found(result: FoundFunction) -> Any:
    return _rational(result.function)


@sympy_form.register
def _in_iterates(integral: IntegralInIterates) -> Any:
    ratio, letters = integral.ratio.formula
    if letters:
        raise InputError(f"found {integral.name}, whose formula has abbreviations: read .text or .latex()")
    return _rational(ratio)


@sympy_form.register
def _darboux(space: DarbouxPolynomials) -> Any:
    return [_polynomial(P) for P in space.polynomials]


@sympy_form.register
def _tensor(result: FoundTensor) -> Any:
    return _sympy().Matrix([[sympy_form(entry) for entry in row] for row in result.tensor.rows])


@sympy_form.register
def _system(system: QuadraticSystem) -> Any:
    return dict(zip(_sympy().symbols(system.variables), map(_polynomial, system.rhs), strict=True))


@sympy_form.register
def _hamiltonian(hamiltonian: CubicHamiltonian) -> Any:
    return _polynomial(hamiltonian.H)


@sympy_form.register
def _family(map_: MapFamily) -> Any:
    if isinstance(map_, KahanFamily):
        return _system(map_.system)
    if map_.image is None:
        raise InputError(f"found {map_!r}, given by equations, expected a map at one eps: system.at(eps).to_sympy()")
    return dict(zip(_sympy().symbols(map_.variables), map(_rational, map_.image), strict=True))


@sympy_form.register
def _file(file: SystemFile) -> Any:
    return _family(file.map)


@sympy_form.register
def _map(map_: Map) -> Any:
    """Return {symbol: coordinate of x~ in lowest terms}; M(x) x~ = r(x) is solved for each factor of a composition."""
    sympy = _sympy()
    if map_.field is not QQ or map_.dim > _MAX_DIMENSION:
        raise InputError(f"found {map_!r}, expected a map over QQ in at most {_MAX_DIMENSION} variables")
    symbols: Sequence[Any] = sympy.symbols(map_.variables or [f"x{k + 1}" for k in range(map_.dim)])
    point = list(symbols)
    for equation in map_.equations:
        monomials = [
            sympy.prod(x**e for x, e in zip((*point, 1), exponent, strict=True)) for exponent in equation.exponents
        ]
        rows = [
            [sum((_number(c) * monomials[k] for k, c in form), sympy.S(0)) for form in row] for row in equation.terms
        ]
        matrix = sympy.Matrix([row[:-1] for row in rows])
        point = [sympy.cancel(x) for x in matrix.LUsolve(sympy.Matrix([-row[-1] for row in rows]))]
    return dict(zip(symbols, point, strict=True))
