"""How the results of the laboratory look in a notebook: bounded in size, nothing computed anew."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flint import fmpq

from kahanmaps.algebra.text import format_number
from kahanmaps.display import laboratory_text as laboratory_text  # registers what `print` shows
from kahanmaps.display import markup
from kahanmaps.display.mathml import formula
from kahanmaps.display.systems import CHARACTERS, equations_html, map_html
from kahanmaps.displayed import html_form
from kahanmaps.documents.files import SystemFile
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.laboratory.finite.cycles import Census
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.laboratory.preserve.darboux import DarbouxSearch
from kahanmaps.laboratory.preserve.densities import DensitySearch
from kahanmaps.laboratory.preserve.hamiltonian_structure import ConstantStructures
from kahanmaps.laboratory.preserve.integrals import IntegralSearch
from kahanmaps.laboratory.preserve.poisson_tensors import PoissonSearch
from kahanmaps.laboratory.scan.result import Scan, growth_on
from kahanmaps.laboratory.singular.singularities import SingularityRun
from kahanmaps.laboratory.symmetry.commuting import CommutingSystems
from kahanmaps.laboratory.symmetry.symmetries import SIGNED, Symmetries
from kahanmaps.maps.implicit import BirationalMap

_ROWS = 20
_FORMULAS = 5  # rows of which each has several formulas
_STATEMENTS = 60
_TEXT = 300


def eps_sentence(eps: fmpq | None, map_: BirationalMap | None = None) -> str:
    """For which eps a result is, with the time step: a phrase, empty for a map that does not depend on eps."""
    if map_ is not None and not map_.has_time_step:
        words = "every eps" if eps is None else f"eps = {markup.shortened(format_number(eps))}"
        return words if map_.has_eps else ""
    return markup.eps_words() if eps is None else markup.eps_words(format_number(eps), format_number(2 * eps))


def _words(*parts: str) -> str:
    return ", ".join(filter(None, parts))


@html_form.register
def analysis_html(found: Analysis) -> str:
    """The verdict first, then the statements."""
    final = found.conclusion
    statements = [(title, line) for title, lines in found.sections for line in lines]
    rows = [(_text(title), markup.verdict(line.status), _text(line.text)) for title, line in statements[:_STATEMENTS]]
    more = f"<p>… and {len(statements) - _STATEMENTS} more statements</p>" if len(statements) > _STATEMENTS else ""
    inside = [
        f"<p>{map_html(found.file.map)}</p>",
        f"<p><strong>{_text(final.kind)}</strong>: {_text(final.sentence, 800)}</p>",
        markup.table(["", "known how", ""], rows) + more,
    ]
    more = _words(f"dimension {found.dim}", eps_sentence(found.eps, found.file.map))
    return markup.titled(_name(found.file), "\n".join(inside), more)


@html_form.register
def integrals_html(search: IntegralSearch) -> str:
    """The integrals with their verdicts, and how many there should be."""
    rows = [
        (formula(one.function, one.name, CHARACTERS), markup.verdict(one.verdict), _text(one.origin))
        for one in search.integrals[:_FORMULAS]
    ]
    rows += [
        (f"{one.name} = {_code(one.text)}", markup.verdict(one.verdict), _text(one.origin))
        for one in search.in_iterates
    ]
    said = f"{search.found} found; {search.count_text}"
    notes = _notes([_rest(search.integrals, _FORMULAS), search.note, search.reason])
    inside = markup.table(["integral", "verdict", "found by"], rows) if rows else ""
    more = eps_sentence(search.eps, search.file.map)
    return markup.titled(f"integrals of {_name(search.file)}", f"{inside}\n<p>{said}</p>{notes}", more)


@html_form.register
def densities_html(search: DensitySearch) -> str:
    """The densities phi with dx/phi invariant."""
    rows = [(formula(one.function, "phi", CHARACTERS), markup.verdict(one.verdict)) for one in search.shown]
    inside = markup.table(["dx/phi is invariant", "verdict"], rows) if rows else ""
    notes = _notes([search.further, search.note, search.reason])
    more = eps_sentence(search.eps, search.file.map)
    return markup.titled(f"densities of {_name(search.file)}", inside + notes, more)


@html_form.register
def poisson_html(search: PoissonSearch) -> str:
    """The tensors by their brackets, and what is known of each."""
    rows = []
    for one in search.tensors[:_FORMULAS]:
        brackets = list(one.tensor.brackets.items())[:_ROWS]
        lines = [formula(entry, f"{{{a},{b}}}", CHARACTERS) for (a, b), entry in brackets]
        rows.append(("<br/>".join(lines), markup.verdict(one.verdict), _text(one.statement)))
    inside = markup.table(["brackets", "verdict", ""], rows) if rows else ""
    inside += _notes([_rest(search.tensors, _FORMULAS), search.note, search.reason])
    return markup.titled(f"Poisson tensors of {_name(search.file)}", inside, eps_sentence(search.eps, search.file.map))


@html_form.register
def darboux_html(search: DarbouxSearch) -> str:
    """The spaces of Darboux polynomials by cofactor."""
    rows = [
        (
            _code(space.cofactor),
            "<br/>".join(formula(P, characters=CHARACTERS) for P in space.polynomials[:4]),
            markup.verdict(space.verdict),
        )
        for space in search.spaces[:_FORMULAS]
    ]
    inside = markup.table(["cofactor", "polynomials", "verdict"], rows) if rows else "<p>none</p>"
    notes = _notes([_rest(search.spaces, _FORMULAS), search.reason])
    more = _words(f"up to degree {search.degree}", eps_sentence(search.eps, search.file.map))
    return markup.titled(f"Darboux polynomials of {_name(search.file)}", inside + notes, more)


@html_form.register
def degrees_html(found: DegreeGrowth) -> str:
    """The degrees of the iterates, and what they say."""
    lines = [line.split("\t", 1) for line in found.text.split("\n")]
    rows = [(word, _text(rest)) for word, rest in lines[:_ROWS]]
    return markup.titled("degrees of the iterates", markup.definitions(rows), "measured, " + eps_sentence(found.eps))


@html_form.register
def heights_html(survey: HeightSurvey) -> str:
    """The kind of growth of each orbit."""
    rows = [
        (
            *([_text(format_number(one.eps))] if survey.has_eps else []),
            _text(", ".join(map(format_number, one.start))),
            _text(str(one.growth.kind)),
            str(len(one.growth.heights)),
            _text(one.growth.end.message),
        )
        for one in survey.orbits[:_ROWS]
    ]
    head = [*(["eps"] if survey.has_eps else []), "start", "growth", "heights", "ended"]
    inside = markup.table(head, rows) + _notes([_rest(survey.orbits)])
    step = "the time step is 2 eps" if survey.has_eps else ""
    return markup.titled("heights of exact orbits", f"<p>{_text(survey.text)}</p>\n{inside}", step)


@html_form.register
def singularities_html(run: SingularityRun, map_: BirationalMap | None = None) -> str:
    """Each contracted hypersurface and its outcome; `map_` tells what eps is, where it is not Kahan's."""
    rows = [
        (
            _code(h.polynomial),
            _text(h.status),
            "" if h.contracted_at is None else str(h.contracted_at),
            "" if h.confined_at is None else str(h.confined_at),
        )
        for h in run.hypersurfaces[:_ROWS]
    ]
    inside = markup.table(["hypersurface", "outcome", "contracted at step", "confined at step"], rows) if rows else ""
    inside += _notes([_rest(run.hypersurfaces)])
    return markup.titled(f"singularities: {run.text}", inside, eps_sentence(run.eps, map_))


@html_form.register
def symmetries_html(found: Symmetries) -> str:
    """Symmetries and reversing symmetries."""
    rows: list[tuple[str, str]] = [
        ("infinitesimal", _text(f"({', '.join(one.rhs)})")) for one in found.infinitesimal[:_ROWS]
    ]
    if found.group_text:
        rows.append(("group", f"{found.group_text}, generated by"))
    others = found.others if found.group_of == SIGNED else []
    rows += [(one.kind, _text(one.text)) for one in (*found.generators[:_ROWS], *others[:_ROWS])]
    inside = (markup.definitions(rows) if rows else "<p>none but the identity</p>") + _notes(
        [_rest(others), *found.undecided]
    )
    return markup.titled("affine symmetries of the map", inside, "proved, for every eps")


@html_form.register
def commuting_html(found: CommutingSystems) -> str:
    """The systems whose Kahan maps commute."""
    rows = [
        (
            equations_html(one.system, CHARACTERS // 4),
            _text(one.trivial and f"g = {one.trivial}"),
            markup.verdict(one.finding.verdict),
        )
        for one in sorted(found.solutions, key=lambda one: bool(one.trivial))[:_FORMULAS]
    ]
    rows += [
        (
            equations_html(family.base.system, CHARACTERS // 4),
            f"and {len(family.directions)} directions",
            markup.verdict(family.finding.verdict),
        )
        for family in found.families[:_FORMULAS]
    ]
    rest = [_rest(found.solutions, _FORMULAS), _rest(found.families, _FORMULAS)]
    notes = _notes([*rest, "every g commutes" * found.every_g_commutes, *found.irrational, *found.undecided])
    inside = markup.table(["g", "", "commutes"], rows) if rows else ""
    return markup.titled("systems x' = g(x) whose Kahan maps commute", inside + notes, f"{found.shape} g, every eps")


@html_form.register
def census_html(census: Census) -> str:
    """The counts of points and cycles."""
    kind = "all points" if census.complete else "random points"
    rows = [
        ("points", f"{census.points} ({kind}: {census.looked_at} looked at)"),
        ("on cycles", str(census.periodic)),
        ("cycles", "not counted" if census.cycles is None else str(census.cycles)),
        ("longest cycle", str(census.longest)),
        ("lost, falling, transient, open", f"{census.lost}, {census.falling}, {census.transient}, {census.open}"),
    ]
    title = f"cycles on P^{census.dim} over GF({census.prime})"
    return markup.titled(title, markup.definitions(rows), eps_sentence(census.eps))


@html_form.register
def scan_html(found: Scan) -> str:
    """The conditions on the parameters by degrees, those with the slowest growth first."""
    rows = [("in general", _text(", ".join(map(str, found.generic))), "")]
    for degrees, some in found.classes[:_ROWS]:
        where = "; ".join(one.text if one.is_confirmed else f"{one.text} (not confirmed)" for one in some)
        growth = growth_on(some)
        told = "" if growth is None else growth.kind_text
        rows.append((_text(where), _text(", ".join(map(str, degrees))), _text(told)))
    notes = _notes([_rest(found.classes), found.coverage])
    more = _words(f"over {', '.join(found.over)}", eps_sentence(found.eps, found.file.map))
    return markup.titled(
        f"scan of {_name(found.file)}", markup.table(["where", "degrees", "growth"], rows) + notes, more
    )


@html_form.register
def structures_html(found: ConstantStructures) -> str:
    """The Hamiltonian form, or why there is none."""
    if found.hamiltonian is None:
        word = markup.verdict("proved" if found.proved else "undecided")
        return markup.titled("not Hamiltonian with a constant J", f"<p>{word}: {_text(found.reason)}</p>")
    kind = "the standard J" if found.hamiltonian.is_standard else "a constant skew J"
    rows = [("H", formula(found.hamiltonian.H, characters=CHARACTERS))]
    rows += [("Casimir", formula(casimir, characters=CHARACTERS)) for casimir in found.casimirs[:_ROWS]]
    return markup.titled(f"Hamiltonian with {kind}", markup.definitions(rows), "proved")


def _name(file: SystemFile) -> str:
    return markup.shortened(file.name)


def _notes(texts: Iterable[str]) -> str:
    return "".join(f"\n<p>{_text(text)}</p>" for text in list(texts)[:_ROWS] if text)


def _rest(found: Sequence[object], shown: int = _ROWS) -> str:
    """How many are not shown, empty where all are."""
    return f"… and {len(found) - shown} more" if len(found) > shown else ""


def _code(text: str) -> str:
    return f"<code>{_text(text)}</code>"


def _text(text: str, width: int = _TEXT) -> str:
    return markup.escape(markup.shortened(text, width))
