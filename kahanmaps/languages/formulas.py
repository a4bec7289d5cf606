"""The formulas of a system, as exact polynomials, for the conversion to another language.

Parameters of the system are numbers or symbols. Polynomials contain the variables, the symbols and, if needed, eps.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from flint import fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.errors import InputError
from kahanmaps.maps.algebraic import AlgebraicMap
from kahanmaps.maps.convention import describe_eps
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.sources import SOURCES
from kahanmaps.version import __version__

# Limits for the closed form of the map: terms of each intermediate polynomial, and of all final components together.
MAX_TERMS = 4_000
MAX_DIMENSION_OF_FORMULAS = 8  # maximal dimension of the map


class Formulas:
    """The formulas of a system file; the parameters `symbols` stay symbolic, all other parameters are numbers.

    An algebraic number is also a symbol. `names` are the variables, then the symbols. `rhs`, its matrix of derivatives
    `jacobian`, and `H` are polynomials in these names. The other formulas also contain eps. `rhs` is empty if the map
    is not Kahan's. `new` are the names of the coordinates of x~, the image of a point x.
    """

    def __init__(self, file: SystemFile, symbols: Sequence[str] = ()) -> None:
        """Collect the formulas. Raises InputError if the parameters cannot be symbols."""
        self.file = file
        if isinstance(file.map, AlgebraicMap):
            if symbols:
                raise InputError(f"found symbols together with a {file.map.root}, expected none: it is a symbol itself")
            self.map: MapFamily = file.map.family
        else:
            self.map = map_with_symbols(file, symbols)
        map_ = self.map
        self.variables, self.symbols, self.dim = map_.variables, map_.symbols, len(map_.variables)
        self.names = (*self.variables, *self.symbols)
        suffix = "_new"
        while any(variable + suffix in self.names for variable in self.variables):
            suffix += "_"
        self.new = tuple(variable + suffix for variable in self.variables)
        has_field = isinstance(map_, KahanFamily) and "eps" not in map_.system.symbols
        self.rhs: tuple[fmpq_mpoly, ...] = map_.system.rhs if has_field and isinstance(map_, KahanFamily) else ()
        self.jacobian = [[polynomial.derivative(k) for k in range(self.dim)] for polynomial in self.rhs]
        self.integrals: Mapping[str, RationalFunction] = file.integrals
        self.density, self.H = file.density, None if file.hamiltonian is None else file.hamiltonian.H
        if self.symbols:  # parse the integrals, the density and H again: they contain the symbols now
            constants = {name: value for name, value in file.parameters.items() if name not in self.symbols}
            document = file.document

            def claim(text: object) -> RationalFunction:
                return parse_rational_function(str(text), (*self.names, "eps"), constants)

            self.integrals = {name: claim(document["integrals"][name]) for name in file.integrals}
            self.density = claim(document["density"]["phi"]) if "density" in document else None
            is_hamiltonian = file.kind == "hamiltonian"
            text = str(document["hamiltonian"]["H"]) if is_hamiltonian else ""
            self.H = parse_polynomial(text, self.names, constants) if is_hamiltonian else None

    @cached_property
    def equation(self) -> list[list[fmpq_mpoly]]:
        """The rows of (M | r): M x~ = r defines the map. A Kahan map has M = I - eps f'(x) and r = M x + 2 eps f(x)."""
        return [[*row[:-1], -row[-1]] for row in self.map.rows]

    @cached_property
    def forms(self) -> dict[str, fmpq_mat]:
        """The matrices M_k = J (A^T)^k, k < m, by name; for a member (A, H), each x^T M_k x~/eps is an integral."""
        member = self.file.member
        if member is None:
            return {}
        J = member.chosen.hamiltonian.J
        return {f"H{k}": J * (member.A**k).transpose() for k in range(member.m)}

    def integrals_by_theorem(self) -> Iterator[tuple[str, str, RationalFunction]]:
        """Yield the integrals of a Hamiltonian system in x and its image x~: triples (name, formula as text, function).

        For a member these are x^T M x~/eps for each M in `forms`, otherwise H(x) + grad H(x)^T (x~ - x)/3. The names in
        these functions are the variables, the coordinates `new` of x~, the symbols and eps.
        """
        if self.H is None:
            return
        n = self.dim
        context = ring((*self.variables, *self.new, *self.symbols, "eps"))
        generators = context.gens()
        x, y, eps = generators[:n], generators[n : 2 * n], generators[-1]
        for k, (name, form) in enumerate(self.forms.items()):
            matrix_text = "J" if k == 0 else "J A^T" if k == 1 else f"J (A^T)^{k}"
            terms = (x[i] * entry * y[j] for i, row in enumerate(form.tolist()) for j, entry in enumerate(row))
            function = RationalFunction(sum(terms, context.constant(0)), eps)
            yield f"integral {name}", f"x^T M x~/eps with M = {matrix_text}", function
        if not self.forms:
            images = (*x, *generators[2 * n : -1])
            derivatives = [self.H.derivative(k).compose(*images, ctx=context) for k in range(n)]
            change = sum(
                (derivative * (b - a) for derivative, a, b in zip(derivatives, x, y, strict=True)), context.constant(0)
            )
            function = RationalFunction(self.H.compose(*images, ctx=context) + change / 3, context.constant(1))
            yield "modified_hamiltonian", "H + grad H . (x~ - x)/3, where f = J grad H", function

    @cached_property
    def missing(self) -> dict[str, str]:
        """The error messages for "integrals" and "density", if neither the file nor a theorem gives such functions."""
        if self.H is not None:  # the modified H and the density det(I - eps f'(x)) are known
            return {}
        messages = {}
        if not self.integrals:
            messages["integrals"] = (
                f"found no integral of {self.file.name}, expected a section [integrals] in its file: "
                "'kahanmaps find-integrals SYSTEM --toml' looks for some and prints one"
            )
        if self.density is None:
            messages["density"] = (
                f"found no density of {self.file.name}, expected a section [density] in its file: "
                "'kahanmaps find-density SYSTEM --toml' looks for one and prints it"
            )
        return messages

    def inverse_form(self) -> list[RationalFunction]:
        """Return the components of the inverse of a map other than Kahan's. Raises InputError if it is unknown."""
        return self._solve([[*row[:-1], -row[-1]] for row in self.map.inverse_rows])

    def closed_form(self) -> list[RationalFunction]:
        """Return the components of the map as exact rational functions of the names and eps, in lowest terms.

        Raises InputError if they are too large. The computation takes at most a second unless coefficients are long.

        >>> from kahanmaps.algebra.printing import format_rational_function
        >>> from kahanmaps.documents.catalog import load
        >>> [format_rational_function(component) for component in Formulas(load("harmonic")).closed_form()]
        ['(-x*eps^2 + 2*y*eps + x)/(eps^2 + 1)', '(-y*eps^2 - 2*x*eps + y)/(eps^2 + 1)']
        """
        return self._solve(self.equation)

    def _solve(self, equation: list[list[fmpq_mpoly]]) -> list[RationalFunction]:
        if self.dim > MAX_DIMENSION_OF_FORMULAS:
            raise _too_large(f"dimension {self.dim}, expected at most {MAX_DIMENSION_OF_FORMULAS}")

        def times(left: fmpq_mpoly, right: fmpq_mpoly) -> fmpq_mpoly:
            product = left * right
            if len(product) > MAX_TERMS:
                raise _too_large(f"a polynomial of {len(product)} terms, expected at most {MAX_TERMS} in all")
            return product

        # (x~, -1) is in the kernel of (M | r), hence proportional to the signed maximal minors (the last is -+det M).
        *numerators, denominator = kernel_minors(equation, times)
        components = []
        for minor in numerators:
            gcd = minor.gcd(denominator)
            components.append(RationalFunction(-minor / gcd, denominator / gcd))
        term_count = sum(len(function.numerator) + len(function.denominator) for function in components)
        if term_count > MAX_TERMS:
            raise _too_large(f"{term_count} terms, expected at most {MAX_TERMS}")
        return components

    def header(self, command: str, width: int = 100) -> list[str]:
        """Return the lines of the initial comment: the system, eps, the parameters, the sources and the command."""
        file = self.file
        title = file.catalog.get("title", "")
        lines = [f"{file.name}: {title}" if title else file.name]
        if not self.rhs:
            rows = str(self.map).split("\n")[:12]
            lines += [f"  {line if len(line) <= width else line[: width - 4] + ' ...'}" for line in rows]
        elif len(self.rhs) <= 12:
            texts = [format_polynomial(polynomial) for polynomial in self.rhs]
            lines += [
                f"  {name}' = {text if len(text) <= width else text[: width - 4] + ' ...'}"
                for name, text in zip(self.variables, texts, strict=True)
            ]
        if sentence := describe_eps(self.map):
            lines.append(f"{sentence}: the time step is {2 * self.map.time_steps} eps.")
        numbers = [f"{name} = {value}" for name, value in file.parameters.items() if name not in self.symbols]
        if numbers:
            lines.append(f"Parameters: {', '.join(numbers)}")
        if self.symbols:
            lines.append(f"Parameters left as symbols: {', '.join(self.symbols)}")
        if (root := file.map.root) is not None:
            lines.append(
                f"where {self.symbols[0]} is a {root}{root.decimal}: give that number, or any of its conjugates."
            )
        convention = file.catalog.get("convention")
        lines += [f"Convention of the source: {convention}"] if convention else []
        lines += [f"Source: {SOURCES[key]}" for key in file.catalog.get("sources", ())]
        origin = f"Written by kahanmaps {__version__}" + (f": {command}" if command else "")
        lines.append(origin)
        broken_lines: list[str] = []
        for line in lines:
            shown_line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)
            is_code = line is origin or line.startswith("  ")  # commands are not wrapped, so that they can be copied
            broken_lines += (
                [shown_line]
                if is_code
                else textwrap.wrap(shown_line, width, subsequent_indent="  ", break_long_words=False)
            )
        # Python interprets "coding: x" in the first two lines of a file as its encoding.
        return [re.sub("coding(?=[:=])", "coding ", line) if k < 2 else line for k, line in enumerate(broken_lines)]


def _too_large(size: str) -> InputError:
    return InputError(
        f"the closed form of the map is too large: found {size}; "
        "ask for 'map' instead, which solves the linear equations for x~ and works in every dimension"
    )
