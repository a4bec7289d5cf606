"""A quadratic system with some of its parameters left as symbols, to be carried into GF(p) at any of their values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.text import parse_polynomial
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, quoted
from kahanmaps.systems.quadratic import QuadraticSystem, SystemOver


@dataclass(frozen=True, eq=False)
class ParametricSystem:
    """x' = f(x) with the right-hand sides `rhs` in the ring of the variables, then the symbols.

    `symbols` are names of parameters that have no value here; eps is never one of them.
    """

    variables: tuple[str, ...]
    symbols: tuple[str, ...]
    rhs: tuple[fmpq_mpoly, ...]

    @classmethod
    def of(cls, file: SystemFile, symbols: Sequence[str] = ()) -> ParametricSystem:
        """The system of a file, the parameters named in `symbols` without values, the others with theirs.

        Args:
            file: the system.
            symbols: names of its parameters; eps is a symbol anyway and is not to be named.

        Returns:
            The system, its right-hand sides exact.

        Raises:
            InputError: for a name that is no parameter, for right-hand sides that with the symbols free have a degree
                above 2 or are no polynomials, and for a member of the family, whose A and H must fit together at
                every value.

        >>> from kahanmaps.documents.catalog import load
        >>> ParametricSystem.of(load("euler_top"), ["a1"]).rhs
        (x2*x3*a1, -2*x1*x3, x1*x2)
        """
        symbols = tuple(dict.fromkeys(symbols))
        for name in symbols:
            if name not in file.parameters:
                known = ", ".join(file.parameters) or "none"
                raise InputError(f"found the symbol {quoted(name)}, expected eps or a parameter of the system: {known}")
        names = (*file.variables, *symbols)
        if not symbols:
            return cls.of_system(file.system)
        constants = {name: value for name, value in file.parameters.items() if name not in symbols}
        section = file.document[file.kind]
        if file.kind == "system":
            rhs = tuple(parse_polynomial(str(text), names, constants) for text in section["rhs"])
            return cls(file.variables, symbols, rhs)._checked()
        if file.kind == "family":
            raise InputError(
                f"found the symbols {', '.join(symbols)} in a [family] file, expected numbers: "
                "write the system as [hamiltonian]"
            )
        H = parse_polynomial(str(section["H"]), names, constants)
        n = len(file.variables)
        gradient = [H.derivative(k) for k in range(n)]
        if isinstance(section["J"], str):
            assert file.hamiltonian is not None
            J: list[list[Any]] = [[ring(names).constant(entry) for entry in row] for row in file.hamiltonian.J.tolist()]
        else:
            J = [[parse_polynomial(str(entry), names, constants) for entry in row] for row in section["J"]]
        zero = ring(names).constant(0)
        rhs = tuple(sum((a * g for a, g in zip(row, gradient, strict=True)), zero) for row in J)
        return cls(file.variables, symbols, rhs)._checked()

    @classmethod
    def of_system(cls, system: QuadraticSystem) -> ParametricSystem:
        """A system without symbols."""
        return cls(system.variables, (), system.rhs)

    def _checked(self) -> ParametricSystem:
        """Itself. Raises InputError where a term of higher degree is 0 only at the values that the file gives."""
        if self.degree > 2:
            raise InputError(
                f"found right-hand sides of degree {self.degree} in the variables with {', '.join(self.symbols)} as "
                "symbols, expected at most 2: leave the parameter that makes them cubic a number"
            )
        return self

    @property
    def dim(self) -> int:
        """The number of variables."""
        return len(self.variables)

    @property
    def degree(self) -> int:
        """The degree of f in the variables alone."""
        found = (sum(m[: self.dim]) for polynomial in self.rhs for m, _ in polynomial.terms())
        return max(found, default=0)

    def over(self, field: Field, values: Sequence[Any] = ()) -> SystemOver:
        """The system over a field (not of characteristic 2), with elements of the field for the symbols.

        Raises BadPrime where a coefficient has no reduction modulo p.
        """
        n = self.dim
        tensor, linear, constants = [field.zero] * n**3, [field.zero] * (n * n), [field.zero] * n
        for i, polynomial in enumerate(self.rhs):
            for monomial, coefficient in polynomial.terms():
                value = field.convert(coefficient)
                for exponent, at in zip(monomial[n:], values, strict=True):
                    if exponent:
                        value = value * at ** int(exponent)
                where = [j for j, exponent in enumerate(monomial[:n]) for _ in range(exponent)]
                if len(where) == 2:
                    j, k = where
                    tensor[(i * n + j) * n + k] += value
                    tensor[(i * n + k) * n + j] += value
                elif len(where) == 1:
                    linear[i * n + where[0]] += value
                else:
                    constants[i] += value
        return SystemOver.from_tensor(
            field, field.matrix(n * n, n, tensor), field.matrix(n, n, linear), field.column(constants)
        )

    def at(self, values: Sequence[Any]) -> QuadraticSystem:
        """The system with numbers for its symbols."""
        context = ring(self.variables)
        images = [*context.gens(), *(context.constant(value) for value in values)]
        return QuadraticSystem.from_polynomials([polynomial.compose(*images, ctx=context) for polynomial in self.rhs])

    def jacobian(self, names: Sequence[str]) -> list[list[fmpq_mpoly]]:
        """f'(x) as polynomials in `names`, which contain the variables and the symbols."""
        context = ring(names)
        own = (*self.variables, *self.symbols)
        images = [context.gen(list(names).index(name)) for name in own]
        return [
            [polynomial.derivative(k).compose(*images, ctx=context) for k in range(self.dim)] for polynomial in self.rhs
        ]
