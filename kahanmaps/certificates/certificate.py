"""The certificate of a system: its claims, and the script for the program that checks their proofs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import integer
from kahanmaps.algebra.parsing import parse_polynomial
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
    FalseClaim,
    MapClaim,
    MapData,
    invariant_tensor,
    limited,
    map_data,
    restrict,
)
from kahanmaps.certificates.rocq import rocq_certificate
from kahanmaps.certificates.scripts import GP, PYTHON, script_certificate
from kahanmaps.checks.claims import Certainty, Finding, Report
from kahanmaps.checks.settings import claimed_function, claimed_functions, claimed_tensor
from kahanmaps.checks.theorems import listed_associates, poisson_tensor_invariant
from kahanmaps.documents.expressions import formula_text
from kahanmaps.documents.files import SystemFile, match_variables
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError, counted
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.laboratory.laboratory import SeparatedSystem, separate_planes
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import DarbouxSearch, darboux_polynomials
from kahanmaps.laboratory.preserve.densities import DensitySearch, find_densities
from kahanmaps.laboratory.preserve.integrals import IntegralSearch, find_integrals
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import PoissonSearch, find_poisson
from kahanmaps.laboratory.preserve.results import Search
from kahanmaps.laboratory.symmetry.commuting import CommutingSystems
from kahanmaps.laboratory.symmetry.symmetries import Symmetries, linear_symmetries
from kahanmaps.laboratory.vector_field.equivalence import Equivalence, equivalent_system
from kahanmaps.languages.formulas import Formulas
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanFamily, SystemLike, as_map

CHECKERS: dict[str, Callable[..., str]] = {
    "rocq": rocq_certificate,
    "gp": partial(script_certificate, GP),
    "sympy": partial(script_certificate, PYTHON),
}
# Measured seconds of each program: to start, for each byte of the text, and for each term that is multiplied out.
_SECONDS = {"rocq": (1.7, 2.2e-4, 7e-5), "gp": (0.05, 5e-6, 0.0), "sympy": (0.6, 0.0, 1.8e-5)}
VOLUME = "volume"  # the claim that the volume form dx/phi is invariant
TENSOR = "poisson"  # the claim that a Poisson tensor is invariant and satisfies the Jacobi identity
ENTROPY = "entropy"  # the claim of positive algebraic entropy, hence of nonintegrability
DETERMINANT = "determinant"  # the claim that dx/det(I - eps f') is invariant, if the file claims another density
UNPROVED = "Pi"  # the claim that J - eps^2 f'^2 J is invariant, if no theorem implies it
ASSOCIATES = "associates"  # stands for the associated systems of a member of the commuting family


class Certificate(str):
    """The text of a certificate; `claims` are the names of its claims.

    `seconds` is an estimate of the processor time that the program takes to check it, from the sizes of the identities.
    """

    __slots__ = ("claims", "seconds")
    claims: tuple[str, ...]
    seconds: float

    @classmethod
    def of(
        cls, checker: str, claims: Sequence[MapClaim], header: Sequence[str], skipped: Sequence[str], terms: int
    ) -> Certificate:
        """Write the script; `terms` is the number of terms that the program multiplies out."""
        names_and_texts = [(claim.name, getattr(claim, "about", "")) for claim in claims]
        about_lines = [f"{name}: {text}" for name, text in dict.fromkeys(names_and_texts) if text]
        skipped_lines = [f"Not in this certificate: {reason}" for reason in skipped]
        text = cls(CHECKERS[checker](claims, [*header, *about_lines, *skipped_lines]))
        text.claims = tuple(claim.name for claim in claims)
        startup_seconds, seconds_per_byte, seconds_per_term = _SECONDS[checker]
        text.seconds = startup_seconds + seconds_per_byte * len(text.encode()) + seconds_per_term * terms
        return text

    @property
    def summary(self) -> str:
        """The number of claims, the number of bytes of the text, and the estimated time of the check, as a phrase."""
        time = f"about {self.seconds:.2g} seconds" if self.seconds >= 1 else "less than a second"
        return f"{counted(len(self.claims), 'claim')}, {len(self.encode())} bytes, {time} to check"


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
    equivalent: SystemLike | None = None,
    by: Sequence[Any] = (),
    period: int | None = None,
    effort: int = 1,
    command: str = "",
) -> Certificate:
    """Write a proof for another program to check: integrals, invariant volume forms and other claims, for every eps.

    Args:
        system: the system, which stands for its Kahan map, or a map; of dimension at most 6.
        checker: "rocq" (Coq 8.16 or newer), "gp" (PARI/GP) or "sympy".
        claims: names of integrals of the file; "modified_hamiltonian" or "H0", "H1", ... for integrals given by
            theorems; "volume" for the invariant volume form; "poisson" for a Poisson tensor. Names of claims that a
            search finds and proves: "integrals", "density", "darboux" (Darboux polynomials up to degree 2),
            "symmetry", "equivalence" (to a system of the catalogue). "entropy": positive entropy of a map of the plane,
            from a theorem that is assumed. None: all claims without a search, or those of the following arguments only.
        integrals: further rational functions of x and eps, given as for `check_integrals`.
        density: phi, given as for `check_measure`.
        tensor: a Poisson tensor, given as for `check_poisson`.
        everything: if `claims` is None, all claims, also "entropy" and those that need a search.
        commute: another system or map in the same variables: certify that the two maps commute. For members of the
            commuting family the proof uses coordinates in which the planes separate. "associates" stands for all pairs
            of rational associated systems.
        equivalent: another quadratic system g of the same dimension: certify that T takes the Kahan map to that of g.
        by: T, as one text for each variable of g: a polynomial of degree 1 in the variables.
        period: certify that the iterate of the map with this number of steps is the identity.
        effort: each increase by 1 doubles the limit for the length of the identities.
        command: the command line that writes this script, for the comment at its beginning.

    Returns:
        The exact text of the script. It defines the map by its equation M(x, eps) x~ = r(x, eps), states each claim,
        and proves it by polynomial identities, without kahanmaps. The time step is 2 eps. The text has two attributes:
        `claims`, the names of the claims, and `seconds`, an estimate of the time that the program takes.

    Raises:
        FalseClaim: if a claim is not true.
        InputError: if there is nothing to claim, a name is unknown, or an identity is too long.

    Source: docs/mathematics.md, section "Certificates".

    >>> from kahanmaps.documents.catalog import load
    >>> print(certificate(load("harmonic"), "gp", ["E"]).splitlines()[-1])
    quit(!ok)
    """
    if isinstance(claims, str):
        raise InputError(f"found claims = {claims!r}, expected a list: claims=[{claims!r}]")
    with limited(effort) as limits:
        file = as_file(system)
        formulas, data = _prepare(file, checker)
        planes, proved_claims = _Planes(file, data), list[MapClaim]()
        if commute is not None:
            other_arguments = (claims, integrals, density, tensor, period, equivalent)
            if everything or any(other is not None for other in other_arguments):
                raise InputError("a certificate that two maps commute cannot be combined with other claims")
            proved_claims = _commuting_claims(file, data, commute)
        if equivalent is not None:
            proved_claims.append(_equivalence_claim(file, data, as_file(equivalent), by))
        if period is not None:
            if integer(period, "period") < 1:
                raise InputError(f"found period = {period}, expected a positive integer")
            proved_claims.append(periodic(data, integer(period, "period")))
        if integrals is not None:
            for name, f in claimed_functions(file, integrals).items():
                proved_claims += planes.claims(conserved_function, name, f)
        if density is not None:
            proved_claims.append(invariant_volume(data, VOLUME, claimed_function(file, density)))
        if tensor is not None:
            matrix = claimed_tensor(file, tensor)
            assert matrix is not None
            proved_claims.append(invariant_tensor(data, "P", matrix.rows))
        provers = dict(_known_claims(formulas, planes, checker))
        searches = {name: search for name, search in _SEARCHES.items() if name not in provers}
        is_required = claims is not None
        if claims is None:
            claims = [] if proved_claims and not everything else [*provers, *(searches if everything else ())]
            omitted_names = {UNPROVED, DETERMINANT} | (set() if file.is_quadratic else {"symmetry", "equivalence"})
            has_integral = bool(formulas.integrals) or formulas.H is not None  # then the entropy is not positive
            omitted_names |= {ENTROPY} if has_integral or not everything else set()
            claims = [name for name in claims if name not in omitted_names]
        skipped = []
        for name in claims:
            if name not in provers and name not in searches:
                expected = ", ".join([*provers, *searches])
                raise InputError(f"no claim {str(name)[:40]!r} of {file.name}: expected one of {expected}")
            try:
                new_claims = provers[name]() if name in provers else _claims_of(searches[name](file), data, planes)
                if is_required and not new_claims:
                    raise InputError(
                        f"the search for {name!r} proves nothing about {file.name}: no certificate is written"
                    )
                proved_claims += [claim for claim in new_claims if all(claim is not other for other in proved_claims)]
            except FalseClaim:
                raise
            except InputError as error:  # if all claims are requested, those with too long identities are omitted
                if is_required:
                    raise
                skipped.append(f"{name}: {error}")
        if skipped and not proved_claims:
            raise InputError(f"no certificate of {file.name} can be written: {skipped[0]}")
        if not proved_claims and is_required:
            raise InputError("found an empty list of claims, expected names, or None for all that need no search")
        if not proved_claims:
            raise InputError(
                f"no integral or invariant volume form of {file.name} is known: give --integral NAME=EXPR, "
                f"or search with kahanmaps find-integrals {file.name} --toml"
            )
        return Certificate.of(checker, proved_claims, formulas.header(command), skipped, limits.terms)


def known_claims(file: SystemFile, check: str) -> list[str]:
    """Return the names of the claims that a certificate can prove for a check: integrals, measure or poisson.

    >>> from kahanmaps.documents.catalog import load
    >>> known_claims(load("euler_top"), "integrals")
    ['F1', 'F2']
    """
    formulas, data = _prepare(file, "gp")
    names = [name for name, _ in _known_claims(formulas, _Planes(file, data))]
    names_of_check = {"measure": {VOLUME, DETERMINANT}, "poisson": {TENSOR, UNPROVED}}
    if check in names_of_check:
        return [name for name in names if name in names_of_check[check]]
    return [name for name in names if name not in (VOLUME, DETERMINANT, TENSOR, UNPROVED, ENTROPY)]


def certificate_of(result: Any, checker: str, *, command: str = "") -> Certificate:
    """Write what a check or a search has proved about a map as a proof for another program to check.

    Args:
        result: the result of `analyze`, `verify`, a check or a search, valid for every eps, or one finding of a report.
        checker: "rocq" (Coq 8.16 or newer), "gp" (PARI/GP) or "sympy".
        command: the command line that writes this script, for the comment at its beginning.

    Returns:
        The exact text of the script, as for `certificate`. The symbols of a search remain symbols.

    Raises:
        FalseClaim: if a claim is not true.
        InputError: if nothing is proved, the result is for one eps or about the flow, or an identity is too
            long.

    >>> from kahanmaps.documents.catalog import load
    >>> print(certificate_of(find_poisson(load("lotka_volterra")), "gp").splitlines()[-1])
    quit(!ok)
    """
    result = getattr(result, "finding", result)  # a commuting system contains its finding
    if isinstance(result, Report | Finding):
        arguments = dict(result.certified)
        if "why_not" in arguments or not arguments:
            about = "no other program is told how to check these claims" if isinstance(result, Report) else result.claim
            raise InputError(arguments.get("why_not", f"no certificate is known for this claim: {about}"))
        if check := arguments.pop("known", ""):
            arguments["claims"] = known_claims(arguments["system"], check)
        return certificate(checker=checker, command=command, **arguments)
    sub_results: list[Any] = [result]
    skipped = list[str]()
    if isinstance(result, Analysis):
        sub_results = [result.integrals, result.densities, result.poisson]
        if result.symbols:
            skipped.append("symmetries, commuting and equivalent systems: they are about the values in the file")
        else:
            sub_results += [result.symmetries, result.commuting, result.equivalent]
    if isinstance(result, Analysis | Search):
        file, symbols = result.file, result.symbols
    elif isinstance(result, Equivalence) and result.file is not None:
        file, symbols = result.file, ()
    elif isinstance(result, Symmetries | CommutingSystems):
        file, symbols = SystemFile.from_system(result.system, "system"), result.system.symbols
    else:
        raise InputError(
            f"a {type(result).__name__} has no certificate: it proves nothing about a map, or is a part of a result; "
            "type result.certificate(checker) of the search or check, or km.certificate(system, checker)"
        )
    if root := getattr(result, "root", ""):
        raise InputError(f"the system has the {root} for a parameter: expected rational numbers for a certificate")
    is_of_flow, eps = getattr(result, "flow", False) is True, getattr(result, "eps", None)
    if is_of_flow or eps is not None:
        scope_text = "the flow" if is_of_flow else f"eps = {eps}"
        raise InputError(f"a certificate is about a map, for every eps: found a result for {scope_text}")
    formulas, data = _prepare(file, checker, symbols)
    claims = list[MapClaim]()
    provers: dict[str, Callable[[], list[Any]]] = {
        type(r).__name__: partial(_claims_of, r, data) for r in sub_results if r is not None
    }
    if isinstance(result, Analysis) and result.conclusion.kind == "not integrable" and data.dim == 2:
        provers[ENTROPY] = dict(_known_claims(formulas, _Planes(file, data), checker))[ENTROPY]
    with limited(1) as limits:
        for name, prove in provers.items():
            try:
                claims += prove()
            except FalseClaim:
                raise
            except InputError as error:  # results of an analysis with too long identities are omitted
                if sub_results == [result]:
                    raise
                skipped.append(f"{name}: {error}")
    if not claims:
        raise InputError("nothing was found that is proved: no certificate can be written")
    return Certificate.of(checker, claims, formulas.header(command), skipped, limits.terms)


def _prepare(file: SystemFile, checker: str, symbols: Sequence[str] = ()) -> tuple[Formulas, MapData]:
    """Return the formulas of a file with one map over Q, and the equation of this map."""
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


def _commuting_claims(file: SystemFile, data: MapData, other: SystemLike, label: str = "") -> list[MapClaim]:
    """The claims that maps commute, in coordinates that separate the planes if possible; names begin with `label`."""
    if isinstance(other, str) and other == ASSOCIATES:
        if file.member is None:
            raise InputError(f"{file.name} is of kind [{file.kind}]: expected a member of the commuting family")
        systems = [associate.system for associate in listed_associates(file.member)]
        systems += [systems[0].scaled(-1)] if len(systems) == 1 else []  # as in check_commute
        maps: list[MapFamily] = [as_map(system) for system in systems]
    else:
        other_file = as_file(other)
        g, _ = match_variables(file, other_file)
        if g.variables != file.map.variables or not hasattr(g, "rows") or g.symbols:
            raise InputError(f"expected two single maps in the same variables, got {file.name} and {other_file.name}")
        maps = [file.map, g]

    claims: list[MapClaim] = []
    map_data_list = [data.with_rows(map_.rows) for map_ in maps]
    separation = separate_planes(file.system) if file.is_quadratic else None
    if separation is not None and all(isinstance(map_, KahanFamily) for map_ in maps):
        T, zero = separation.T, [fmpq(0)] * file.dim
        planar_systems = [map_.system.composed(T, zero).transformed(T.inv()) for map_ in maps]  # type: ignore[attr-defined]
        planar_data = [data.with_rows(as_map(system).rows) for system in planar_systems]
        pairs = enumerate(zip(planar_data, map_data_list, strict=True), 1)
        claims += [affine_symmetry(z, f"{label}coordinates_{k}", T, zero, target=x) for k, (z, x) in pairs]
        map_data_list = planar_data
    index_pairs = combinations(range(len(map_data_list)), 2)
    claims += [
        commuting(f"{label}maps_{i + 1}_and_{j + 1}_commute", map_data_list[i], map_data_list[j])
        for i, j in index_pairs
    ]
    return claims


def _equivalence_claim(file: SystemFile, data: MapData, other: SystemFile, by: Sequence[Any]) -> AffineSymmetry:
    """The claim that the affine map `by` takes the Kahan map of the file to the Kahan map of the other system."""
    n = file.dim
    if not (file.is_quadratic and other.is_quadratic) or other.dim != n or len(by) != n:
        raise InputError(
            f"found {file.name}, {other.name} and {counted(len(by), 'polynomial')}, expected two quadratic systems of "
            "the same dimension, and for each variable of the second a polynomial in those of the first"
        )
    T = [parse_polynomial(formula_text(text), file.variables, file.parameters) for text in by]
    if any(degree_in(P, n) > 1 for P in T):
        raise InputError(f"found {', '.join(map(str, by))}, expected polynomials of degree at most 1")
    zero = (0,) * n
    S = fmpq_mat([[P.derivative(j)[zero] for j in range(n)] for P in T])
    target = data.with_rows(as_map(other.system.renamed(file.variables)).rows)
    about = f"T takes the map of {file.name} to that of {other.name}"
    return affine_symmetry(data, "equivalence", S, [P[zero] for P in T], target=target, about=about)


def _known_claims(
    formulas: Formulas, planes: _Planes, checker: str = ""
) -> Iterator[tuple[str, Callable[[], list[MapClaim]]]]:
    """Yield (name, function that returns the claims with this name): claims of the file, then claims of theorems."""
    H, file, data = formulas.H, formulas.file, planes.data

    def single_claim(prove: Callable[..., MapClaim], *arguments: Any) -> Callable[[], list[MapClaim]]:
        return lambda: [prove(data, *arguments)]

    for name, function in formulas.integrals.items():
        yield name, partial(planes.claims, conserved_function, name, function)
    if H is not None:
        yield "modified_hamiltonian", single_claim(modified_hamiltonian, "modified_hamiltonian", H)
    for name, form in formulas.forms.items():
        yield name, single_claim(bilinear_integral, name, form)
    if formulas.density is not None:
        yield VOLUME, single_claim(invariant_volume, VOLUME, formulas.density)
    if H is not None:
        volume_name = VOLUME if formulas.density is None else DETERMINANT
        yield volume_name, lambda: [invariant_volume(data, volume_name, _polynomial(data.determinant))]
    if data.dim == 2:
        is_short = checker == "rocq"  # Coq takes a second for a hundred terms
        yield ENTROPY, lambda: [positive_entropy(data, data.with_rows(formulas.map.inverse_rows), is_short)]
    if file.hamiltonian is not None:
        is_theorem = poisson_tensor_invariant(file.hamiltonian, file.member) is not None
        name = TENSOR if is_theorem else UNPROVED
        yield name, lambda: [invariant_tensor(data, name, _hamiltonian_tensor(formulas))]


@dataclass(frozen=True)
class _Planes:
    """Proofs about functions of one plane of a member of the commuting family, in coordinates z with x = T z."""

    file: SystemFile
    data: MapData

    @cached_property
    def separation(self) -> tuple[SeparatedSystem, AffineSymmetry] | None:
        """The system in the coordinates z if it is shorter, and the claim that T takes its map to the given map."""
        file, n = self.file, self.data.dim
        has_symbols = len(self.data.names) > n + 1
        coordinates = None if file.member is None or has_symbols else separate_planes(file.system)
        if coordinates is None:
            return None
        planar_data = self.data.with_rows(as_map(coordinates.system).rows)
        return coordinates, affine_symmetry(planar_data, "coordinates", coordinates.T, [fmpq(0)] * n, target=self.data)

    def claims(self, prove: Callable[..., MapClaim], name: str, function: RationalFunction) -> list[MapClaim]:
        """Return the claim that `prove` returns for a function, in one plane if possible, after the claims it needs."""
        if self.separation is not None:
            coordinates, change = self.separation
            plane_function = coordinates.function(function)
            plane_data = restrict(change.data, plane_function)
            if plane_data is not change.data:
                proof = prove(plane_data, f"{name}_in_its_plane", plane_function)
                return [change, changed_function(change, name, function, plane_function, plane_data.names), proof]
        return [prove(self.data, name, function)]


def _claims_of(result: Any, data: MapData, planes: _Planes | None = None) -> list[MapClaim]:
    """The claims that the result of a search proves about the map; `result` None stands for a search without result."""
    if result is None:
        return []
    proved = Certainty.PROVED
    if isinstance(result, IntegralSearch):
        planes = planes or _Planes(result.file, data)
        integrals = [integral for integral in result.integrals if integral.verdict is proved]
        return [claim for I in integrals for claim in planes.claims(conserved_function, I.name, I.function)]
    if isinstance(result, DensitySearch):
        densities = [density for density in result.shown if density.verdict is proved]  # others: integrals times it
        return [invariant_volume(data, f"{VOLUME}_{k}", phi.function) for k, phi in enumerate(densities, 1)]
    if isinstance(result, PoissonSearch):
        tensors = [tensor for tensor in result.tensors if tensor.verdict is proved and tensor.jacobi is proved]
        return [invariant_tensor(data, tensor.name, tensor.tensor.rows) for tensor in tensors]
    if isinstance(result, DarbouxSearch):
        planes = planes or _Planes(result.file, data)
        polynomials = [P for space in result.spaces if space.verdict is proved for P in space.polynomials]
        # If P has a common factor with D = det M, the cofactor C in P(x~) = P C/D^k need not be a polynomial.
        polynomials = [P for P in polynomials if degree_in(P.gcd(data.determinant), data.dim) <= 0]
        functions = [(f"D{k}", _polynomial(P)) for k, P in enumerate(polynomials, 1)]
        return [claim for name, P in functions for claim in planes.claims(darboux_polynomial, name, P)]
    if isinstance(result, Equivalence):
        target, about = data.with_rows(as_map(result.system).rows), f"f is {result.text}"
        return [affine_symmetry(data, "equivalence", result.P, result.q, target=target, about=about)]
    if isinstance(result, CommutingSystems):
        file = SystemFile.from_system(result.system, "system")
        systems = [field.system for field in result.nontrivial if field.finding.verdict is proved]
        return [claim for k, g in enumerate(systems, 1) for claim in _commuting_claims(file, data, g, f"g{k}_")]
    assert isinstance(result, Symmetries)
    symmetries = [symmetry for symmetry in result.generators if not symmetry.is_trivial]
    return [affine_symmetry(data, f"T{k}", T.S, T.r, T.reversing) for k, T in enumerate(symmetries, 1)]


_SEARCHES: dict[str, Callable[[SystemFile], Any]] = {
    "integrals": find_integrals,
    "density": find_densities,
    TENSOR: find_poisson,
    "darboux": partial(darboux_polynomials, max_degree=2),
    "symmetry": linear_symmetries,
    "equivalence": equivalent_system,
}


def _hamiltonian_tensor(formulas: Formulas) -> list[list[RationalFunction]]:
    """The Poisson tensor Pi = J - eps^2 f'^2 J."""
    assert formulas.file.hamiltonian is not None
    context, J, n = ring((*formulas.names, "eps")), formulas.file.hamiltonian.J, formulas.dim
    *generators, eps = context.gens()
    jacobian = [[entry.compose(*generators, ctx=context) for entry in row] for row in formulas.jacobian]

    def multiply(A: Sequence[Sequence[Any]], B: Sequence[Sequence[Any]]) -> list[list[fmpq_mpoly]]:
        return [[sum((a * B[k][j] for k, a in enumerate(row)), context.constant(0)) for j in range(n)] for row in A]

    square = multiply(multiply(jacobian, jacobian), J.tolist())
    return [[_polynomial(J[i, j] - eps**2 * square[i][j]) for j in range(n)] for i in range(n)]


def _polynomial(polynomial: fmpq_mpoly) -> RationalFunction:
    return RationalFunction(polynomial, polynomial.context().constant(1))
