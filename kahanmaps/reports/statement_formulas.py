"""The statements of an analysis that are formulas, as MathML."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from kahanmaps.algebra.written.text import format_polynomial, parse_polynomial, parse_rational_function
from kahanmaps.display.checks import because
from kahanmaps.display.mathml import formula
from kahanmaps.errors import KahanmapsError
from kahanmaps.reports.page import CHARACTERS, ROOM, text

if TYPE_CHECKING:
    from kahanmaps.laboratory.analysis import Analysis
    from kahanmaps.laboratory.preserve.sparse_relations import SparseRelation

_PARSED = 4_000  # characters of a relation that is read once more, to be set as a formula


def formulas_of(found: Analysis) -> dict[str, str]:
    """HTML for statements, by their text in `found.sections`; those that are not here are shown as text."""
    return dict(_pairs(found))


def _pairs(found: Analysis) -> Iterator[tuple[str, str]]:
    for one in found.integrals.integrals if found.integrals is not None else ():
        below = f'<span class="soft">{text(one.origin)}</span>\n{_evidence(because(one.evidence, ROOM))}'
        yield f"{one.name} = {one.text}  [{one.origin}]", f"{formula(one.function, one.name, CHARACTERS)}<br/>{below}"
    for relation in found.relations:
        html = _relation(relation, (*relation.names, *found.file.variables, "eps"))
        if html:
            yield f"along orbits {relation.text}", f"along orbits {html}"
    for density in found.densities.densities if found.densities is not None else ():
        below = _evidence(because(density.evidence, ROOM))
        html = f"dx/ϕ is invariant, {formula(density.function, 'phi', CHARACTERS)}\n{below}"
        yield f"dx/phi is invariant, phi = {density.text}", html
    if found.degrees is not None and found.degrees.recurrence is not None:
        closed = found.degrees.recurrence.closed_form
        html = _closed_form(closed) if closed else ""
        if html:
            yield f"d_n = {closed}", html
    if found.hamiltonian is not None and found.hamiltonian.hamiltonian is not None:
        hamiltonian = found.hamiltonian.hamiltonian
        kind = "the standard J" if hamiltonian.is_standard else "a constant skew J"
        html = f"Hamiltonian with {kind}, {formula(hamiltonian.H, 'H', CHARACTERS)}"
        yield f"Hamiltonian with {kind}, H = {format_polynomial(hamiltonian.H)}", html
    for field in found.commuting.nontrivial if found.commuting is not None else ():
        parts = "<br/>\n".join(formula(g, f"g{k}", CHARACTERS) for k, g in enumerate(field.system.rhs, start=1))
        words = "commutes with the Kahan maps of g and -g"
        yield f"{words}, g = ({', '.join(field.rhs)})", f"{words},<br/>\n{parts}"


def _evidence(html: str) -> str:
    return f"<details><summary>evidence</summary>{html}</details>"


def _relation(relation: SparseRelation, names: tuple[str, ...]) -> str:
    """P = 0 as a formula, term by term in the order of its text; empty where it cannot be read as one."""
    if len(relation.text) > _PARSED:
        return ""
    pieces: list[str] = []
    for monomial, coefficient in relation.terms:
        try:
            term = formula(parse_rational_function(f"{coefficient.removeprefix('-')}*{monomial}", names))
        except KahanmapsError:
            return ""
        if coefficient.startswith("-"):
            term = f'<math alttext="-"><mo form="{"infix" if pieces else "prefix"}">−</mo></math>\u00a0{term}'
        elif pieces:
            term = f'<math alttext="+"><mo form="infix">+</mo></math>\u00a0{term}'
        pieces.append(term)
    return f'{" ".join(pieces)} <math alttext="= 0"><mrow><mo form="infix">=</mo><mn>0</mn></mrow></math>'


def _closed_form(closed: str) -> str:
    """d_n = a polynomial in n; empty where it is something else."""
    try:
        shown = formula(parse_polynomial(closed, ["n"]))
    except KahanmapsError:
        return ""
    left = '<math alttext="d_n ="><mrow><msub><mi>d</mi><mi>n</mi></msub><mo form="infix">=</mo></mrow></math>'
    return f"{left} {shown}"
