r"""Conversion to LaTeX: a complete article of displayed formulas, in which long sums are broken between terms."""

from __future__ import annotations

import re
from collections.abc import Sequence

from flint import fmpq_mat

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import integer_fraction
from kahanmaps.display.latex import latex_name, latex_polynomial, latex_rational_function
from kahanmaps.languages.formulas import Formulas
from kahanmaps.maps.convention import describe_eps

_MAX_WIDTH = 140  # maximal number of source characters in a line of a formula
# Symbols for the point and its image, distinct from x, which may be the name of a variable.
_POINT, _IMAGE = r"\mathbf x", r"\widetilde{\mathbf x}"

Rows = list[tuple[str, str]]


def write_latex(formulas: Formulas, parts: Sequence[str], command: str) -> str:
    """Return a LaTeX document (with amsmath) that displays each of `parts`, which are names in `convert.PARTS`.

    Raises InputError if the closed form of the map is requested and too large.
    """
    lines = [f"% {line}" for line in formulas.header(command)]
    lines += [r"\documentclass{article}", r"\usepackage{amsmath}", r"\allowdisplaybreaks"]
    lines += [rf"\setcounter{{MaxMatrixCols}}{{{formulas.dim}}}"] * (formulas.dim > 10)
    lines += [r"\begin{document}", ""]
    if sentence := describe_eps(formulas.map):
        sentence = sentence.replace("eps", r"$\varepsilon$")
        lines += [rf"\noindent {sentence}: the time step is ${2 * formulas.map.time_steps} \varepsilon$.", ""]
    for part in parts:
        title, rows = _display(part, formulas)
        # A long right-hand side is broken between terms of the sum outside braces.
        aligned_rows = []
        for left, right in rows:
            pieces = [""]
            for term in re.split(r" (?=[+-] )", right) if len(right) > _MAX_WIDTH else [right]:
                if pieces[-1] and len(pieces[-1]) + len(term) > _MAX_WIDTH:
                    pieces.append("")
                pieces[-1] += f" {term}" if pieces[-1] else term
            aligned_rows += [f"{left} &= {pieces[0]}", *(rf"&\quad {piece}" for piece in pieces[1:])]
        lines += [f"{title}:", r"\begin{align*}", " \\\\\n".join(aligned_rows), r"\end{align*}", ""]
        if part == "map" and formulas.rhs:
            lines.pop()
            jacobian = " \\\\\n".join(" & ".join(map(latex_polynomial, row)) for row in formulas.jacobian)
            lines += ["", "where", r"\[", rf"f'({_POINT}) = \begin{{pmatrix}}", jacobian, r"\end{pmatrix}.", r"\]", ""]
    return "\n".join([*lines, r"\end{document}", ""])


def _display(part: str, formulas: Formulas) -> tuple[str, Rows]:
    """Return the title of a part, and its equations as pairs (left-hand side, right-hand side)."""
    claim_note = "" if formulas.file.catalog else ", as the file claims"
    if part == "system":
        left = (rf"\dot{{{latex_name(name)}}}" for name in formulas.variables)
        title = r"The system $\dot{\mathbf x} = f(\mathbf x)$"
        return title, list(zip(left, map(latex_polynomial, formulas.rhs), strict=True))
    if part == "map" and formulas.rhs:
        rows = [(_IMAGE, rf"{_POINT} + 2 \varepsilon (I - \varepsilon f'({_POINT}))^{{-1}} f({_POINT})")]
        rows.append((_POINT, f"({', '.join(map(latex_name, formulas.variables))})"))
        return rf"The Kahan map ${_POINT} \mapsto {_IMAGE}$", rows
    if part == "map":
        rows = []
        for row in formulas.equation:
            entries = [(e, name) for e, name in zip(row, formulas.variables, strict=False) if not e.is_zero()]
            if len(entries) == 1:
                ((denominator, name),) = entries
                rows += _quotient(rf"\widetilde{{{latex_name(name)}}}", RationalFunction(row[-1], denominator))
            else:
                terms = (rf"({latex_polynomial(e)}) \widetilde{{{latex_name(name)}}}" for e, name in entries)
                rows.append((" + ".join(terms), latex_polynomial(row[-1])))
        return "The map", rows
    if part == "inverse" and formulas.rhs:
        return "Its inverse", [(_POINT, rf"{_IMAGE} - 2 \varepsilon (I + \varepsilon f'({_IMAGE}))^{{-1}} f({_IMAGE})")]
    if part == "inverse":
        return "Its inverse", _components(formulas, formulas.inverse_form())
    if part == "jacobian":
        derivative = rf"(I - \varepsilon f'({_POINT}))^{{-1}} (I + \varepsilon f'({_IMAGE}))"
        return "Its Jacobi matrix", [(rf"\frac{{\partial {_IMAGE}}}{{\partial {_POINT}}}", derivative)]
    if part == "map-formulas":
        title = f"The {'Kahan map' if formulas.rhs else 'map'} as rational functions"
        return title, _components(formulas, formulas.closed_form())
    if part == "density":
        title = r"The invariant measure $\mathrm{d}\mathbf x/\varphi$"
        if formulas.density is None:
            return title, [(r"\varphi", rf"\det(I - \varepsilon f'({_POINT}))")]
        return title + claim_note, _quotient(r"\varphi", formulas.density)
    rows = [row for name, f in formulas.integrals.items() for row in _quotient(_integral_label(name or "I"), f)]
    for k in range(len(formulas.forms)):
        power = "" if k == 0 else r" A^{\mathsf T}" if k == 1 else rf" (A^{{\mathsf T}})^{{{k}}}"
        rows.append((rf"\widetilde H_{{{k}}}", rf"\tfrac{{1}}{{\varepsilon}} {_POINT}^{{\mathsf T}} J{power} {_IMAGE}"))
    if (member := formulas.file.member) is not None:
        rows += [("A", _matrix(member.A)), ("J", _matrix(member.chosen.hamiltonian.J))]
    elif formulas.H is not None:
        modified = rf"H({_POINT}) + \tfrac{{1}}{{3}} (\nabla H({_POINT}))^{{\mathsf T}} ({_IMAGE} - {_POINT})"
        rows += [(r"\widehat H", modified), ("H", latex_polynomial(formulas.H))]
    return f"Integrals of the map{claim_note if formulas.integrals else ''}", rows


def _components(formulas: Formulas, functions: Sequence[RationalFunction]) -> Rows:
    components = zip(formulas.variables, functions, strict=True)
    return [row for name, function in components for row in _quotient(rf"\widetilde{{{latex_name(name)}}}", function)]


def _matrix(matrix: fmpq_mat) -> str:
    entries = r" \\ ".join(" & ".join(map(str, row)) for row in matrix.tolist())
    return rf"\begin{{pmatrix}} {entries} \end{{pmatrix}}"


def _integral_label(name: str) -> str:
    r"""Return the name of an integral, any printable text, for use in math mode.

    Letters that are not ASCII are written as numbers, since not every TeX supports them.

    >>> print(_integral_label("F1"), _integral_label("a_b"), _integral_label("H~ é"))
    F_1 \mathrm{a\_b} \text{H\textasciitilde{} [U+00E9]}
    """
    ascii_name = "".join(c if c.isascii() else f"[U+{ord(c):04X}]" for c in name)
    is_text = ascii_name != name or any(c in name for c in "\\^~ ")
    return latex_name(ascii_name).replace(r"\mathrm{", r"\text{", 1) if is_text else latex_name(ascii_name)


def _quotient(left: str, function: RationalFunction) -> Rows:
    """Return the row left = P/Q for the function P/Q if P/Q is short, otherwise also rows for integer P and Q."""
    quotient = latex_rational_function(function)
    if len(quotient) <= _MAX_WIDTH or function.is_polynomial:
        return [(left, quotient)]
    is_negative, numerator, denominator = integer_fraction(function)
    P, Q = f"P_{{{left}}}", f"Q_{{{left}}}"
    quotient = rf"{'-' * is_negative}\frac{{{P}}}{{{Q}}}"
    return [(left, quotient), (P, latex_polynomial(numerator)), (Q, latex_polynomial(denominator))]
