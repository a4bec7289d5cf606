"""The certificate of a system: which claims are proved, and the script for the program that is to check them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.certificates.identities import (
    ConservedFunction,
    FalseClaim,
    InvariantVolume,
    MapData,
    conserved_function,
    invariant_volume,
    map_data,
)
from kahanmaps.certificates.rocq import rocq_certificate
from kahanmaps.certificates.scripts import GP, PYTHON, script_certificate
from kahanmaps.checks.settings import claimed_functions
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.languages.formulas import Formulas
from kahanmaps.maps.kahan import SystemLike

CHECKERS: dict[str, Callable[..., str]] = {
    "rocq": rocq_certificate,
    "gp": partial(script_certificate, GP),
    "sympy": partial(script_certificate, PYTHON),
}
VOLUME = "volume"  # the name of the claim that dx/phi is invariant


def certificate(
    system: SystemLike,
    checker: str,
    claims: Sequence[str] | None = None,
    integrals: Mapping[str, Any] | Any = None,
    *,
    command: str = "",
) -> str:
    """Write a proof that another program checks: integrals, and the invariant volume form, for every eps.

    Args:
        system: the system, which stands for its Kahan map, or a map; of dimension at most 6.
        checker: "rocq" (Coq 8.16 or newer), "gp" (PARI/GP) or "sympy".
        claims: names of integrals of the file, "modified_hamiltonian" or "H0", "H1", ... for those that theorems give,
            "volume" for the invariant volume form; None for all of them, or for `integrals` alone if these are given.
        integrals: further rational functions of x and eps, as `check_integrals` takes them.
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
    names = (*formulas.names, "eps")
    data = map_data(formulas.equation, formulas.variables, formulas.new, names)
    proved: list[ConservedFunction | InvariantVolume] = []
    further = {} if integrals is None else claimed_functions(file, integrals)
    for name, function in further.items():
        proved.append(conserved_function(data, name, function))
    known = {} if further and claims is None else dict(_known_claims(formulas, data))
    skipped = []
    for name in known if claims is None else claims:
        if name not in known:
            expected = f"one of {', '.join(known)}" if known else "none, as nothing is known of it"
            raise InputError(f"no claim {str(name)[:40]!r} of {file.name}: expected {expected}")
        certify = invariant_volume if name == VOLUME else partial(conserved_function, name=name)
        try:
            proved.append(certify(data, function=known[name]))
        except FalseClaim:
            raise
        except InputError as error:  # of all known claims those that are short enough
            if claims is not None:
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


def _known_claims(formulas: Formulas, data: MapData) -> Iterator[tuple[str, RationalFunction]]:
    """The integrals and the density that the file claims, or theorems give, as functions of x and eps."""
    yield from formulas.integrals.items()
    n, context = data.dim, ring(data.names)
    letters = context.gens()
    for label, _, function in formulas.integrals_by_theorem():
        # In x and x~, of degree at most 1 in x~: D F(x, N/D) is a polynomial.
        total = context.constant(0)
        for exponents, coefficient in function.numerator.terms():
            term = context.constant(coefficient)
            for letter, exponent in zip(letters, (*exponents[:n], *exponents[2 * n :]), strict=True):
                term *= letter ** int(exponent)
            (image,) = [data.numerators[k] for k in range(n) if exponents[n + k]] or [data.determinant]
            total += term * image
        denominator = function.denominator.compose(*letters[:n], *letters, ctx=context)
        yield label.removeprefix("integral "), RationalFunction.reduced(total, denominator * data.determinant)
    if formulas.density is not None:
        yield VOLUME, formulas.density
    elif formulas.H is not None:
        yield VOLUME, RationalFunction(data.determinant, context.constant(1))
