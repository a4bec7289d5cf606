"""Members of the family for the tests of the paper's claims: every kind of spectrum, for every m that is quick."""

import random
from functools import cache
from typing import Any

from flint import fmpq_poly

from kahanmaps import FamilyMember, Settings, SystemFile, random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.algebra.chance import random_prime_field
from kahanmaps.errors import BadPrime
from kahanmaps.family.skew_hamiltonian import chi as chi_of
from kahanmaps.paper import specialize
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Claim, claims
from kahanmaps.paper.verify import Verifier, VerifyOptions

t = fmpq_poly([0, 1])

# Eigenvalues, or chi.
SPECTRA: dict[str, Any] = {
    "m=1": [2],
    "m=2, split": [1, -2],
    "m=2, irreducible": t**2 - 2,
    "m=2, complex": t**2 + 1,
    "m=3, split": [1, -2, 3],
    "m=3, irreducible": t**3 - t - 1,
    "m=3, partly split": (t - 1) * (t**2 - 2),
    "m=3, complex": (t - 1) * (t**2 + 1),
    "m=4, split": [1, -2, 3, 5],
    "m=4, irreducible": t**4 + t + 1,
    "m=4, partly split": (t - 1) * (t + 2) * (t**2 - 2),
    "m=4, complex": (t**2 + 1) * (t**2 + t + 3),
}
LARGE_SPECTRA: dict[str, Any] = {
    "m=5, split": [1, -2, 3, 5, -4],
    "m=5, irreducible": t**5 - t - 1,
    "m=5, partly split": (t - 1) * (t + 2) * (t**3 - 2),
    "m=6, split": [1, -2, 3, 5, -4, 7],
    "m=6, complex": (t**2 + 1) * (t**2 + t + 3) * (t - 1) * (t + 2),
}


@cache
def member(name: str) -> FamilyMember:
    """The member of one spectrum, one object for all tests."""
    spectrum = {**SPECTRA, **LARGE_SPECTRA}[name]
    draw = random_member_with_eigenvalues if isinstance(spectrum, list) else random_member_with_chi
    return draw(spectrum, seed=3)


def file(name: str) -> SystemFile:
    """The file of kind [family] of a member."""
    return SystemFile.from_member(member(name), name)


@cache
def point(name: str, number: int = 0) -> PaperObjects:
    """A random point of a member over a field GF(p) in which chi splits; the same one for all tests."""
    result, rng = member(name), random.Random(f"{name} {number}")
    rational = specialize.rational_roots(result)
    while True:
        try:
            if rational is None:
                split = specialize.split_prime_field(chi_of(result.A), rng, 100_000)
                assert split is not None
                K, roots = split
            else:
                K = random_prime_field(rng)
                roots = tuple(K.convert(root) for root in rational)
            return specialize.point_over(result, K, roots, None, rng, 3)
        except BadPrime:
            continue


def verifier_of(member: FamilyMember | None, m: int = 0) -> Verifier:
    """The verifier of a member, or of the member in general, without options."""
    return Verifier(member, m if member is None else member.m, Settings(), VerifyOptions())


def named(key: str) -> Claim:
    """The claim with this key."""
    (result,) = (claim for claim in claims() if claim.key == key)
    return result


def values(side: Any) -> list[Any]:
    """The entries of a side of a claim: of a matrix, or of a number."""
    return list(side.entries()) if hasattr(side, "entries") else [side]
