"""The commuting family of Petrera and Suris: skew-Hamiltonian matrices, their cubics, and the associated systems.

The functions here have the names of the subcommands of `kahanmaps family`; `km.family(...)` is `km.family.new(...)`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from kahanmaps.function_calls import CallableModule

if TYPE_CHECKING:
    from kahanmaps.family.associated import AssociatedSystem, FamilyMember
    from kahanmaps.family.cubics import CubicSpace
    from kahanmaps.family.recognition import FamilyStructure


def new(
    m: int | None = None,
    *,
    eigenvalues: Sequence[Any] | None = None,
    chi: Any = None,
    generic: bool = False,
    size: int | None = None,
    seed: int = 0,
) -> FamilyMember:
    """Return a random member of the family.

    Args:
        m: half the dimension; the matrix A then has random integer eigenvalues, or a random chi if `generic` is True.
        eigenvalues: the eigenvalues of A, m exact numbers.
        chi: the polynomial with det(t - A) = chi(t)^2, as text such as "(t - 1)*(t^2 - 2)".
        size: a bound for the random integer coefficients of the cubic in the normal form.
        seed: the random seed.

    Raises:
        InputError: unless exactly one of m, eigenvalues and chi is given.

    >>> new(eigenvalues=[1, -2, 3], seed=7).m
    3
    """
    from kahanmaps.errors import InputError
    from kahanmaps.family import random_members as members

    if sum((eigenvalues is not None, chi is not None, generic)) > 1:
        raise InputError("expected one of eigenvalues=, chi= and generic=True")
    if eigenvalues is not None:
        member = members.random_member_with_eigenvalues(eigenvalues, seed, size or 2)
    elif chi is not None:
        polynomial = members.parse_chi(chi) if isinstance(chi, str) else chi
        member = members.random_member_with_chi(polynomial, seed, size or 1)
    elif not isinstance(m, int):
        raise InputError(f"found m = {m!r}, expected m=3, eigenvalues=[1, -2, 3] or chi='(t - 1)*(t^2 - 2)'")
    elif generic:
        member = members.random_member(m, seed, size or 1)
    else:
        member = members.random_member_with_eigenvalues(members.random_eigenvalues(m, seed), seed, size or 2)
    if m not in (None, member.m):
        raise InputError(f"found m = {m} and a member with m = {member.m}, expected the same number")
    return member


def show(system: Any) -> FamilyStructure | None:
    """Return the structure that makes a system a member of the family; None if no structure is found."""
    structure: FamilyStructure | None = import_module("kahanmaps.family.recognition").find_family_structure_of(system)
    return structure


def space(A: Any) -> CubicSpace:
    """Return the space of cubics H with A Hess(H) = Hess(H) A^T, for a matrix A, or the A of a member of the family."""
    from flint import fmpq_mat

    from kahanmaps.algebra.fields import rational
    from kahanmaps.family.cubics import cubic_space

    if isinstance(A, list | tuple):
        A = fmpq_mat([[rational(entry) for entry in row] for row in A])
    return cubic_space(A if isinstance(A, fmpq_mat) else _member(A).A)


def associated(member: Any) -> list[AssociatedSystem]:
    """Return all rational associated systems of a member, one of each pair f, -f."""
    return list(_member(member).associated())


def tensor(system: Any, algebra: Any) -> Any:
    """Return a system over K = Q[t]/(algebra) as a system file over Q; `algebra` is a text such as "t^2 - 2"."""
    from kahanmaps.family.random_members import parse_chi

    polynomial = parse_chi(algebra) if isinstance(algebra, str) else algebra
    return import_module("kahanmaps.documents.tensor").tensor_file(system, polynomial)


def _member(value: Any) -> FamilyMember:
    from kahanmaps.errors import InputError
    from kahanmaps.family.associated import FamilyMember

    if not isinstance(value, FamilyMember):
        value = import_module("kahanmaps.documents.inline").as_file(value).member
    if not isinstance(value, FamilyMember):
        raise InputError("found a system that is not declared as a member of the family, expected km.family.new(m=3)")
    return value


command = new
sys.modules[__name__].__class__ = CallableModule
