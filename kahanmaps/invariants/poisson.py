"""The Poisson tensor Pi(x) = J - eps^2 f'(x)^2 J.

Phi_f is Poisson for Pi when dPhi Pi(x) dPhi^T = Pi(x~); with dPhi = (I - eps f'(x))^{-1} (I + eps f'(x~)) this is

    (I + eps f'(x~)) Pi(x) (I + eps f'(x~))^T = (I - eps f'(x)) Pi(x~) (I - eps f'(x))^T,

free of denominators but for those of x~. Source: petrera-suris-2016, Theorem 12.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kahanmaps.algebra.fields import Field
from kahanmaps.invariants.sizes import Size, polynomial_size, step_size
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import CubicHamiltonian


def poisson_tensor(hamiltonian: CubicHamiltonian, field: Field, eps: Any, point: Sequence[Any]) -> Any:
    """The matrix Pi(x) = J - eps^2 f'(x)^2 J over `field`."""
    with field.working():
        jacobian = hamiltonian.system.over(field).jacobian(point)
        J = field.convert_matrix(hamiltonian.J)
        return J - jacobian * jacobian * J * (eps * eps)


def transformation_sides(
    kahan: KahanMap, hamiltonian: CubicHamiltonian, point: Sequence[Any], image: Sequence[Any]
) -> tuple[Any, Any]:
    """Both sides of the transformation law above, at x = `point` and x~ = `image`."""
    field, eps = kahan.field, kahan.eps
    forward, backward = kahan.inverse.denominator_matrix(image), kahan.denominator_matrix(point)
    with field.working():
        left = forward * poisson_tensor(hamiltonian, field, eps, point) * forward.transpose()
        right = backward * poisson_tensor(hamiltonian, field, eps, image) * backward.transpose()
        return left, right


def jacobi_defects(hamiltonian: CubicHamiltonian, field: Field, eps: Any, point: Sequence[Any]) -> list[Any]:
    """sum over l of Pi_il d_l Pi_jk + cyclic in i, j, k, for all i < j < k: zero when Pi is a Poisson tensor."""
    n = hamiltonian.dim
    local = hamiltonian.system.over(field)
    with field.working():
        jacobian = local.jacobian(point)
        J = field.convert_matrix(hamiltonian.J)
        square = -(eps * eps)
        Pi = poisson_tensor(hamiltonian, field, eps, point)
        # along[i][j, k] = sum_l Pi_il d_l Pi_jk, the derivative of Pi_jk along row i of Pi.
        along = []
        for i in range(n):
            second = local.hessian_times([Pi[i, l] for l in range(n)])
            along.append((second * jacobian + jacobian * second) * J * square)
        return [
            along[i][j, k] + along[j][k, i] + along[k][i, j]
            for i in range(n)
            for j in range(i + 1, n)
            for k in range(j + 1, n)
        ]


def transformation_size(hamiltonian: CubicHamiltonian, eps: Size, point: Size) -> Size:
    """The polynomial that vanishes when an entry of the transformation law holds."""
    image = step_size(hamiltonian.system, eps, point)
    forward, backward = _denominator_entry(hamiltonian, eps, image), _denominator_entry(hamiltonian, eps, point)
    sum_of_squares = Size(0, 2.0 * hamiltonian.dim.bit_length())
    left = forward**2 * _tensor_entry(hamiltonian, eps, point) * image**2
    right = backward**2 * _tensor_entry(hamiltonian, eps, image) * point**2
    return sum_of_squares * (left + right)


def jacobi_size(hamiltonian: CubicHamiltonian, eps: Size, point: Size) -> Size:
    """The polynomial that vanishes when one Jacobi identity holds (x itself, so no denominators but of eps)."""
    tensor = _tensor_entry(hamiltonian, eps, point)
    # A derivative of a polynomial of degree 2 at most doubles the coefficients; 3 n such products are added.
    return Size(0, 3.6 + hamiltonian.dim.bit_length()) * tensor * tensor


def _denominator_entry(hamiltonian: CubicHamiltonian, eps: Size, point: Size) -> Size:
    """An entry of q L W - p L f'."""
    return eps * point * Size(0, _system_bits(hamiltonian))


def _tensor_entry(hamiltonian: CubicHamiltonian, eps: Size, point: Size) -> Size:
    """An entry of (q L W)^2 d Pi, d the denominator of J: n^2 products of two entries of f' and one of J."""
    above, _ = hamiltonian.J.numer_denom()  # d J and d
    J_bits = max(entry.bit_length() for entry in above.entries())
    square = (eps * point * Size(0, _system_bits(hamiltonian))) ** 2
    return square * Size(0, float(J_bits) + 2.0 * hamiltonian.dim.bit_length() + 1)


def _system_bits(hamiltonian: CubicHamiltonian) -> float:
    """log2 of a bound for L plus the coefficient sum of any entry of L f'."""
    bits = 1.0
    for polynomial in hamiltonian.system.rhs:
        size, _ = polynomial_size(polynomial)
        bits = max(bits, size.bits + 1.59)  # 1 + 2 S <= 3 S
    common = hamiltonian.system.integer_form[0]
    return bits + float(common.bit_length())
