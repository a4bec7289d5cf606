"""The certificate of a system: the choice of the claims, and the script for the program that checks their proofs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import integer
from kahanmaps.algebra.polynomials import RationalFunction, degree_in, ring
from kahanmaps.certificates.chains import commuting, periodic
from kahanmaps.certificates.combinations import (
    AffineSymmetry,
    affine_symmetry,
    bilinear_integral,
    changed_function,
    modified_hamiltonian,
)
from kahanmaps.certificates.darboux import conserved_function, darboux_polynomial, invariant_volume
from kahanmaps.certificates.entropy import positive_entropy
from kahanmaps.certificates.identities import (
    Claim,
    FalseClaim,
    MapData,
    invariant_tensor,
    limited,
    map_data,
    restricted,
)
from kahanmaps.certificates.rocq import rocq_certificate
from kahanmaps.certificates.scripts import GP, PYTHON, script_certificate
from kahanmaps.checks.claims import Certainty
from kahanmaps.checks.settings import claimed_function, claimed_functions, claimed_tensor
from kahanmaps.checks.theorems import listed_associates, poisson_tensor_invariant
from kahanmaps.documents.files import SystemFile, matched
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.laboratory.laboratory import Separated, separated
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import DarbouxSearch, darboux_polynomials
from kahanmaps.laboratory.preserve.densities import DensitySearch, find_densities
from kahanmaps.laboratory.preserve.integrals import IntegralSearch, find_integrals
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import PoissonSearch, find_poisson
from kahanmaps.laboratory.preserve.results import Search
from kahanmaps.laboratory.symmetry.symmetries import Symmetries, linear_symmetries
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
ENTROPY = "entropy"  # positive algebraic entropy, hence not integrable
UNPROVED = "Pi"  # J - eps^2 f'^2 J, where no theorem says that it is invariant
ASSOCIATES = "associates"  # instead of another system: the associated systems of a member of the commuting family


def certificate(
    system: SystemLike,
    checker: str,
    claims: Sequence[str] | None = None,
    integrals: Mapping[str, Any] | Any = None,
    *,
    density: Any = None,
    tensor: Any = None,
    everything: bool = False,
    commute: SystemLike | None = None,
    period: int | None = None,
    effort: int = 1,
    command: str = "",
) -> str:
    """Write a proof that another program checks: integrals, invariant volume forms and further claims, for every eps.

    Args:
        system: the system, which stands for its Kahan map, or a map; of dimension at most 6.
        checker: "rocq" (Coq 8.16 or newer), "gp" (PARI/GP) or "sympy".
        claims: names of integrals of the file, "modified_hamiltonian" or "H0", "H1", ... for those that theorems give,
            "volume" for the invariant volume form, "poisson" for a Poisson tensor; "integrals", "density", "darboux"
            (Darboux polynomials up to degree 2) and "symmetry" for what a search finds and proves; "entropy" for
            positive entropy of a map of the plane (gp and sympy only). None: only the claims of the following arguments
            or, without any, all claims that need no search.
        integrals: further rational functions of x and eps, as `check_integrals` takes them.
        density: phi, as `check_measure` takes it.
        tensor: a Poisson tensor, as `check_poisson` takes it.
        everything: whether to search for all of these claims, too.
        commute: another system or map, in the same variables: certify that the two maps commute. For members of the
            commuting family the proof uses coordinates in which the planes separate; "associates" stands for all pairs
            of rational associated systems.
        period: certify that this iterate of the map is the identity.
        effort: each increase by 1 doubles the limit for the length of the identities.
        command: the command line that writes this script, for the comment on top.

    Returns:
        The text of the script, exact. It defines the map by its equation M(x, eps) x~ = r(x, eps), states each claim,
        and proves it by identities of polynomials, without kahanmaps. The time step is 2 eps.

    Raises:
        FalseClaim: for a claim that is not true.
        InputError: if no claim is known, for unknown names, and for identities that are too long.

    Source: docs/mathematics.md, section "Certificates".

    >>> from kahanmaps.documents.catalog import load
    >>> print(certificate(load("harmonic"), "gp", ["E"]).splitlines()[-1])
    quit(!ok)
    """
    if isinstance(claims, str):
        raise InputError(f"found claims = {claims!r}, expected a list: claims=[{claims!r}]")
    with limited(effort):
        file = as_file(system)
        formulas, data = _prepared(file, checker)
        planes, proved = _Planes(file, data), list[Claim]()
        if commute is not None:
            if any(other is not None for other in (claims, integrals, density, tensor, period)) or everything:
                raise InputError("a certificate that two maps commute cannot be combined with other claims")
            proved = _commuting(file, data, commute)
        if period is not None:
            if integer(period, "period") < 1:
                raise InputError(f"found period = {period}, expected a positive integer")
            proved.append(periodic(data, integer(period, "period")))
        if integrals is not None:
            for name, f in claimed_functions(file, integrals).items():
                proved += planes.claims(conserved_function, name, f)
        if density is not None:
            proved.append(invariant_volume(data, VOLUME, claimed_function(file, density)))
        if tensor is not None:
            matrix = claimed_tensor(file, tensor)
            assert matrix is not None
            proved.append(invariant_tensor(data, "P", matrix.rows))
        known = dict(_known_claims(formulas, planes))
        searches = {name: search for name, search in _SEARCHES.items() if name not in known}
        is_required = claims is not None
        if claims is None:
            claims = [] if proved and not everything else [*known, *(searches if everything else ())]
            unwanted = {UNPROVED} | (set() if file.is_quadratic else {"symmetry"})
            has_integral = bool(formulas.integrals) or formulas.H is not None  # hence no positive entropy
            unwanted |= {ENTROPY} if has_integral or checker == "rocq" or not everything else set()
            claims = [name for name in claims if name not in unwanted]
        skipped = []
        for name in claims:
            if name not in known and name not in searches:
                expected = ", ".join([*known, *searches])
                raise InputError(f"no claim {str(name)[:40]!r} of {file.name}: expected one of {expected}")
            try:
                new = known[name]() if name in known else _claims_of(searches[name](file), data, planes)
                if is_required and not new:
                    raise InputError(
                        f"the search for {name!r} proves nothing about {file.name}: no certificate is written"
                    )
                proved += [claim for claim in new if all(claim is not other for other in proved)]
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
            proved, [*formulas.header(command), *(f"Not in this certificate: {reason}" for reason in skipped)]
        )


def known_claims(file: SystemFile, check: str) -> list[str]:
    """Return the names of the claims of a certificate that a check covers: integrals, measure or poisson.

    >>> from kahanmaps.documents.catalog import load
    >>> known_claims(load("euler_top"), "integrals")
    ['F1', 'F2']
    """
    formulas, data = _prepared(file, "gp")
    names = [name for name, _ in _known_claims(formulas, _Planes(file, data))]
    special = {"measure": {VOLUME}, "poisson": {TENSOR, UNPROVED}}
    if check in special:
        return [name for name in names if name in special[check]]
    return [name for name in names if name not in (VOLUME, TENSOR, UNPROVED, ENTROPY)]


def certificate_of(result: Any, checker: str, *, command: str = "") -> str:
    """Write a proof, checked by another program, of the results that a search has found and proved.

    Args:
        result: a result, for every eps, of `find_integrals`, `find_density`, `find_poisson`, `darboux_polynomials` or
            `find_symmetry`.
        checker: "rocq" (Coq 8.16 or newer), "gp" (PARI/GP) or "sympy".
        command: the command line that writes this script, for the comment on top.

    Returns:
        The text of the script, exact, as that of `certificate`. Symbols of the search stay symbols.

    Raises:
        InputError: if nothing is proved, for results at one eps or of the flow, and if identities are too long.

    >>> from kahanmaps.documents.catalog import load
    >>> print(certificate_of(find_poisson(load("lotka_volterra")), "gp").splitlines()[-1])
    quit(!ok)
    """
    if not isinstance(result, Search | Symmetries):
        raise InputError(f"expected the result of a search, got {type(result).__name__}: use certificate(system, ...)")
    if isinstance(result, Symmetries):
        file, symbols = SystemFile.from_system(result.system, "system"), result.system.symbols
    else:
        file, symbols = result.file, result.symbols
        if result.flow or result.eps is not None:
            what = "the flow" if result.flow else f"eps = {result.eps}"
            raise InputError(f"a certificate is about a map, for every eps: found a result for {what}")
    formulas, data = _prepared(file, checker, symbols)
    claims = _claims_of(result, data)
    if not claims:
        raise InputError(f"nothing is proved in this result about {file.name}: no certificate can be written")
    return CHECKERS[checker](claims, formulas.header(command))


def _prepared(file: SystemFile, checker: str, symbols: Sequence[str] = ()) -> tuple[Formulas, MapData]:
    """The formulas of a single map over Q, and its equation."""
    if checker not in CHECKERS:
        raise InputError(f"expected the checker {', '.join(CHECKERS)}, got {str(checker)[:40]!r}")
    if file.map.root is not None:
        raise InputError(f"{file.name} has an algebraic number for a parameter: expected rational numbers")
    formulas = Formulas(file, symbols)
    if not hasattr(formulas.map, "rows"):
        raise InputError(
            f"{file.name} is a {formulas.map.kind}: expected a single map, write one file for each of them"
        )
    return formulas, map_data(formulas.equation, formulas.variables, formulas.new, (*formulas.names, "eps"))


def _commuting(file: SystemFile, data: MapData, other: SystemLike) -> list[Claim]:
    """The claims that two maps commute, in coordinates in which the planes separate if there are any."""
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

    claims: list[Claim] = []
    given = [data.with_rows(map_.rows) for map_ in maps]
    separate = separated(file.system) if file.is_quadratic else None
    if separate is not None and all(isinstance(map_, KahanFamily) for map_ in maps):
        T, zero = separate.T, [fmpq(0)] * file.dim
        moved = [map_.system.composed(T, zero).transformed(T.inv()) for map_ in maps]  # type: ignore[attr-defined]
        in_planes = [data.with_rows(as_map(system).rows) for system in moved]
        pairs = enumerate(zip(in_planes, given, strict=True), 1)
        claims += [affine_symmetry(z, f"coordinates_{k}", T, zero, target=x) for k, (z, x) in pairs]
        given = in_planes
    pairs_of = combinations(range(len(given)), 2)
    claims += [commuting(f"maps_{i + 1}_and_{j + 1}_commute", given[i], given[j]) for i, j in pairs_of]
    return claims


def _known_claims(formulas: Formulas, planes: _Planes) -> Iterator[tuple[str, Callable[[], list[Claim]]]]:
    """The claims of the file and those that theorems give: functions, by name, that find the identities."""
    H, file, data = formulas.H, formulas.file, planes.data

    def one(find: Callable[..., Claim], *arguments: Any) -> Callable[[], list[Claim]]:
        return lambda: [find(data, *arguments)]

    for name, function in formulas.integrals.items():
        yield name, partial(planes.claims, conserved_function, name, function)
    if H is not None:
        yield "modified_hamiltonian", one(modified_hamiltonian, "modified_hamiltonian", H)
    for name, form in formulas.forms.items():
        yield name, one(bilinear_integral, name, form)
    if formulas.density is not None:
        yield VOLUME, one(invariant_volume, VOLUME, formulas.density)
    elif H is not None:
        yield VOLUME, lambda: [invariant_volume(data, VOLUME, _polynomial(data.determinant))]
    if data.dim == 2:
        yield ENTROPY, lambda: [positive_entropy(data, data.with_rows(formulas.map.inverse_rows))]
    if file.hamiltonian is not None:
        is_theorem = poisson_tensor_invariant(file.hamiltonian, file.member) is not None
        name = TENSOR if is_theorem else UNPROVED
        yield name, lambda: [invariant_tensor(data, name, _hamiltonian_tensor(formulas))]


@dataclass(frozen=True)
class _Planes:
    """Proofs about a function of one plane of a member of the commuting family, in coordinates z with x = T z."""

    file: SystemFile
    data: MapData

    @cached_property
    def separate(self) -> tuple[Separated, AffineSymmetry] | None:
        """The system in these coordinates, if it is shorter, and the claim that T takes its map to the given one."""
        file, n = self.file, self.data.dim
        has_symbols = len(self.data.names) > n + 1
        separate = None if file.member is None or has_symbols else separated(file.system)
        if separate is None:
            return None
        in_planes = self.data.with_rows(as_map(separate.system).rows)
        return separate, affine_symmetry(in_planes, "coordinates", separate.T, [fmpq(0)] * n, target=self.data)

    def claims(self, prove: Callable[..., Claim], name: str, function: RationalFunction) -> list[Claim]:
        """The claims that `prove` finds about the function, in its plane if it depends on one plane only."""
        if self.separate is not None:
            separate, way = self.separate
            moved = separate.function(function)
            plane = restricted(way.data, moved)
            if plane is not way.data:
                proof = prove(plane, f"{name}_in_its_plane", moved)
                return [way, changed_function(way, name, function, moved, plane.names), proof]
        return [prove(self.data, name, function)]


def _claims_of(result: Any, data: MapData, planes: _Planes | None = None) -> list[Claim]:
    """The claims about the map that the result of a search proves."""
    proved = Certainty.PROVED
    if isinstance(result, IntegralSearch):
        planes = planes or _Planes(result.file, data)
        found = [integral for integral in result.integrals if integral.verdict is proved]
        return [claim for I in found for claim in planes.claims(conserved_function, I.name, I.function)]
    if isinstance(result, DensitySearch):
        densities = [density for density in result.shown if density.verdict is proved]  # the others are multiples
        return [invariant_volume(data, f"{VOLUME}_{k}", phi.function) for k, phi in enumerate(densities, 1)]
    if isinstance(result, PoissonSearch):
        tensors = [tensor for tensor in result.tensors if tensor.verdict is proved and tensor.jacobi is proved]
        return [invariant_tensor(data, tensor.name, tensor.tensor.rows) for tensor in tensors]
    if isinstance(result, DarbouxSearch):
        planes = planes or _Planes(result.file, data)
        polynomials = [P for space in result.spaces if space.verdict is proved for P in space.polynomials]
        # The cofactor of a factor of det M has that factor in its denominator: it is no polynomial over D^k.
        polynomials = [P for P in polynomials if degree_in(P.gcd(data.determinant), data.dim) <= 0]
        functions = [(f"D{k}", _polynomial(P)) for k, P in enumerate(polynomials, 1)]
        return [claim for name, P in functions for claim in planes.claims(darboux_polynomial, name, P)]
    assert isinstance(result, Symmetries)
    symmetries = [symmetry for symmetry in result.generators if not symmetry.is_trivial]
    return [affine_symmetry(data, f"T{k}", T.S, T.r, T.reversing) for k, T in enumerate(symmetries, 1)]


_SEARCHES: dict[str, Callable[[SystemFile], Any]] = {
    "integrals": find_integrals,
    "density": find_densities,
    TENSOR: find_poisson,
    "darboux": partial(darboux_polynomials, max_degree=2),
    "symmetry": linear_symmetries,
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
