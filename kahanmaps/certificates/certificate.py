"""The certificate of a system: which claims are proved, and the script for the program that is to check them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import integer
from kahanmaps.algebra.polynomials import RationalFunction, degree_in, ring
from kahanmaps.certificates.chains import commuting, periodic
from kahanmaps.certificates.combinations import affine_symmetry, bilinear_integral, modified_hamiltonian
from kahanmaps.certificates.identities import (
    Claim,
    FalseClaim,
    MapData,
    conserved_function,
    darboux_polynomial,
    invariant_tensor,
    invariant_volume,
    map_data,
)
from kahanmaps.certificates.rocq import rocq_certificate
from kahanmaps.certificates.scripts import GP, PYTHON, script_certificate
from kahanmaps.checks.claims import Certainty
from kahanmaps.checks.settings import claimed_functions
from kahanmaps.checks.theorems import listed_associates, poisson_tensor_invariant
from kahanmaps.documents.files import SystemFile, matched
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.laboratory.laboratory import separated
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import darboux_polynomials
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import find_poisson
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries
from kahanmaps.languages.formulas import Formulas
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanFamily, SystemLike, as_map

CHECKERS: dict[str, Callable[..., str]] = {
    "rocq": rocq_certificate,
    "gp": partial(script_certificate, GP),
    "sympy": partial(script_certificate, PYTHON),
}
VOLUME = "volume"  # the name of the claim that dx/phi is invariant
TENSOR = "poisson"
ASSOCIATES = "associates"  # instead of another system: the associated systems of a member of the commuting family


def certificate(
    system: SystemLike,
    checker: str,
    claims: Sequence[str] | None = None,
    integrals: Mapping[str, Any] | Any = None,
    *,
    everything: bool = False,
    commute: SystemLike | None = None,
    period: int | None = None,
    command: str = "",
) -> str:
    """Write a proof that another program checks: integrals, and the invariant volume form, for every eps.

    Args:
        system: the system, which stands for its Kahan map, or a map; of dimension at most 6.
        checker: "rocq" (Coq 8.16 or newer), "gp" (PARI/GP) or "sympy".
        claims: names of integrals of the file, "modified_hamiltonian" or "H0", "H1", ... for those that theorems give,
            "volume" for the invariant volume form, "poisson" for a Poisson tensor; "integrals", "density", "darboux"
            (Darboux polynomials up to degree 2) and "symmetry" for what a search finds and proves. None for all that
            need no search, or for `integrals` alone if these are given.
        integrals: further rational functions of x and eps, as `check_integrals` takes them.
        everything: also search, for all of these.
        commute: another system or map, in the same variables: certify that the two maps commute. For members of the
            commuting family this is written in coordinates in which the planes separate; "associates" stands for all
            pairs of rational associated systems.
        period: certify that this iterate of the map is the identity.
        command: the command line that writes this script, for the comment on top.

    Returns:
        The text of the script, exact. It defines the map by its equation M(x, eps) x~ = r(x, eps), states each claim,
        and proves it by identities of polynomials, without kahanmaps. The time step is 2 eps.

    Raises:
        FalseClaim: for a function that is not conserved.
        InputError: where no claim is known, for a name that is none, and for identities that are too long.

    Source: docs/mathematics.md, section "Certificates".

    >>> from kahanmaps.documents.catalog import load
    >>> print(certificate(load("harmonic"), "gp", ["E"]).splitlines()[-1])
    quit(!ok)
    """
    if checker not in CHECKERS:
        raise InputError(f"expected the checker {', '.join(CHECKERS)}, got {str(checker)[:40]!r}")
    file = as_file(system)
    formulas = Formulas(file)
    if file.map.root is not None:
        raise InputError(f"{file.name} has an algebraic number for a parameter: expected rational numbers")
    if not hasattr(formulas.map, "rows"):
        raise InputError(
            f"{file.name} is a {formulas.map.kind}: expected a single map, write one file for each of them"
        )
    data = _map_data(formulas)
    chains: list[Claim] = []
    if period is not None:
        chains.append(periodic(data, _positive(period)))
    if commute is not None:
        data, pair = _commuting(file, data, commute)
        chains += pair
        if period is not None or claims is not None or integrals is not None or everything:
            raise InputError("a certificate that two maps commute goes without other claims")
    further = {} if integrals is None else claimed_functions(file, integrals)
    proved = chains + [conserved_function(data, name, function) for name, function in further.items()]
    known = dict(_known_claims(formulas, data))
    searches = {name: partial(search, file, data) for name, search in _SEARCHES.items() if name not in known}
    if claims is None:
        claims = [] if (further or chains) and not everything else [*known, *(searches if everything else ())]
        is_required = False
    else:
        is_required = True
    skipped = []
    for name in claims:
        if name not in known and name not in searches:
            raise InputError(
                f"no claim {str(name)[:40]!r} of {file.name}: expected one of {', '.join([*known, *searches])}"
            )
        try:
            proved += [known[name]()] if name in known else searches[name]()
        except FalseClaim:
            raise
        except InputError as error:  # of all claims those that are short enough
            if is_required:
                raise
            skipped.append(f"{name}: {error}")
    if skipped and not proved:
        raise InputError(f"no certificate of {file.name} can be written: {skipped[0]}")
    if not proved:
        raise InputError(
            f"no integral or invariant volume form of {file.name} is known: give --integral NAME=EXPR, "
            f"or search with kahanmaps find-integrals {file.name} --toml"
        )
    return CHECKERS[checker](
        data, proved, [*formulas.header(command), *(f"Not in this certificate: {reason}" for reason in skipped)]
    )


def _map_data(formulas: Formulas) -> MapData:
    return map_data(formulas.equation, formulas.variables, formulas.new, (*formulas.names, "eps"))


def _positive(period: Any) -> int:
    if integer(period, "period") < 1:
        raise InputError(f"found period = {period}, expected a positive integer")
    return integer(period, "period")


def _commuting(file: SystemFile, data: MapData, other: SystemLike) -> tuple[MapData, list[Claim]]:
    """The map that the claims are about, and the claims: maps commute, in separate coordinates if there are any."""
    if isinstance(other, str) and other == ASSOCIATES:
        if file.member is None:
            raise InputError(f"{file.name} is of kind [{file.kind}]: expected a member of the commuting family")
        others = [associate.system for associate in listed_associates(file.member)]
        maps: list[MapFamily] = [as_map(system) for system in others]
    else:
        second = as_file(other)
        g, _ = matched(file, second)
        if g.variables != file.map.variables or not hasattr(g, "rows") or g.symbols:
            raise InputError(f"expected two single maps in the same variables, got {file.name} and {second.name}")
        maps = [file.map, g]

    def of(map_: MapFamily) -> MapData:
        rows = [[*row[:-1], -row[-1]] for row in map_.rows]
        return map_data(rows, data.variables, data.new, data.names)

    claims: list[Claim] = []
    given = [of(map_) for map_ in maps]
    separate = separated(file.system) if file.is_quadratic else None
    if separate is not None and all(isinstance(map_, KahanFamily) for map_ in maps):
        T, zero = separate.T, [fmpq(0)] * file.dim
        moved = [map_.system.composed(T, zero).transformed(T.inv()) for map_ in maps]  # type: ignore[attr-defined]
        in_planes = [of(as_map(system)) for system in moved]
        pairs = enumerate(zip(in_planes, given, strict=True), 1)
        claims += [affine_symmetry(z, f"coordinates_{k}", T, zero, target=x) for k, (z, x) in pairs]
        given = in_planes
    pairs_of = combinations(range(len(given)), 2)
    claims += [commuting(f"maps_{i + 1}_and_{j + 1}_commute", given[i], given[j]) for i, j in pairs_of]
    return given[0], claims


def _known_claims(formulas: Formulas, data: MapData) -> Iterator[tuple[str, Callable[[], Claim]]]:
    """What the file claims, or theorems give: by name the functions that find the identities."""
    for name, function in formulas.integrals.items():
        yield name, partial(conserved_function, data, name, function)
    H, file = formulas.H, formulas.file
    if H is not None:
        yield "modified_hamiltonian", partial(modified_hamiltonian, data, "modified_hamiltonian", H)
    for name, form in formulas.forms.items():
        yield name, partial(bilinear_integral, data, name, form)
    if formulas.density is not None:
        yield VOLUME, partial(invariant_volume, data, VOLUME, formulas.density)
    elif H is not None:
        yield VOLUME, lambda: invariant_volume(data, VOLUME, _polynomial(data.determinant))
    if file.hamiltonian is not None and poisson_tensor_invariant(file.hamiltonian, file.member) is not None:
        yield TENSOR, lambda: invariant_tensor(data, TENSOR, _hamiltonian_tensor(formulas))


def _search_integrals(file: SystemFile, data: MapData) -> list[Claim]:
    found = [found for found in find_integrals(file).integrals if found.verdict is Certainty.PROVED]
    return [conserved_function(data, integral.name, integral.function) for integral in found]


def _search_density(file: SystemFile, data: MapData) -> list[Claim]:
    found = [found for found in find_densities(file).densities if found.verdict is Certainty.PROVED]
    return [invariant_volume(data, f"{VOLUME}_{k}", density.function) for k, density in enumerate(found, 1)]


def _search_tensors(file: SystemFile, data: MapData) -> list[Claim]:
    proved = Certainty.PROVED
    found = [found for found in find_poisson(file).tensors if found.verdict is proved and found.jacobi is proved]
    return [invariant_tensor(data, tensor.name, tensor.tensor.rows) for tensor in found]


def _search_darboux(file: SystemFile, data: MapData) -> list[Claim]:
    spaces = [space for space in darboux_polynomials(file, 2).spaces if space.verdict is Certainty.PROVED]
    # The cofactor of a factor of det M has that factor in its denominator: it is no polynomial over D^k.
    polynomials = [
        P for space in spaces for P in space.polynomials if degree_in(P.gcd(data.determinant), data.dim) <= 0
    ]
    return [darboux_polynomial(data, f"D{k}", P) for k, P in enumerate(polynomials, 1)]


def _search_symmetries(file: SystemFile, data: MapData) -> list[Claim]:
    found = [symmetry for symmetry in linear_symmetries(file).generators if not symmetry.is_trivial]
    return [affine_symmetry(data, f"T{k}", T.S, T.r, T.reversing) for k, T in enumerate(found, 1)]


_SEARCHES = {
    "integrals": _search_integrals,
    "density": _search_density,
    TENSOR: _search_tensors,
    "darboux": _search_darboux,
    "symmetry": _search_symmetries,
}


def _hamiltonian_tensor(formulas: Formulas) -> list[list[RationalFunction]]:
    """Pi = J - eps^2 f'^2 J."""
    assert formulas.file.hamiltonian is not None
    context, J, n = ring((*formulas.names, "eps")), formulas.file.hamiltonian.J, formulas.dim
    *letters, eps = context.gens()
    slopes = [[entry.compose(*letters, ctx=context) for entry in row] for row in formulas.jacobian]

    def times(A: Sequence[Sequence[Any]], B: Sequence[Sequence[Any]]) -> list[list[fmpq_mpoly]]:
        return [[sum((a * B[k][j] for k, a in enumerate(row)), context.constant(0)) for j in range(n)] for row in A]

    square = times(times(slopes, slopes), J.tolist())
    return [[_polynomial(J[i, j] - eps**2 * square[i][j]) for j in range(n)] for i in range(n)]


def _polynomial(polynomial: fmpq_mpoly) -> RationalFunction:
    return RationalFunction(polynomial, polynomial.context().constant(1))
