"""Poisson tensors P(x), and the transformation law of a tensor that a map preserves.

A map x~ = Phi(x) is Poisson for P if dPhi(x) P(x) dPhi(x)^T = P(x~). If an equation M(x) x~ = r(x) defines the map,
dPhi = M^{-1} N with a matrix N(x, x~). Multiplied by M and M^T, the law has only the denominators of x~ and P:

    N(x, x~) P(x) N(x, x~)^T = M(x) P(x~) M(x)^T;

for Kahan maps M = I - eps f'(x) and N = I + eps f'(x~). Two kinds of tensors are implemented: explicit matrices, and
Pi(x) = J - eps^2 f'(x)^2 J for Hamiltonian systems. Source: petrera-suris-2016, Theorem 12.
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
from kahanmaps.errors import InputError, SystemFileError, counted, quoted
from kahanmaps.invariants.integrals_and_densities import at_eps, where
from kahanmaps.maps.implicit import Map
from kahanmaps.systems.hamiltonian import CubicHamiltonian

_TENSOR_FILE = TomlKind("tensor", 4_000_000, SystemFileError)


def poisson_tensor(hamiltonian: CubicHamiltonian, field: Field, eps: Any, point: Sequence[Any]) -> Any:
    """Return the matrix Pi(x) = J - eps^2 f'(x)^2 J over `field`."""
    with field.working():
        jacobian = hamiltonian.system.over(field).jacobian(point)
        J = field.convert_matrix(hamiltonian.J)
        return J - jacobian * jacobian * J * (eps * eps)


class PoissonTensor(ABC):
    """A skew matrix of functions of x and eps; it is a Poisson tensor if the Jacobi identity holds."""

    dim: int
    name: str
    formula: str
    has_eps: bool = True
    symbols: tuple[str, ...] = ()  # the values of symbols follow the coordinates in `point`

    @property
    @abstractmethod
    def seed_data(self) -> tuple[Any, ...]:
        """Data that determine the tensor; `derive_seed` derives random seeds from them."""

    @abstractmethod
    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        """Return the matrix P(x); None at a pole."""

    @abstractmethod
    def derivative(self, field: Field, eps: Any, point: Sequence[Any], direction: Sequence[Any]) -> Any:
        """Return the matrix sum_l v_l dP/dx_l for a direction v, at a point that is not a pole."""


class HamiltonianTensor(PoissonTensor):
    """Pi(x) = J - eps^2 f'(x)^2 J for f = J grad H."""

    name = "Pi"
    formula = "Pi(x) = J - eps^2 f'(x)^2 J"

    def __init__(self, hamiltonian: CubicHamiltonian) -> None:
        self.hamiltonian = hamiltonian
        self.dim = hamiltonian.dim

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return (self.hamiltonian.H, self.hamiltonian.J)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        return poisson_tensor(self.hamiltonian, field, eps, point)

    def derivative(self, field: Field, eps: Any, point: Sequence[Any], direction: Sequence[Any]) -> Any:
        system_over_field = self.hamiltonian.system.over(field)
        with field.working():
            jacobian, hessian = (system_over_field.jacobian(point), system_over_field.hessian_times(direction))
            return (hessian * jacobian + jacobian * hessian) * field.convert_matrix(self.hamiltonian.J) * -(eps * eps)


class MatrixPoissonTensor(PoissonTensor):
    """A skew matrix P of rational functions of, in this order, the variables, symbols (if any) and eps.

    Raises InputError for a matrix that is not square or not skew-symmetric.

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
                opposite_entry = rows[j][i]
                if opposite_entry != RationalFunction(-entry.numerator, entry.denominator):
                    texts = [format_rational_function(f) for f in (opposite_entry, entry)]
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
        """Parse a tensor whose entries are rational functions of the variables, the parameters and eps."""
        names = (*variables, "eps")
        if len(rows) != len(variables):
            raise InputError(
                f"found a tensor with {counted(len(rows), 'row')}, expected {len(variables)}, one for each variable"
            )
        return cls([[parse_rational_function(entry, names, parameters or {}) for entry in row] for row in rows])

    @classmethod
    def read(cls, path: str | Path, variables: Sequence[str], parameters: Mapping[str, fmpq]) -> MatrixPoissonTensor:
        """Read a tensor from a TOML file: the rows `tensor` of the section [poisson], with numbers or text as entries.

        Raises InputError if the file cannot be read or has another form.
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
        """Return the tensor as the section [poisson] of a TOML file that `read` can read."""
        rows = [", ".join(f'"{format_rational_function(entry)}"' for entry in row) for row in self.rows]
        return "\n".join(["[poisson]", "tensor = [", *(f"  [{row}]," for row in rows), "]", ""])

    @property
    def brackets(self) -> dict[tuple[str, str], RationalFunction]:
        """The nonzero brackets {x_i, x_j} = P_ij with i < j."""
        names = self.rows[0][0].names if self.rows else ()
        return {(names[i], names[j]): entry for (i, j), entry in self._upper_entries.items()}

    @property
    def formula(self) -> str:  # type: ignore[override]
        """The nonzero brackets {x_i, x_j} = P_ij with i < j, as text."""
        equations = [f"{{{a},{b}}} = {format_rational_function(entry)}" for (a, b), entry in self.brackets.items()]
        return ", ".join(equations) or "P = 0"

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return ("given tensor", self.rows)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        with field.working():
            arguments = (*point, field.convert(eps))
            upper_entries = {pair: entry.value(field, arguments) for pair, entry in self._upper_entries.items()}
            return None if None in upper_entries.values() else self._matrix(field, upper_entries)

    def derivative(self, field: Field, eps: Any, point: Sequence[Any], direction: Sequence[Any]) -> Any:
        with field.working():
            arguments = (*point, field.convert(eps))

            def directional_derivative(partial_derivatives: Sequence[Any]) -> Any:
                terms = [
                    component * evaluate(partial_derivative, field, arguments)
                    for component, partial_derivative in zip(direction, partial_derivatives, strict=False)
                    if not partial_derivative.is_zero()
                ]
                return sum(terms[1:], terms[0]) if terms else field.zero

            upper_entries = {}
            for pair, entry in self._upper_entries.items():
                numerator_gradient, denominator_gradient = self._gradients[pair]
                N, D = evaluate(entry.numerator, field, arguments), evaluate(entry.denominator, field, arguments)
                upper_entries[pair] = directional_derivative(numerator_gradient) / D
                if not entry.is_polynomial:
                    correction = N * directional_derivative(denominator_gradient) / (D * D)
                    upper_entries[pair] = upper_entries[pair] - correction
            return self._matrix(field, upper_entries)

    @cached_property
    def _upper_entries(self) -> dict[tuple[int, int], RationalFunction]:
        return {
            (i, j): entry
            for i, row in enumerate(self.rows)
            for j, entry in enumerate(row)
            if i < j and not entry.numerator.is_zero()
        }

    @cached_property
    def _gradients(self) -> dict[tuple[int, int], tuple[Any, Any]]:
        return {pair: (gradient(f.numerator), gradient(f.denominator)) for pair, f in self._upper_entries.items()}

    def _matrix(self, field: Field, upper_entries: Mapping[tuple[int, int], Any]) -> Any:
        n, entries = self.dim, {**upper_entries, **{(j, i): -entry for (i, j), entry in upper_entries.items()}}
        return field.matrix(n, n, [entries.get((i, j), field.zero) for i in range(n) for j in range(n)])


def tensor_condition(tensor: MatrixPoissonTensor, eps: fmpq | None) -> str:
    """Return the condition on symbols and eps that P is defined and not 0; P = 0 is trivially a Poisson tensor.

    Args:
        tensor: P, a matrix of functions of the variables, symbols and eps.
        eps: half the time step, an exact number, or None for every eps.

    Returns:
        The condition on symbols and eps that P is defined and not identically 0, as text; empty if it always holds.

    Raises:
        InputError: if P is identically 0 at the given eps.

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
        return ""  # P is not defined at this eps; the check will report this
    if not numerators:
        tensor_text = f"{quoted(tensor.formula)}, which is identically 0 at eps = {eps}" if entries else tensor.formula
        raise InputError(f"found the tensor {tensor_text}, expected one that is not zero: every map preserves 0")
    return where(tensor.dim, numerators, *(denominator for _, denominator in entries))


def transformation_sides(
    map_: Map, tensor: PoissonTensor, point: Sequence[Any], image: Sequence[Any], values: Sequence[Any] = ()
) -> tuple[Any, Any] | None:
    """Return the two sides N P(x) N^T and M P(x~) M^T of the transformation law, for x = `point` and x~ = `image`.

    `values` are the values of the symbols. Returns None at a pole of the tensor, and if P is 0 at both points, where
    the law is trivial. If the map is a composition, N and M belong to its last factor; the others transform P(x) first.
    """
    field, eps = map_.field, map_.eps
    P, P_image = (tensor.value(field, eps, (*x, *values)) for x in (point, image))
    if P is None or P_image is None or (_is_zero(field, P) and _is_zero(field, P_image)):
        return None
    *earlier_factors, (last_factor, last_point) = map_.stages(point)
    for factor, x in earlier_factors:
        jacobian = factor.jacobian(x)
        with field.working():
            P = jacobian * P * jacobian.transpose()
    N, M = last_factor.numerator_matrix(last_point, image), last_factor.denominator_matrix(last_point)
    with field.working():
        return N * P * N.transpose(), M * P_image * M.transpose()


def jacobi_defects(tensor: PoissonTensor, field: Field, eps: Any, point: Sequence[Any]) -> list[Any] | None:
    """Return the cyclic sums of sum_l P_il d_l P_jk over i, j, k, for all i < j < k; all are 0 if P is Poisson.

    Returns None at a pole, and if P is 0 at the point, since the sums are then 0 for every tensor.
    """
    n = tensor.dim
    P = tensor.value(field, eps, point)
    if P is None or _is_zero(field, P):
        return None
    with field.working():
        # derivatives[i][j, k] = sum_l P_il d_l P_jk, the derivative of P_jk in the direction of row i of P.
        derivatives = [tensor.derivative(field, eps, point, [P[i, l] for l in range(n)]) for i in range(n)]
        return [
            derivatives[i][j, k] + derivatives[j][k, i] + derivatives[k][i, j]
            for i in range(n)
            for j in range(i + 1, n)
            for k in range(j + 1, n)
        ]


def _is_zero(field: Field, matrix: Any) -> bool:
    """Whether all entries are 0; False over a BoundField, where P is only bounded and may be 0 or not."""
    return not isinstance(field, BoundField) and all(field.is_zero(entry) for entry in matrix.entries())
