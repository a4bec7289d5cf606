"""Poisson tensors P(x), and what it is that a map preserves one.

A map Phi is Poisson for P when dPhi(x) P(x) dPhi(x)^T = P(x~). Where M(x) x~ = r(x) defines it, dPhi = M^{-1} N, and
the law reads, free of denominators but for those of x~ and P,

    N(x, x~) P(x) N(x, x~)^T = M(x) P(x~) M(x)^T;

for Kahan maps M = I - eps f'(x) and N = I + eps f'(x~). Two kinds of tensors are known here: those that somebody has
written down, and Pi(x) = J - eps^2 f'(x)^2 J of Hamiltonian systems. Source: petrera-suris-2016, Theorem 12.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from flint import fmpq

from kahanmaps.algebra.bounds import BoundField
from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, evaluate, gradient
from kahanmaps.algebra.printing import format_rational_function
from kahanmaps.documents.toml_text import TomlKind
from kahanmaps.errors import InputError, SystemFileError, quoted
from kahanmaps.invariants.phase_functions import at_eps, where
from kahanmaps.maps.implicit import Map
from kahanmaps.systems.hamiltonian import CubicHamiltonian

_TENSOR_FILE = TomlKind("tensor", 4_000_000, SystemFileError)


def poisson_tensor(hamiltonian: CubicHamiltonian, field: Field, eps: Any, point: Sequence[Any]) -> Any:
    """The matrix Pi(x) = J - eps^2 f'(x)^2 J over `field`."""
    with field.working():
        jacobian = hamiltonian.system.over(field).jacobian(point)
        J = field.convert_matrix(hamiltonian.J)
        return J - jacobian * jacobian * J * (eps * eps)


class PoissonTensor(ABC):
    """A skew matrix of functions of x and eps: a Poisson tensor, if the Jacobi identity holds."""

    dim: int
    name: str
    formula: str
    has_eps: bool = True
    symbols: tuple[str, ...] = ()  # of which it depends as well: their values stand behind those of the variables

    @property
    @abstractmethod
    def subject(self) -> tuple[Any, ...]:
        """All that determines the tensor, as `derive_seed` takes it."""

    @abstractmethod
    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        """The matrix P(x); None at a pole."""

    @abstractmethod
    def along(self, field: Field, eps: Any, point: Sequence[Any], direction: Sequence[Any]) -> Any:
        """The matrix sum_l v_l dP/dx_l for a direction v, where P has a value."""


class HamiltonianTensor(PoissonTensor):
    """Pi(x) = J - eps^2 f'(x)^2 J for f = J grad H."""

    name = "Pi"
    formula = "Pi(x) = J - eps^2 f'(x)^2 J"

    def __init__(self, hamiltonian: CubicHamiltonian) -> None:
        self.hamiltonian = hamiltonian
        self.dim = hamiltonian.dim

    @property
    def subject(self) -> tuple[Any, ...]:
        return (self.hamiltonian.H, self.hamiltonian.J)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        return poisson_tensor(self.hamiltonian, field, eps, point)

    def along(self, field: Field, eps: Any, point: Sequence[Any], direction: Sequence[Any]) -> Any:
        local = self.hamiltonian.system.over(field)
        with field.working():
            first, second = local.jacobian(point), local.hessian_times(direction)
            return (second * first + first * second) * field.convert_matrix(self.hamiltonian.J) * -(eps * eps)


class MatrixPoissonTensor(PoissonTensor):
    """A skew matrix of rational functions of the variables, perhaps symbols, and eps (their last variable).

    Raises InputError for a matrix that is not square or not skew.

    >>> MatrixPoissonTensor.from_text([["0", "x*y"], ["-x*y", "0"]], ["x", "y"]).formula
    '{x,y} = x*y'
    >>> MatrixPoissonTensor.from_text([["0", "x"], ["x", "0"]], ["x", "y"])
    Traceback (most recent call last):
    kahanmaps.errors.InputError: found x in row 1, column 2 and x in row 2, column 1, expected a skew matrix
    """

    name = "P"

    def __init__(self, rows: Sequence[Sequence[RationalFunction]]) -> None:
        self.dim = len(rows)
        if any(len(row) != self.dim for row in rows):
            raise InputError(f"found a matrix with {self.dim} rows that is not square, expected as many columns")
        for i, row in enumerate(rows):
            for j, entry in enumerate(row[: i + 1]):
                other = rows[j][i]
                if other != RationalFunction(-entry.numerator, entry.denominator):
                    texts = [format_rational_function(one) for one in (other, entry)]
                    raise InputError(
                        f"found {texts[0]} in row {j + 1}, column {i + 1} and {texts[1]} in row {i + 1}, "
                        f"column {j + 1}, expected a skew matrix"
                    )
        self.rows = tuple(tuple(row) for row in rows)
        self.symbols = rows[0][0].names[self.dim : -1] if rows else ()
        self.has_eps = any(
            "eps" not in set(f.numerator.unused_gens()) & set(f.denominator.unused_gens())
            for row in self.rows
            for f in row
        )

    @classmethod
    def from_text(
        cls, rows: Sequence[Sequence[str]], variables: Sequence[str], parameters: Mapping[str, fmpq] | None = None
    ) -> MatrixPoissonTensor:
        """The tensor with entries written as rational functions of the variables, the parameters and eps."""
        names = (*variables, "eps")
        if len(rows) != len(variables):
            raise InputError(f"found a tensor with {len(rows)} rows, expected {len(variables)}, one for each variable")
        return cls([[parse_rational_function(entry, names, parameters or {}) for entry in row] for row in rows])

    @classmethod
    def read(cls, path: str | Path, variables: Sequence[str], parameters: Mapping[str, fmpq]) -> MatrixPoissonTensor:
        """The tensor in a TOML file: the rows `tensor` of the section [poisson], entries numbers or text.

        Raises InputError for a file that cannot be read or says something else.
        """
        document = _TENSOR_FILE.document(_TENSOR_FILE.read(path), str(path))
        section = document.get("poisson")
        rows = section.get("tensor") if isinstance(section, dict) else None
        if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
            raise InputError(f'{path}: expected a section [poisson] with tensor = [["0", "x*y"], ["-x*y", "0"]]')
        for entry in (entry for row in rows for entry in row):
            if not isinstance(entry, int | str) or isinstance(entry, bool):
                raise InputError(f"{path}: found {quoted(str(entry))} in the tensor, expected functions in quotes")
        return cls.from_text([[str(entry) for entry in row] for row in rows], variables, parameters)

    def toml_section(self) -> str:
        """The tensor as a section [poisson], which `read` reads."""
        rows = [", ".join(f'"{format_rational_function(entry)}"' for entry in row) for row in self.rows]
        return "\n".join(["[poisson]", "tensor = [", *(f"  [{row}]," for row in rows), "]", ""])

    @property
    def brackets(self) -> dict[tuple[str, str], RationalFunction]:
        """The brackets {x_i, x_j} = P_ij for i < j that are not 0."""
        names = self.rows[0][0].names if self.rows else ()
        return {(names[i], names[j]): entry for (i, j), entry in self._upper.items()}

    @property
    def formula(self) -> str:  # type: ignore[override]
        """The brackets that are not 0."""
        found = [f"{{{a},{b}}} = {format_rational_function(entry)}" for (a, b), entry in self.brackets.items()]
        return ", ".join(found) or "P = 0"

    @property
    def subject(self) -> tuple[Any, ...]:
        return ("given tensor", self.rows)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        with field.working():
            place = (*point, field.convert(eps))
            upper = {pair: entry.value(field, place) for pair, entry in self._upper.items()}
            return None if None in upper.values() else self._matrix(field, upper)

    def along(self, field: Field, eps: Any, point: Sequence[Any], direction: Sequence[Any]) -> Any:
        with field.working():
            place = (*point, field.convert(eps))

            def slope(parts: Sequence[Any]) -> Any:
                terms = [v * evaluate(P, field, place) for v, P in zip(direction, parts, strict=False) if len(P)]
                return sum(terms[1:], terms[0]) if terms else field.zero

            upper = {}
            for pair, entry in self._upper.items():
                numerator, denominator = self._slopes[pair]
                N, D = evaluate(entry.numerator, field, place), evaluate(entry.denominator, field, place)
                upper[pair] = slope(numerator) / D
                if not entry.is_polynomial:
                    upper[pair] = upper[pair] - N * slope(denominator) / (D * D)
            return self._matrix(field, upper)

    @cached_property
    def _upper(self) -> dict[tuple[int, int], RationalFunction]:
        return {
            (i, j): entry
            for i, row in enumerate(self.rows)
            for j, entry in enumerate(row)
            if i < j and not entry.numerator.is_zero()
        }

    @cached_property
    def _slopes(self) -> dict[tuple[int, int], tuple[Any, Any]]:
        return {pair: (gradient(f.numerator), gradient(f.denominator)) for pair, f in self._upper.items()}

    def _matrix(self, field: Field, upper: Mapping[tuple[int, int], Any]) -> Any:
        n, zero = self.dim, field.zero
        entries = [
            upper[i, j] if (i, j) in upper else -upper[j, i] if (j, i) in upper else zero
            for i in range(n)
            for j in range(n)
        ]
        return field.matrix(n, n, entries)


def tensor_condition(tensor: MatrixPoissonTensor, eps: fmpq | None) -> str:
    """The hypothesis that P is a tensor other than 0, of which every law for tensors holds for no reason.

    Args:
        tensor: P, a matrix of functions of the variables, symbols and eps.
        eps: an exact number, or None for every eps.

    Returns:
        For which symbols and eps P has values and is not identically 0, in words; empty where it is so for all of them.

    Raises:
        InputError: where P is identically 0, at that eps if it is given.

    >>> for entry in ("(10*eps - 1)*x", "x/(10*eps - 1)", "x + 10*eps - 1"):
    ...     tensor = MatrixPoissonTensor.from_text([["0", entry], [f"-({entry})", "0"]], ["x", "y"])
    ...     print([tensor_condition(tensor, None)])
    ['where 10*eps - 1 is not 0']
    ['where 10*eps - 1 is not 0']
    ['']
    """
    entries = [at_eps(entry, eps) for entry in tensor.brackets.values()]
    numerators = [numerator for numerator, _ in entries if not numerator.is_zero()]
    if any(denominator.is_zero() for _, denominator in entries):
        return ""  # then P has no values, of which the verdict tells
    if not numerators:
        which = f"{quoted(tensor.formula)}, which is identically 0 at eps = {eps}" if entries else tensor.formula
        raise InputError(f"found the tensor {which}, expected one that is not zero: every map preserves 0")
    return where(tensor.dim, numerators, *(denominator for _, denominator in entries))


def transformation_sides(
    map_: Map, tensor: PoissonTensor, point: Sequence[Any], image: Sequence[Any], values: Sequence[Any] = ()
) -> tuple[Any, Any] | None:
    """Both sides of the transformation law above, at x = `point` and x~ = `image`.

    None at a pole of the tensor, and where it is 0 at both points: 0 = 0 says nothing of a map. `values` are those of
    the symbols. Of a map with several factors it is the law of the last one, for what the others
    make of P(x).
    """
    field, eps = map_.field, map_.eps
    here, there = (tensor.value(field, eps, (*place, *values)) for place in (point, image))
    if here is None or there is None or (_is_zero(field, here) and _is_zero(field, there)):
        return None
    *before, (last, at) = map_.stages(point)
    for one, x in before:
        slopes = one.jacobian(x)
        with field.working():
            here = slopes * here * slopes.transpose()
    forward, backward = last.numerator_matrix(at, image), last.denominator_matrix(at)
    with field.working():
        return forward * here * forward.transpose(), backward * there * backward.transpose()


def jacobi_defects(tensor: PoissonTensor, field: Field, eps: Any, point: Sequence[Any]) -> list[Any] | None:
    """sum over l of P_il d_l P_jk + cyclic in i, j, k, for all i < j < k: zero when P is a Poisson tensor.

    None at a pole, and where P is 0: there the sum is 0 whatever P is elsewhere.
    """
    n = tensor.dim
    P = tensor.value(field, eps, point)
    if P is None or _is_zero(field, P):
        return None
    with field.working():
        # along[i][j, k] = sum_l P_il d_l P_jk, the derivative of P_jk along row i of P.
        along = [tensor.along(field, eps, point, [P[i, l] for l in range(n)]) for i in range(n)]
        return [
            along[i][j, k] + along[j][k, i] + along[k][i, j]
            for i in range(n)
            for j in range(i + 1, n)
            for k in range(j + 1, n)
        ]


def _is_zero(field: Field, matrix: Any) -> bool:
    """Whether the matrix is 0; not over bounds, where the degrees of the laws, which are larger, stand for its own."""
    return not isinstance(field, BoundField) and all(field.is_zero(entry) for entry in matrix.entries())
