"""The normal form of a system, for fast orbits and for the n-th iterate without the iterates before it.

A member of the family has a normal form if chi has no repeated root. A system that is not declared as a member is
recognized as a member if linear algebra finds a matrix A for its Hamiltonian (recognition.py).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from flint import fmpq_mat

from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import HypothesisError
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem, as_system

if TYPE_CHECKING:
    from kahanmaps.family.associated import FamilyMember
    from kahanmaps.family.planar import NormalForm

_MAX_DIMENSION = 32  # largest dimension in which a normal form is searched for


@dataclass(frozen=True, eq=False)
class SystemNormalForm(ResultPart):
    """The normal form `form` of a system in coordinates z: x = T S z with the matrix S of `form`; `T` is None if T = I.

    `declared` says whether the system was given as a member of the family; `text` describes its membership.
    """

    form: NormalForm
    T: fmpq_mat | None
    declared: bool
    text: str

    @property
    def A(self) -> fmpq_mat:
        """The matrix A in the system's own coordinates, as in `FamilyStructure`."""
        return self.form.A if self.T is None else self.T.inv().transpose() * self.form.A * self.T.transpose()


@dataclass(frozen=True)
class NoNormalForm(ResultPart):
    """The `reason` why there is no normal form; `text` and `T` are set for a member whose chi has a repeated root."""

    reason: str
    text: str = field(default="", compare=False)
    T: fmpq_mat | None = field(default=None, compare=False)


def system_normal_form(
    system: QuadraticSystem | Any, hamiltonian: CubicHamiltonian | None = None, member: FamilyMember | None = None
) -> SystemNormalForm | NoNormalForm:
    """Compute the normal form of a system, or the reason why it has none; exact.

    If the membership in the family or the Hamiltonian is known, pass it, so that it need not be searched for.

    >>> from kahanmaps.family.random_members import random_member_with_eigenvalues
    >>> system = random_member_with_eigenvalues([1, -2, 3], seed=7).chosen.system
    >>> system_normal_form(system).text
    'a recognised member of the family, chi = (t - 1)*(t - 2)*(t - 3)'
    """
    from kahanmaps.family.recognition import find_cubic_hamiltonian, find_family_structure, why_not_member

    system = as_system(system)
    if system.dim > _MAX_DIMENSION:
        return NoNormalForm(f"the dimension {system.dim} is above {_MAX_DIMENSION}")
    declared, T = member is not None, None
    if member is None:
        hamiltonian = hamiltonian or find_cubic_hamiltonian(system)
        structure = None if hamiltonian is None else find_family_structure(hamiltonian)
        if structure is None:
            return NoNormalForm(why_not_member(hamiltonian))
        member = structure.member
        T = None if structure.is_standard else structure.T
    chi_text = "*".join(
        f"({factor})" + f"^{factor.multiplicity}" * (factor.multiplicity > 1) for factor in member.factors
    )
    text = f"{'a' if declared else 'a recognised'} member of the family, chi = {chi_text}"
    from kahanmaps.family.planar import normal_form  # imported for members only

    try:
        form = normal_form(member)
    except HypothesisError:
        return NoNormalForm("chi has a repeated root", text, T)
    return SystemNormalForm(form, T, declared, text)
