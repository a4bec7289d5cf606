r"""LaTeX: an article of displayed formulas that compiles as it stands; long sums are broken between terms."""

from __future__ import annotations

import re
from collections.abc import Sequence

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.written.reading import above_and_below
from kahanmaps.display.latex import latex_name, latex_polynomial, latex_rational_function
from kahanmaps.languages.formulas import Formulas
from kahanmaps.languages.writer import header
from kahanmaps.maps.convention import eps_share

_LINE = 140  # characters of source on a line of a formula
# The point and its image; x may be the name of a variable.
_X, _Y = r"\mathbf x", r"\widetilde{\mathbf x}"


def write_latex(formulas: Formulas, parts: Sequence[str], command: str) -> str:
    """The document as text: one display for each of the parts (of `writer.PARTS`), in LaTeX with amsmath.

    Raises InputError where the closed form of the map is asked for and too large.
    """
    displays: list[str] = []
    for part in parts:
        displays += _display(part, formulas)
    comment = "\n".join(f"% {line}" for line in header(formulas, command))
    columns = f"\\setcounter{{MaxMatrixCols}}{{{formulas.dim}}}\n" if formulas.dim > 10 else ""
    body = "\n\n".join(displays)
    step = ""
    if share := eps_share(formulas.map):
        share = share.replace("eps", "$\\varepsilon$")
        step = f"\\noindent {share}: the time step is ${2 * formulas.map.time_steps} \\varepsilon$.\n\n"
    return (
        f"{comment}\n\\documentclass{{article}}\n\\usepackage{{amsmath}}\n\\allowdisplaybreaks\n{columns}"
        "\\begin{document}\n\n"
        f"{step}"
        f"{body}\n\n\\end{{document}}\n"
    )


def _display(part: str, formulas: Formulas) -> list[str]:
    if part == "system":
        rows = [
            (rf"\dot{{{latex_name(name)}}}", latex_polynomial(polynomial))
            for name, polynomial in zip(formulas.variables, formulas.rhs, strict=True)
        ]
        return ["The system $\\dot{\\mathbf x} = f(\\mathbf x)$:\n" + _aligned(rows)]
    if part == "map" and not formulas.rhs:
        return ["The map:\n" + _aligned(_equations(formulas))]
    if part == "inverse" and not formulas.rhs:
        return ["Its inverse:\n" + _aligned(_components(formulas, formulas.inverse_form()))]
    if part == "map":
        point = ", ".join(latex_name(name) for name in formulas.variables)
        matrix = " \\\\\n".join(" & ".join(latex_polynomial(entry) for entry in row) for row in formulas.jacobian)
        rows = [(_Y, rf"{_X} + 2 \varepsilon (I - \varepsilon f'({_X}))^{{-1}} f({_X})"), (_X, f"({point})")]
        return [
            f"The Kahan map ${_X} \\mapsto {_Y}$:\n{_aligned(rows)}",
            f"where\n\\[\nf'({_X}) = \\begin{{pmatrix}}\n{matrix}\n\\end{{pmatrix}}.\n\\]",
        ]
    if part == "inverse":
        rows = [(_X, rf"{_Y} - 2 \varepsilon (I + \varepsilon f'({_Y}))^{{-1}} f({_Y})")]
        return ["Its inverse:\n" + _aligned(rows)]
    if part == "jacobian":
        derivative = rf"(I - \varepsilon f'({_X}))^{{-1}} (I + \varepsilon f'({_Y}))"
        return ["Its Jacobi matrix:\n" + _aligned([(rf"\frac{{\partial {_Y}}}{{\partial {_X}}}", derivative)])]
    if part == "map-formulas":
        what = "Kahan map" if formulas.rhs else "map"
        return [f"The {what} as rational functions:\n" + _aligned(_components(formulas, formulas.closed_form()))]
    claimed = "" if formulas.file.catalog else ", as the file claims"
    if part == "density":
        if formulas.density is None:
            claimed, rows = "", [(r"\varphi", rf"\det(I - \varepsilon f'({_X}))")]
        else:
            rows = _quotient(r"\varphi", formulas.density)
        return [f"The invariant measure $\\mathrm{{d}}\\mathbf x/\\varphi${claimed}:\n" + _aligned(rows)]
    return [f"Integrals of the map{claimed if formulas.integrals else ''}:\n" + _aligned(_integrals(formulas))]


def _components(formulas: Formulas, functions: Sequence[RationalFunction]) -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    for name, function in zip(formulas.variables, functions, strict=True):
        rows += _quotient(rf"\widetilde{{{latex_name(name)}}}", function)
    return rows


def _equations(formulas: Formulas) -> list[tuple[str, str]]:
    """A map that is not Kahan's: its components, or the rows of M x~ = r."""
    rows: list[tuple[str, str]] = []
    for row in formulas.equation:
        entries = [(entry, name) for entry, name in zip(row, formulas.variables, strict=False) if not entry.is_zero()]
        if len(entries) == 1:
            ((below, name),) = entries
            rows += _quotient(rf"\widetilde{{{latex_name(name)}}}", RationalFunction(row[-1], below))
        else:
            left = " + ".join(rf"({latex_polynomial(e)}) \widetilde{{{latex_name(name)}}}" for e, name in entries)
            rows.append((left, latex_polynomial(row[-1])))
    return rows


def _integrals(formulas: Formulas) -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    for name, function in formulas.integrals.items():
        rows += _quotient(_label(name or "I"), function)
    for k in range(len(formulas.forms)):
        power = "" if k == 0 else r" A^{\mathsf T}" if k == 1 else rf" (A^{{\mathsf T}})^{{{k}}}"
        form = rf"\tfrac{{1}}{{\varepsilon}} {_X}^{{\mathsf T}} J{power} {_Y}"
        rows.append((rf"\widetilde H_{{{k}}}", form))
    if formulas.H is not None and not formulas.forms:
        rows.append((r"\widehat H", rf"H({_X}) + \tfrac{{1}}{{3}} (\nabla H({_X}))^{{\mathsf T}} ({_Y} - {_X})"))
        rows.append(("H", latex_polynomial(formulas.H)))
    if formulas.forms:
        member = formulas.file.member
        assert member is not None
        for letter, matrix in (("A", member.A), ("J", member.chosen.hamiltonian.J)):
            entries = r" \\ ".join(" & ".join(str(entry) for entry in row) for row in matrix.tolist())
            rows.append((letter, rf"\begin{{pmatrix}} {entries} \end{{pmatrix}}"))
    return rows


def _label(name: str) -> str:
    r"""The name of an integral, any printable text: as text where TeX's marks for it are none of math mode.

    Letters that are not ASCII are told by their numbers, for not every TeX has them.

    >>> print(_label("F1"), _label("a_b"), _label("H~ é"))
    F_1 \mathrm{a\_b} \text{H\textasciitilde{} [U+00E9]}
    """
    shown = "".join(mark if mark.isascii() else f"[U+{ord(mark):04X}]" for mark in name)
    label = latex_name(shown)
    is_text = shown != name or any(mark in name for mark in "\\^~ ")
    return label.replace(r"\mathrm{", r"\text{", 1) if is_text else label


def _quotient(left: str, function: RationalFunction) -> list[tuple[str, str]]:
    """left = P/Q in one row where it is short; else P and Q have rows of their own, without fractions as well."""
    whole = latex_rational_function(function)
    if len(whole) <= _LINE or function.is_polynomial:
        return [(left, whole)]
    is_negative, above, below = above_and_below(function)
    P, Q = f"P_{{{left}}}", f"Q_{{{left}}}"
    return [
        (left, rf"{'-' * is_negative}\frac{{{P}}}{{{Q}}}"),
        (P, latex_polynomial(above)),
        (Q, latex_polynomial(below)),
    ]


def _aligned(rows: Sequence[tuple[str, str]]) -> str:
    r"""Rows left = right of an align* with right broken between its terms."""
    lines = []
    for left, right in rows:
        pieces = _pieces(right)
        lines.append(f"{left} &= {pieces[0]}")
        lines += [rf"&\quad {piece}" for piece in pieces[1:]]
    return "\\begin{align*}\n" + " \\\\\n".join(lines) + "\n\\end{align*}"


def _pieces(text: str) -> list[str]:
    """A text cut into lines where it is long, between terms: what is long is a sum, and no brace encloses its terms."""
    lines = [""]
    for term in re.split(r" (?=[+-] )", text) if len(text) > _LINE else [text]:
        if lines[-1] and len(lines[-1]) + len(term) > _LINE:
            lines.append("")
        lines[-1] += f" {term}" if lines[-1] else term
    return lines
