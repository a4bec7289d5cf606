"""How members of the commuting family look in a notebook, bounded in size whatever the member is."""

from __future__ import annotations

from kahanmaps.algebra.written.text import format_number
from kahanmaps.display import markup
from kahanmaps.display.formulas import formula, matrix
from kahanmaps.display.systems import CHARACTERS, equations_html
from kahanmaps.displayed import html_form
from kahanmaps.family.associated import AssociatedSystem, FamilyMember
from kahanmaps.family.planar import NormalForm

_TEXT = 200


@html_form.register
def member_html(member: FamilyMember) -> str:
    """A member: A, H, chi, the associated system that its signs pick."""
    factors = " ".join(
        f"({factor})" + f"^{factor.multiplicity}" * (factor.multiplicity > 1) for factor in member.factors
    )
    rows = [
        ("A", matrix(member.A)),
        ("H", formula(member.H, characters=CHARACTERS)),
        ("chi", markup.escape(markup.shortened(factors, _TEXT))),
        ("signs", markup.escape(member.chosen.label)),
        ("associated systems over Q", str(2 ** (len(member.factors) - 1))),
    ]
    return markup.titled(f"member of the commuting family, m = {member.m}", markup.definitions(rows))


@html_form.register
def associated_html(found: AssociatedSystem) -> str:
    """An associated system: its signs, K, B and the equations."""
    powers = [
        f"{markup.shortened(format_number(c), 20)} {('I', 'A')[k] if k < 2 else f'A^{k}'}"
        for k, c in enumerate(found.coefficients[:12])
        if c != 0
    ]
    rows = [
        ("B", markup.escape(" + ".join(powers) or "0")),
        ("K", formula(found.K, characters=CHARACTERS)),
        ("equations", equations_html(found.system)),
    ]
    return markup.titled(f"associated system {found.label}", markup.definitions(rows))


@html_form.register
def normal_form_html(form: NormalForm) -> str:
    """A normal form: chi, h, D and the planes over Q."""
    rows = [
        ("chi(t)", markup.escape(markup.shortened(form.chi_text, _TEXT))),
        ("h(X, Y)", markup.escape(markup.shortened(form.h_text, _TEXT))),
        ("D(X, Y)", markup.escape(markup.shortened(form.D_text, _TEXT))),
        ("S", matrix(form.S)),
    ]
    rows += [
        (f"plane at t = {markup.shortened(format_number(part.root), 20)}", formula(part.h, "h", CHARACTERS))
        for part in form.parts[:8]
    ]
    more = "x = S z, a planar system over K = Q[t]/chi"
    return markup.titled(f"normal form, m = {form.m}", markup.definitions(rows), more)
