"""The Poisson tensor Pi(x) = J - eps^2 f'(x)^2 J.

Phi_f is Poisson for Pi when dPhi Pi(x) dPhi^T = Pi(x~); with dPhi = (I - eps f'(x))^{-1} (I + eps f'(x~)) this is

    (I + eps f'(x~)) Pi(x) (I + eps f'(x~))^T = (I - eps f'(x)) Pi(x~) (I - eps f'(x))^T,

free of denominators but for those of x~. Source: petrera-suris-2016, Theorem 12.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kahanmaps.algebra.fields import Field
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
