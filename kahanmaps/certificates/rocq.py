"""A certificate for Coq 8.16 or newer (Rocq), with the standard library alone.

The theorems are stated for real numbers: for every point x, every x~ with M x~ = r and det M not 0, and all parameters
and eps. Cramer's rule gives (det M) x~ = N, and `ring` proves identities of polynomials; no step searches.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import names_of
from kahanmaps.certificates.identities import (
    ConservedFunction,
    InvariantVolume,
    MapData,
    homogeneous_value,
    letters_of,
)

_LEMMA = """\
Lemma equal_fractions : forall a b c d : R, b <> 0 -> d <> 0 -> a * d = c * b -> a / b = c / d.
Proof.
  intros a b c d Hb Hd H. apply (Rmult_eq_reg_r (b * d)).
  - replace (a / b * (b * d)) with (a * d) by (field; assumption).
    replace (c / d * (b * d)) with (c * b) by (field; assumption). assumption.
  - apply Rmult_integral_contrapositive_currified; assumption.
Qed.
"""


class _Script:
    """The lines of a script about one map, and the names that its letters have in it."""

    def __init__(self, data: MapData) -> None:
        self.data = data
        self.letters = letters_of(data, r"[amnrl]\d+")  # m11, a11, n1, r1, l11 are the script's own
        self.old = [self.letters[name] for name in data.variables]
        self.new = [self.letters[name] for name in data.new]
        n = data.dim
        self.defined = ["det", *(f"{k}{i + 1}{j + 1}" for k in "ma" for i in range(n) for j in range(n))]
        self.defined += [f"{k}{i + 1}" for k in "rn" for i in range(n)]

    @property
    def cramer(self) -> str:
        """The rewriting by Cramer's rule, as often as a coordinate of x~ occurs."""
        return ", ".join(f"?cramer{i + 1}" for i in range(self.data.dim))

    def text(self, polynomial: fmpq_mpoly) -> str:
        """The polynomial in Coq's syntax."""
        letters = [self.letters[name] for name in names_of(polynomial)]
        return polynomial_text(polynomial, letters)

    def expand(self, *further: str) -> str:
        """Return the tactic that unfolds all definitions and proves an identity of polynomials."""
        return f"cbv delta [{' '.join((*further, *self.defined))}] beta; ring."

    def map(self) -> list[str]:
        """The variables, the equation, and Cramer's rule."""
        data, n = self.data, self.data.dim
        constants = [self.letters[name] for name in data.names[n:]]
        lines = [
            f"Variables {' '.join(constants)} : R." if constants else "",
            f"Variables {' '.join(self.old)} : R.  (* a point x *)",
            f"Variables {' '.join(self.new)} : R.  (* its image x~ *)",
            "",
            "(* The equation of the map: M x~ = r. *)",
        ]
        for i, row in enumerate(data.rows):
            lines += [f"Definition m{i + 1}{j + 1} : R := {self.text(entry)}." for j, entry in enumerate(row[:-1])]
            lines.append(f"Definition r{i + 1} : R := {self.text(row[-1])}.")
        left = [" + ".join(f"m{i + 1}{j + 1} * {name}" for j, name in enumerate(self.new)) for i in range(n)]
        lines += [f"Hypothesis equation{i + 1} : {left[i]} = r{i + 1}." for i in range(n)]
        entries = [[f"m{i + 1}{j + 1}" for j in range(n)] for i in range(n)]
        lines += [
            f"Definition det : R := {determinant_text(entries)}.",
            "Hypothesis regular : det <> 0.",
            "",
            "(* Cramer's rule: det x~ = N with N = a r, a the adjugate of M. *)",
        ]
        for i in range(n):
            lines += [f"Definition a{i + 1}{j + 1} : R := {self.text(data.adjugate[i][j])}." for j in range(n)]
            lines.append(f"Definition n{i + 1} : R := {self.text(data.numerators[i])}.")
        for i in range(n):
            combination = " + ".join(f"a{i + 1}{j + 1} * ({left[j]})" for j in range(n))
            lines += [
                f"Lemma cramer{i + 1} : det * {self.new[i]} = n{i + 1}.",
                "Proof.",
                f"  transitivity ({combination}).",
                f"  - {self.expand()}",
                f"  - rewrite {', '.join(f'equation{j + 1}' for j in range(n))}. {self.expand()}",
                "Qed.",
            ]
        return lines

    def moved(self, label: str, polynomial: fmpq_mpoly, degree: int, value: str, *also: str) -> list[str]:
        """The lemma det^degree P(x~) = value for the function `label` = P; `also` are definitions in the value."""
        n = self.data.dim
        letters = [self.letters[name] for name in self.data.names]
        scaled = [f"(det * {name})" for name in self.new] + letters[n:]
        products = _homogeneous_text(polynomial, scaled, degree, n)
        return [
            f"Lemma {label}_image : {label} {' '.join(self.new)} * det ^ {degree} = {value}.",
            "Proof.",
            f"  transitivity ({products}).",
            f"  - cbv delta [{label}] beta; ring.",
            f"  - rewrite {self.cramer}. {self.expand(label, *also)}",
            "Qed.",
        ]

    def conserved(self, claim: ConservedFunction, theorem: str) -> list[str]:
        """The theorem that the function has the same value at x and x~."""
        old, new = " ".join(self.old), " ".join(self.new)
        lines = [
            "(* num / den is an integral; cofactor is that of num and den as Darboux polynomials. *)",
            f"Definition num ({old} : R) : R := {self.text(claim.numerator)}.",
            f"Definition den ({old} : R) : R := {self.text(claim.denominator)}.",
            f"Definition cofactor : R := {self.text(claim.cofactor)}.",
            *self.moved("num", claim.numerator, claim.degree, f"cofactor * num {old}", "cofactor"),
            *self.moved("den", claim.denominator, claim.degree, f"cofactor * den {old}", "cofactor"),
            f"Theorem {theorem} :",
            f"  den {old} <> 0 -> den {new} <> 0 ->",
            f"  num {new} / den {new} = num {old} / den {old}.",
            "Proof.",
            "  intros Hx Hy. apply equal_fractions; [assumption | assumption |].",
            f"  apply (Rmult_eq_reg_r (det ^ {claim.degree})); [| apply pow_nonzero; exact regular].",
            f"  transitivity (num {new} * det ^ {claim.degree} * den {old}); [ring |]. rewrite num_image.",
            f"  transitivity (num {old} * (den {new} * det ^ {claim.degree})); [rewrite den_image; ring | ring].",
            "Qed.",
        ]
        return lines

    def invariant(self, claim: InvariantVolume, theorem: str) -> list[str]:
        """The theorem that dx/phi is invariant: phi(x~) det M = phi(x) det L."""
        n, old, new = self.data.dim, " ".join(self.old), " ".join(self.new)
        entries = [[f"l{i + 1}{j + 1}" for j in range(n)] for i in range(n)]
        power = claim.degree
        lines = [
            "(* The derivative of the map is M^-1 L with L the derivative of r - M x~ in x at fixed x~. *)",
        ]
        for i, row in enumerate(claim.derivative):
            lines += [f"Definition l{i + 1}{j + 1} : R := {self.text(entry)}." for j, entry in enumerate(row)]
        flat = " ".join(name for row in entries for name in row)
        lines += [
            f"Definition volume : R := {determinant_text(entries)}.  (* det L *)",
            "(* dx/phi with phi = num / den is invariant: phi(x~) = phi(x) det(M^-1 L). *)",
            f"Definition num ({old} : R) : R := {self.text(claim.numerator)}.",
            f"Definition den ({old} : R) : R := {self.text(claim.denominator)}.",
        ]
        statement = [
            f"Theorem {theorem} :",
            f"  den {old} <> 0 -> den {new} <> 0 ->",
            f"  num {new} / den {new} = num {old} / den {old} * (volume / det).",
            "Proof.",
            "  intros Hx Hy.",
            f"  replace (num {old} / den {old} * (volume / det)) with (num {old} * volume / (den {old} * det))",
            "    by (field; split; [exact regular | assumption]).",
            "  apply equal_fractions; [assumption | apply Rmult_integral_contrapositive_currified; [assumption |"
            " exact regular] |].",
        ]
        if claim.is_free:
            further = f"num den volume {flat}"
            return [*lines, *statement, f"  (* This identity holds for any x and x~. *) {self.expand(further)}", "Qed."]
        for label, polynomial in (("num", claim.numerator), ("den", claim.denominator)):
            image = homogeneous_value(polynomial, power, self.data)
            lines += self.moved(label, polynomial, power, self.text(image))
        # det L has degree 1 in each row in x~: det^n det L is the determinant with the rows at (det, det x~).
        scaled = [[f"({_scaled_row(entry, self, n)})" for entry in row] for row in claim.derivative]
        return [
            *lines,
            f"Lemma volume_scaled : volume * det ^ {n} = {determinant_text(scaled)}.",
            f"Proof. cbv delta [volume {flat}] beta; ring. Qed.",
            *statement,
            f"  apply (Rmult_eq_reg_r (det ^ {power + n})); [| apply pow_nonzero; exact regular].",
            f"  transitivity (num {new} * det ^ {power} * (den {old} * det * det ^ {n})); [ring |].",
            f"  transitivity (num {old} * (volume * det ^ {n}) * (den {new} * det ^ {power})); [| ring].",
            f"  rewrite num_image, den_image, volume_scaled, {self.cramer}.",
            f"  {self.expand('num', 'den')}",
            "Qed.",
        ]


def rocq_certificate(
    data: MapData, claims: Sequence[ConservedFunction | InvariantVolume], header: Sequence[str] = ()
) -> str:
    """Write a script that Coq accepts only if it proves the claims about the map.

    Args:
        data: the map.
        claims: the statements to be proved, each in a section of its own.
        header: lines of the comment on top.
    """
    # Nothing in a comment may end it, or begin another one or a string.
    safe_lines = (line.replace("(*", "( *").replace("*)", "* )").replace('"', "'") for line in header)
    lines = ["(*", *(f"   {line}" for line in safe_lines), "   Check: coqc FILE", "*)"]
    lines += ["Require Import Reals.", "Open Scope R_scope.", "", _LEMMA]
    theorems = []
    for k, claim in enumerate(claims, 1):
        theorem = f"{re.sub(r'[^A-Za-z0-9_]', '_', claim.name)}_"
        theorem = theorem if re.match("[A-Za-z]", theorem) else f"v_{theorem}"
        theorem += "conserved" if isinstance(claim, ConservedFunction) else "invariant"
        theorems.append(theorem)
        script = _Script(data)
        prove = script.conserved if isinstance(claim, ConservedFunction) else script.invariant
        lines += [f"Module Claim{k}.", "Section Map.", *script.map(), ""]
        lines += [*prove(claim, theorem), "End Map.", f"End Claim{k}.", ""]  # type: ignore[arg-type]
    lines += [f"Print Assumptions Claim{k}.{theorem}." for k, theorem in enumerate(theorems, 1)]
    return "\n".join(lines) + "\n"


def polynomial_text(polynomial: fmpq_mpoly, letters: Sequence[str], times: str = " * ", power: str = " ^ ") -> str:
    """A polynomial with integral coefficients in the letters, as sums of products."""
    pieces: list[str] = []
    for exponents, coefficient in polynomial.terms():
        factors = [name if k == 1 else f"{name}{power}{k}" for name, k in zip(letters, exponents, strict=True) if k]
        size = abs(coefficient)
        product = times.join(([str(size)] if size != 1 or not factors else []) + factors)
        sign = ("- " if coefficient < 0 else "") if not pieces else (" - " if coefficient < 0 else " + ")
        pieces.append(sign + product)
    return "".join(pieces) or "0"


def determinant_text(entries: Sequence[Sequence[str]], times: str = " * ") -> str:
    """The determinant of a matrix of texts, expanded along its first row."""
    if len(entries) == 1:
        return entries[0][0]
    pieces: list[str] = []
    for j, entry in enumerate(entries[0]):
        minor = [[*row[:j], *row[j + 1 :]] for row in entries[1:]]
        inner = determinant_text(minor, times)
        product = f"{entry}{times}{inner if len(minor) == 1 else f'({inner})'}"
        pieces.append(product if j == 0 else f"{' - ' if j % 2 else ' + '}{product}")
    return "".join(pieces)


def _homogeneous_text(polynomial: fmpq_mpoly, letters: Sequence[str], degree: int, dim: int) -> str:
    """det^degree P with (det x~)/det for the variables: `letters` holds det x~ for these."""
    pieces = []
    for exponents, coefficient in polynomial.terms():
        factors = [name if k == 1 else f"{name} ^ {k}" for name, k in zip(letters, exponents, strict=True) if k]
        spare = degree - sum(int(k) for k in exponents[:dim])
        factors += [f"det ^ {spare}"] if spare else []
        pieces.append(" * ".join([f"({coefficient})", *factors]))
    return " + ".join(pieces) or "0"


def _scaled_row(entry: fmpq_mpoly, script: _Script, dim: int) -> str:
    """det times an entry of L, with det x~ for x~: of degree at most 1 in x~."""
    letters = [script.letters[name] for name in names_of(entry)]
    letters[dim : 2 * dim] = [f"(det * {name})" for name in letters[dim : 2 * dim]]
    pieces = []
    for exponents, coefficient in entry.terms():
        factors = [name if k == 1 else f"{name} ^ {k}" for name, k in zip(letters, exponents, strict=True) if k]
        factors += [] if any(exponents[dim : 2 * dim]) else ["det"]
        pieces.append(" * ".join([f"({coefficient})", *factors]))
    return " + ".join(pieces) or "0"
