"""Certificates for PARI/GP and for SymPy: each identity is multiplied out, and `true` printed for it.

The script states M and r, and N and D with M N = D r, so that x~ = N/D where det M is not 0. Then it computes
D^k P(N/D) by putting N and D into P made homogeneous with a letter h, which stays within polynomials, and compares it
with C P. It ends with status 1 if an identity does not hold.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import names_of
from kahanmaps.certificates.identities import ConservedFunction, InvariantVolume, MapData, letters_of
from kahanmaps.certificates.rocq import polynomial_text

_PARI = """\
default(recover, 0);  \\\\ an error ends gp with a status that is not 0
default(parisizemax, 2*10^9);
ok = 1;
det(A) = matdet(A);
check(text, holds) = {{ print(text, ": ", if(holds, "true", "FALSE")); if(!holds, ok = 0); }}
M = {matrix};
r = [{right}]~;
N = [{numerators}]~;
D = {determinant};
n = {dim};
old = [{variables}, h];
image(P) = substvec(P, old, concat(N~, [D]));  \\\\ of P, homogeneous in x and h
check("M N = D r", M*N == D*r && D != 0);
"""
_SYMPY = """\
import sys
from itertools import permutations
from math import prod

from sympy import ZZ
from sympy.polys.rings import ring

R, {letters}, h = ring("{names},h", ZZ)
old = [{variables}]
one = R.one  # makes a polynomial of a number
M = {matrix}
r = [{right}]
N = [{numerators}]
D = {determinant}
n = {dim}
results = []


def check(text, holds):
    results.append(holds)
    print(f"{{text}}: {{'true' if holds else 'FALSE'}}")


def image(P):  # of P, homogeneous in x and h: N and D in their places
    places = [R.gens.index(letter) for letter in (*old, h)]
    total = R.zero
    for exponents, coefficient in P.terms():
        rest = [0 if k in places else e for k, e in enumerate(exponents)]
        factors = [value ** exponents[k] for value, k in zip((*N, D), places)]
        total += prod(factors, start=R({{tuple(rest): coefficient}}))
    return total


def det(A):
    n, total = len(A), R.zero
    for p in permutations(range(n)):
        sign = (-1) ** sum(p[i] > p[j] for i in range(n) for j in range(i + 1, n))
        total += prod((A[i][p[i]] for i in range(n)), start=R(sign))
    return total


check("M N = D r", D != 0 and all(sum(M[i][j] * N[j] for j in range(n)) == D * r[i] for i in range(n)))
"""


@dataclass(frozen=True)
class Language:
    """How a program writes powers, definitions, matrices, the value at h = 1, and comments."""

    start: str
    end: str
    run: str
    power: str
    comment: str
    definition: str
    matrix: str
    next_row: str
    at_one: str


GP = Language(_PARI, "quit(!ok)", "gp -q FILE", "^", r"\\ ", "{} = {};", "[{}]", "; ", "subst({}, h, 1)")
PYTHON = Language(
    _SYMPY, "sys.exit(not all(results))", "python FILE (needs SymPy)", "**", "# ", "{} = {} * one", "[[{}]]", "], [",
    "{}.subs(h, 1)",
)  # fmt: skip


def script_certificate(
    to: Language, data: MapData, claims: Sequence[ConservedFunction | InvariantVolume], header: Sequence[str] = ()
) -> str:
    """Write a script that multiplies out the identities of the claims about the map.

    Args:
        to: GP, for `gp -q FILE`, or PYTHON, for SymPy.
        data: the map.
        claims: the statements to be checked.
        header: lines of the comment on top.
    """
    n = data.dim
    letters = letters_of(data, "[hijknpr]")
    old = [letters[name] for name in data.variables]

    def text(polynomial: fmpq_mpoly) -> str:
        return sum_text(polynomial_text(polynomial, [letters[name] for name in names_of(polynomial)], "*", to.power))

    def sum_text(text: str) -> str:
        """Return a sum as text; for Python in parts, as it cannot parse a sum of thousands of terms."""
        terms = re.split(r" (?=[+-] )", text)
        parts = [" ".join(terms[k : k + 50]) for k in range(0, len(terms), 50)]
        if to is GP or len(parts) == 1:
            return text
        return f"sum([{', '.join(parts)}])"

    def homogeneous(polynomial: fmpq_mpoly, degree: int) -> str:
        """The polynomial with powers of h that make it homogeneous of the degree in the variables."""
        pieces = []
        for exponents, coefficient in polynomial.terms():
            names = [letters[name] for name in names_of(polynomial)]
            spare = degree - sum(int(k) for k in exponents[:n])
            powers = [f"{a}{to.power}{k}" for a, k in zip([*names, "h"], [*exponents, spare], strict=True) if k]
            pieces.append("*".join([f"({coefficient})", *powers]))
        return sum_text(" + ".join(pieces) or "0")

    def at_numerators(entry: fmpq_mpoly) -> str:
        """Return D times an entry of L at x~ = N/D; the entry is of degree at most 1 in x~."""
        names = [letters[name] for name in data.variables] + [f"N{k}" for k in range(n)]
        names += [letters[name] for name in data.names[n:]]
        pieces = []
        for exponents, coefficient in entry.terms():
            powers = [f"{a}{to.power}{k}" for a, k in zip(names, exponents, strict=True) if k]
            powers += [] if any(exponents[n : 2 * n]) else ["D"]
            pieces.append("*".join([f"({coefficient})", *powers]))
        return " + ".join(pieces) or "0"

    def matrix(rows: Sequence[Sequence[str]]) -> str:
        if n == 1 and to is GP:  # [a] would be a vector
            return f"Mat({rows[0][0]})"
        return to.matrix.format(to.next_row.join(", ".join(row) for row in rows))

    names = [letters[name] for name in (*data.names, *data.new)]
    lines = [f"{to.comment}{line}" for line in (*header, f"Check: {to.run}")]
    lines.append(
        to.start.format(
            letters=", ".join(names),
            names=",".join(names),
            variables=", ".join(old),
            dim=n,
            matrix=matrix([[text(entry) for entry in row[:-1]] for row in data.rows]),
            right=", ".join(text(row[-1]) for row in data.rows),
            numerators=", ".join(map(text, data.numerators)),
            determinant=text(data.determinant),
        )
    )
    for claim in claims:
        label = re.sub(r"[^\w ~^*/+()-]", "_", claim.name)
        is_conserved = isinstance(claim, ConservedFunction)
        says = "P/Q is an integral" if is_conserved else "dx/phi is invariant, phi = P/Q"
        lines.append(f"{to.comment}{label}: {says}; k = {claim.degree}")
        for name, polynomial in (("P", claim.numerator), ("Q", claim.denominator)):
            lines.append(to.definition.format(name, f"({text(polynomial)})"))
            lines.append(to.definition.format(f"{name}h", f"({homogeneous(polynomial, claim.degree)})"))
            lines.append(_check(to, f"{label}: {name}h = {name} at h = 1", f"{to.at_one.format(name + 'h')} == {name}"))
        if isinstance(claim, ConservedFunction):
            lines.append(to.definition.format("C", f"({text(claim.cofactor)})"))
            lines.append(_check(to, f"{label}: C is not 0", "C != 0"))
            for name in "PQ":
                lines.append(_check(to, f"{label}: D^k {name}(N/D) = C {name}", f"image({name}h) == C*{name}"))
        else:
            lines.append(_check(to, "D = det M", "D == det(M)"))
            if claim.is_free:
                entries = [[text(entry) for entry in row] for row in claim.derivative]
                for name, polynomial in (("Py", claim.numerator), ("Qy", claim.denominator)):
                    at_new = [letters[name] for name in (*data.new, *data.names[n:])]
                    lines.append(to.definition.format(name, f"({polynomial_text(polynomial, at_new, '*', to.power)})"))
                says, identity = "for any x and x~", "Py*Q*D == P*Qy*det(L)"
            else:
                lines += [f"N{k} = N[{k if to is PYTHON else k + 1}]" + ";" * (to is GP) for k in range(n)]
                entries = [[at_numerators(entry) for entry in row] for row in claim.derivative]
                says, identity = "at x~ = N/D", f"image(Ph)*Q*D{to.power}(n + 1) == P*image(Qh)*det(L)"
            lines.append(f"L = {matrix(entries)}" + ";" * (to is GP))
            lines.append(_check(to, f"{label}: phi(x~) det M = phi(x) det L(x, x~) {says}", identity))
        lines.append("")
    lines.append(to.end)
    return "\n".join(lines) + "\n"


def _check(to: Language, label: str, identity: str) -> str:
    return f'check("{label}", {identity})' + ";" * (to is GP)
