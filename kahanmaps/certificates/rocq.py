"""A certificate for Coq 8.16 or newer (Rocq); it needs only the standard library.

The theorems are stated for real numbers: for every point x, every x~ with M x~ = r and det M not 0, and all parameters
and eps. Cramer's rule gives (det M) x~ = N, and `ring` proves polynomial identities; no step needs a search.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, names_of, ring
from kahanmaps.certificates.chains import Chain
from kahanmaps.certificates.combinations import AffineSymmetry, ChangedFunction, OrbitIntegral
from kahanmaps.certificates.darboux import (
    ConservedFunction,
    DarbouxPolynomial,
    DarbouxProducts,
    InvariantVolume,
    Monomial,
)
from kahanmaps.certificates.entropy import PositiveEntropy
from kahanmaps.certificates.identities import (
    EquationClaim,
    InvariantTensor,
    MapClaim,
    MapData,
    letters_of,
    restrict,
)
from kahanmaps.certificates.rocq_entropy import LIBRARY, entropy_proof

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
    """The lines of a script about one map, and the script's names for the variables and constants of the map."""

    def __init__(self, data: MapData) -> None:
        self.data, self.is_solved = data, False
        self.letters = letters_of(data, r"d|[acd-hlmnprw]\d+")  # the script itself defines a11, e1, ...
        # `xs`, `ys`, `zs` are the letters of x, its image y and the image z of y; `x`, `y`, `z` join them by blanks.
        self.xs = [self.letters[name] for name in data.variables]
        self.ys = [self.letters[name] for name in data.new]
        self.zs = [self.letters[f"{name}2"] for name in data.new]
        self.x, self.y, self.z = (" ".join(letters) for letters in (self.xs, self.ys, self.zs))

    @property
    def cramer(self) -> str:
        """Return the tactic that rewrites every coordinate of x~ by Cramer's rule."""
        return ", ".join(f"?cramer{i + 1}" for i in range(self.data.dim))

    def text(self, polynomial: fmpq_mpoly) -> str:
        """Return the polynomial in Coq's syntax."""
        letters = [self.letters[name] for name in names_of(polynomial)]
        return polynomial_text(polynomial, letters)

    def image_letters(self, at_n: bool) -> list[str]:
        """Return det(M) x~_1, ... as texts: n1, ... if `at_n`, else products that Cramer's rule turns into n1, ..."""
        return [f"n{i + 1}" if at_n else f"(det * {name})" for i, name in enumerate(self.ys)]

    @property
    def constants(self) -> list[str]:
        """The line that declares the symbols and eps, in a list; no line if there are none."""
        letters = [self.letters[name] for name in self.data.names[self.data.dim :]]
        return [f"Variables {' '.join(letters)} : R."] if letters else []

    def functions(self, arguments: str, /, **polynomials: fmpq_mpoly) -> list[str]:
        """Return the definitions of the `polynomials` as functions of the `arguments`."""
        return [f"Definition {name} ({arguments} : R) : R := {self.text(P)}." for name, P in polynomials.items()]

    def predicate(self, letter: str = "e", relation: str = "maps", data: MapData | None = None) -> list[str]:
        """Define the relation M x~ - r = 0 between points x and x~, and the entries e1, e2, ... of its left side."""
        rows, arguments = (data or self.data).rows, " ".join([*self.xs, *self.ys])
        lines = [f"(* The equation of the map, M x~ - r = 0: `{relation}` x x~ says that it holds. *)"]
        for i, row in enumerate(rows):
            terms = [f"({self.text(entry)}) * {name}" for entry, name in zip(row[:-1], self.ys, strict=True) if entry]
            total = f"{' + '.join(terms)} - ({self.text(row[-1])})"
            lines.append(f"Definition {letter}{i + 1} ({arguments} : R) : R := {total}.")
        equations = " /\\ ".join(f"{letter}{i + 1} {arguments} = 0" for i in range(len(rows)))
        return [*lines, f"Definition {relation} ({arguments} : R) : Prop := {equations}."]

    def uniqueness_lemma(self, letter: str, data: MapData) -> list[str]:
        """State the lemma that a point with det M not 0 has one image; the proof uses adjugates of the blocks of M."""
        x, y, z = self.x, self.y, self.z
        goal = " /\\ ".join(f"{a} = {b}" for a, b in zip(self.ys, self.zs, strict=True))
        one = ring(data.names).constant(1)
        block_of_variable = [restrict(data, RationalFunction(a, one)) for a in ring(data.names).gens()[: data.dim]]
        blocks = list({block.variables: block for block in block_of_variable}.values())
        dets = [f"{letter}_det_{b + 1}" for b in range(len(blocks))]
        lines = [
            *self.functions(x, **{name: block.determinant for name, block in zip(dets, blocks, strict=True)}),
            f"Definition {letter}_det ({x} : R) : R := {' * '.join(f'{name} {x}' for name in dets)}.",
            f"Lemma {letter}_unique : forall {x} {y} {z}, {letter}_det {x} <> 0 ->",
            f"  {letter}_maps {x} {y} -> {letter}_maps {x} {z} -> {goal}.",
            f"Proof. intros {x} {y} {z} H {self.hypothesis('A')} {self.hypothesis('B')}.",
        ]
        for name in dets:
            tactics = f"intro Z; apply H; unfold {letter}_det; rewrite Z; ring"
            lines.append(f"  assert (N_{name} : {name} {x} <> 0) by ({tactics}).")
        for i, block in enumerate(block_of_variable):
            name = dets[[other_block.variables for other_block in blocks].index(block.variables)]
            rows = [data.variables.index(variable) + 1 for variable in block.variables]
            terms = [
                f"({self.text(a)}) * ({letter}{j} {x} {y} - {letter}{j} {x} {z})"
                for j, a in zip(rows, block.adjugate[rows.index(i + 1)], strict=True)
                if a
            ]
            definitions = " ".join([name, *(f"{letter}{j}" for j in rows)])
            tactics = f"apply (Rmult_eq_reg_l ({name} {x})); [apply Rminus_diag_uniq | assumption]. "
            tactics += f"transitivity ({' + '.join(terms)}); [cbv delta [{definitions}] beta; ring |"
            tactics += f" rewrite {', '.join(f'?{k}{j}' for k in 'AB' for j in rows)}; ring]."
            lines.append(f"  split. {{ {tactics} }}" if i < data.dim - 1 else f"  {tactics}")
        return [*lines, "Qed."]

    def chain(self, claim: Chain, theorem: str) -> list[str]:
        """State the theorem that the two `equal_points` of the claim are equal."""
        n, lines = self.data.dim, list[str]()
        for letter, data in claim.maps.items():
            lines += [*self.predicate(letter, f"{letter}_maps", data), *self.uniqueness_lemma(letter, data)]
        lines += [f"Variables {self.x} : R.  (* a point x *)"]
        points, denominators = [self.xs], [[""] * n]
        for v, value in enumerate(claim.values[1:], 1):
            for i, P in enumerate(value.numerators):
                lines.append(f"Definition w{v}_{i + 1} : R := {self.text(P)}.")
            for k, Q in enumerate(value.denominators):
                lines += [
                    f"Definition d{v}_{k + 1} : R := {self.text(Q)}.",
                    f"Hypothesis h{v}_{k + 1} : d{v}_{k + 1} <> 0.",
                ]
            points.append([f"w{v}_{i + 1}" for i in range(n)])
            denominators.append([f"d{v}_{k + 1}" for k in value.denominator_indices])
        point_texts = [
            " ".join(f"({a} / {q})" if q else a for a, q in zip(point, point_denominators, strict=True))
            for point, point_denominators in zip(points, denominators, strict=True)
        ]
        definitions = " ".join(dict.fromkeys(name for names in (*points[1:], *denominators) for name in names if name))
        for k, (letter, source, v) in enumerate(claim.arrows, 1):
            s, data = claim.value_of(source), claim.maps[letter]
            for i, residual in enumerate(data.residual(data.two_points, 0, n)):
                numerator_text, denominator_text = self._fraction_text(
                    residual, [*points[s], *points[v]], [*denominators[s], *denominators[v]]
                )
                lines += [
                    f"Lemma arrow{k}_{i + 1} : {letter}{i + 1} {point_texts[s]} {point_texts[v]} = 0.",
                    "Proof.",
                    f"  transitivity (({numerator_text}) / ({denominator_text})).",
                    f"  - unfold {letter}{i + 1}. field. repeat split; assumption.",
                    f"  - replace ({numerator_text}) with 0; [unfold Rdiv; ring |].",
                    f"    cbv delta [{definitions}] beta; ring.",
                    "Qed.",
                ]
            proofs = [f"exact arrow{k}_{i + 1}" for i in range(n)]
            tactics = " ".join(f"split; [{proof} |]." for proof in proofs[:-1])
            lines.append(
                f"Lemma arrow{k} : {letter}_maps {point_texts[s]} {point_texts[v]}. Proof. {tactics} {proofs[-1]}. Qed."
            )
        point_names = [self.xs, *([f"{a}_p{k}" for a in self.xs] for k in range(1, len(claim.arrows) + 1))]
        hypotheses, proof = [], []
        for k, (letter, source, _) in enumerate(claim.arrows, 1):
            source_names, image_names = " ".join(point_names[source]), " ".join(point_names[k])
            hypotheses.append(f"  {letter}_det {source_names} <> 0 -> {letter}_maps {source_names} {image_names} ->")
            proof.append(f"  intros D M. destruct ({letter}_unique _ _ D M arrow{k}) as {self.hypothesis('A')}.")
            proof[-1] = proof[-1].replace("_unique _ _", "_unique" + " _" * (3 * n))
            proof.append(f"  subst {image_names}. clear D M.")
        all_names = " ".join(name for names in point_names[1:] for name in names)
        i, j = claim.equal_points
        conclusion = " /\\ ".join(f"{a} = {b}" for a, b in zip(point_names[i], point_names[j], strict=True))
        return [
            *lines,
            f"Theorem {theorem} : forall {all_names},",
            *hypotheses,
            f"  {conclusion}.",
            f"Proof. intros {all_names}.",
            *proof,
            "  repeat (split; [reflexivity |]). reflexivity.",
            "Qed.",
        ]

    def _fraction_text(
        self, polynomial: fmpq_mpoly, numerators: Sequence[str], denominators: Sequence[str]
    ) -> tuple[str, str]:
        """Return numerator and denominator, as texts, of a polynomial at the fractions with these texts."""
        distinct_denominators = [q for q in dict.fromkeys(denominators) if q]
        count = len(numerators)
        constants = [self.letters[name] for name in names_of(polynomial)[count:]]
        rows = [([int(e) for e in exponents], c) for exponents, c in polynomial.terms()]

        def degree(row: Sequence[int], q: str) -> int:
            return sum(e for e, denominator in zip(row[:count], denominators, strict=True) if denominator == q)

        powers = {q: max((degree(row, q) for row, _ in rows), default=0) for q in distinct_denominators}
        terms = []
        for row, coefficient in rows:
            exponents = [*row, *(power - degree(row, q) for q, power in powers.items())]
            terms.append(" * ".join([f"({coefficient})", *powers_text([*numerators, *constants, *powers], exponents)]))
        return " + ".join(terms), " * ".join(f"{q} ^ {power}" for q, power in powers.items() if power) or "1"

    def hypothesis(self, letter: str) -> str:
        """Return the pattern that splits the hypothesis `maps` into one for each coordinate, as (A1 & A2)."""
        names = [f"{letter}{i + 1}" for i in range(self.data.dim)]
        return f"({' & '.join(names)})" if len(names) > 1 else names[0]

    def orbit_integral(self, claim: OrbitIntegral, theorem: str) -> list[str]:
        """State the theorem that a function of x and x~ has the same value one step later."""
        n = self.data.dim
        x, y, z = self.x, self.y, self.z
        residuals = [f"e{i + 1}" for i in range(n)]
        terms = [f"({self.text(c)}) * {e} {x} {y}" for c, e in zip(claim.first, residuals, strict=True) if c]
        terms += [f"({self.text(c)}) * {e} {y} {z}" for c, e in zip(claim.second, residuals, strict=True) if c]
        rewriting = ", ".join(f"?{letter}{i + 1}" for letter in "AB" for i in range(n))
        return [
            *self.predicate(),
            "(* value x x~ = num x x~ / den is an integral. *)",
            *self.functions(f"{x} {y}", num=claim.numerator),
            f"Definition den : R := {self.text(claim.denominator)}.",
            f"Definition value ({x} {y} : R) : R := num {x} {y} / den.",
            f"Theorem {theorem} : forall {x} {y} {z},",
            f"  maps {x} {y} -> maps {y} {z} -> value {y} {z} = value {x} {y}.",
            "Proof.",
            f"  intros {x} {y} {z} {self.hypothesis('A')} {self.hypothesis('B')}. unfold value.",
            f"  replace (num {y} {z}) with (num {x} {y}); [reflexivity |]. apply Rminus_diag_uniq_sym.",
            f"  transitivity ({' + '.join(terms)}).",
            f"  - cbv delta [num {' '.join(residuals)}] beta; ring.",
            f"  - rewrite {rewriting}. ring.",
            "Qed.",
        ]

    def affine_symmetry(self, claim: AffineSymmetry, theorem: str) -> list[str]:
        """State the theorem that x -> T x takes the map to itself, to its inverse, or to another map."""
        n, is_own = self.data.dim, claim.target is claim.data
        x, y = self.x, self.y
        polynomials = self.data.at_points(*claim.image)
        points = [[f"(({self.text(P)}) / {claim.divisor})" for P in side] for side in polynomials]
        first_point, second_point = (" ".join(side) for side in (reversed(points) if claim.reversing else points))
        target, letters = ("maps", "e") if is_own else ("target", "ef")
        onto_equations = " /\\ ".join(f"{image} = {name}" for image, name in zip(points[1], self.xs, strict=True))
        preimage = [f"(({self.text(P)}) / {divisor})" for P, divisor in claim.inverse]
        lines = [
            *self.predicate(),
            *([] if is_own else self.predicate("f", target, claim.target)),
            f"(* {'To the inverse' if claim.reversing else 'Map to map'} by T: {', '.join(points[0])} *)",
            f"Theorem {theorem}_is_onto : forall {x}, exists {y}, {onto_equations}.",
            f"Proof. intros {x}. exists {', '.join(preimage)}. {'split; [field |]. ' * (n - 1)}field. Qed.",
            f"Theorem {theorem} : forall {x} {y}, maps {x} {y} ->",
            f"  {target} {first_point} {second_point}.",
            "Proof.",
            f"  intros {x} {y} {self.hypothesis('A')}.",
        ]
        for i, row in enumerate(claim.matrix):
            terms = [f"({c}) * e{j + 1} {x} {y}" for j, c in enumerate(row) if c]
            tactics = f"transitivity (({' + '.join(terms) or '0'}) / {claim.multiple}); "
            tactics += f"[cbv delta [{' '.join(f'{k}{j + 1}' for k in letters for j in range(n))}] beta; field |"
            tactics += f" rewrite {', '.join(f'?A{j + 1}' for j in range(n))}; field]."
            lines.append(f"  split; [{tactics[:-1]} |]." if i < n - 1 else f"  {tactics}")
        return [*lines, "Qed."]

    def coordinate_change(self, claim: ChangedFunction, theorem: str) -> list[str]:
        """State the theorem that a function of x = T z equals another function of z."""
        z, names = self.x, ("num", "den", "num_z", "den_z")
        point_text = " ".join(f"(({self.text(P)}) / {claim.divisor})" for P in claim.image)
        return [
            *self.functions(z, **dict(zip(names, (*claim.old_function, *claim.new_function), strict=True))),
            f"Theorem {theorem} : forall {z},",
            f"  num {point_text} * den_z {z} = num_z {z} * den {point_text}.",
            f"Proof. intros {z}. cbv delta [{' '.join(names)}] beta; field. Qed.",
        ]

    def expand_tactic(self, *names: str) -> str:
        """Return the tactic that unfolds the definitions of the map and `names`, and proves a polynomial identity."""
        n = self.data.dim
        definitions = [*(name for k in "ma"[: 1 + self.is_solved] for row in entries(k, n) for name in row)]
        definitions += [f"{k}{i + 1}" for k in "rn"[: 1 + self.is_solved] for i in range(n)]
        if not self.is_solved:
            return f"cbv delta [{' '.join((*names, 'det', *definitions))}] beta; ring."
        unfolding = f"cbv delta [{' '.join(names)}] beta; " if names else ""
        return f"{unfolding}rewrite ?det_value; cbv delta [{' '.join(('d', *definitions))}] beta; ring."

    def map_equation(self, is_solved: bool) -> list[str]:
        """Write the variables, the equation of the map and, if `is_solved`, its solution by Cramer's rule."""
        data, n = self.data, self.data.dim
        self.is_solved = is_solved
        lines = [
            *self.constants,
            f"Variables {self.x} : R.  (* a point x *)",
            f"Variables {self.y} : R.  (* its image x~ *)",
            "",
            "(* The equation of the map: M x~ = r. *)",
        ]
        for i, row in enumerate(data.rows):
            lines += [f"Definition m{i + 1}{j + 1} : R := {self.text(entry)}." for j, entry in enumerate(row[:-1])]
            lines.append(f"Definition r{i + 1} : R := {self.text(row[-1])}.")
        left_sides = [" + ".join(f"m{i + 1}{j + 1} * {name}" for j, name in enumerate(self.ys)) for i in range(n)]
        lines += [f"Hypothesis equation{i + 1} : {left_sides[i]} = r{i + 1}." for i in range(n)]
        lines += [f"Definition det : R := {determinant_text(entries('m', n))}.", "Hypothesis regular : det <> 0."]
        if not is_solved:
            return lines
        definitions = " ".join(["det", "d", *(name for row in entries("m", n) for name in row)])
        lines += [
            "",
            f"Definition d : R := {self.text(data.determinant)}.",
            f"Lemma det_value : det = d. Proof. cbv delta [{definitions}] beta; ring. Qed.",
            "(* Cramer's rule: det x~ = N with N = a r, a the adjugate of M. *)",
        ]
        for i in range(n):
            lines += [f"Definition a{i + 1}{j + 1} : R := {self.text(data.adjugate[i][j])}." for j in range(n)]
            lines.append(f"Definition n{i + 1} : R := {self.text(data.numerators[i])}.")
        for i in range(n):
            combination = " + ".join(f"a{i + 1}{j + 1} * ({left_sides[j]})" for j in range(n))
            lines += [
                f"Lemma cramer{i + 1} : det * {self.ys[i]} = n{i + 1}.",
                "Proof.",
                f"  transitivity ({combination}).",
                f"  - {self.expand_tactic()}",
                f"  - rewrite {', '.join(f'equation{j + 1}' for j in range(n))}. {self.expand_tactic()}",
                "Qed.",
            ]
        return lines

    def image_lemma(self, label: str, P: fmpq_mpoly, degree: int, value: str = "", *definitions: str) -> list[str]:
        """State the lemma det^degree P(x~) = value, where `label` is the name of P; `definitions` occur in the value.

        By default the value is the homogenized P at N and det.
        """
        n = self.data.dim
        constants = [self.letters[name] for name in self.data.names[n:]]
        scaled_text, value_at_n = (
            _homogeneous_text(P, [*self.image_letters(is_at_n), *constants], degree, slice(n))
            for is_at_n in (False, True)
        )
        tactic = f"{self.expand_tactic(label, *definitions)}" if value else "ring."
        return [
            f"Lemma {label}_image : {label} {self.y} * det ^ {degree} = {value or value_at_n}.",
            "Proof.",
            f"  transitivity ({scaled_text}).",
            f"  - cbv delta [{label}] beta; ring.",
            f"  - rewrite {self.cramer}. {tactic}",
            "Qed.",
        ]

    def products(self, fraction: DarbouxProducts, *labels: tuple[str, str]) -> list[str]:
        """Define the products of Darboux polynomials, and state the lemmas that the map multiplies them by cofactors.

        `labels` contains, for each product, its name and the name of its cofactor.
        """
        x, y, k = self.x, self.y, fraction.degree
        lines = [f"Definition c{j} : R := {self.text(c)}." for j, c in enumerate(fraction.common_factors, 1)]
        for (label, letter), product, cofactor in zip(labels, fraction.products, fraction.cofactors, strict=True):
            is_single = product.is_single and product.degree == k
            names = [label if is_single else f"{label}_{i}" for i in range(1, len(product.factors) + 1)]
            definition = f"Definition {letter} : R := {_monomial_text(cofactor)}."
            lines += [] if definition in lines else [definition]
            for name, factor in zip(names, product.factors, strict=True):
                lines += self.functions(x, **{name: factor.polynomial})
                value = letter if is_single else f"({_monomial_text(factor.cofactor)})"
                definitions = [f"c{j}" for j, power in enumerate(factor.cofactor.powers[1:], 1) if power]
                definitions += [letter] if is_single else []
                lines += self.image_lemma(name, factor.polynomial, factor.degree, f"{value} * {name} {x}", *definitions)
            if is_single:
                continue
            content = [] if product.content.is_one() and names else [f"({self.text(product.content)})"]
            factors = list(zip(names, product.factors, strict=True))
            text = " * ".join(content + [f"{name} {x}" + _power_text(factor.exponent) for name, factor in factors])
            scaled_factors = [f"({name} {y} * det ^ {f.degree})" + _power_text(f.exponent) for name, f in factors]
            scaled_factors = [*content, *scaled_factors, f"det ^ {k - product.degree}"]
            images = "".join(f"?{name}_image, " for name in names)[:-2]
            lines += [
                f"Definition {label} ({x} : R) : R := {text}.",
                f"Lemma {label}_image : {label} {y} * det ^ {k} = {letter} * {label} {x}.",
                "Proof.",
                f"  transitivity ({' * '.join(scaled_factors)}); [unfold {label}; ring |].",
                f"  {f'rewrite {images}. ' if images else ''}unfold {label}, {letter}. ring.",
                "Qed.",
            ]
        return lines

    def conserved_function(self, claim: ConservedFunction, theorem: str) -> list[str]:
        """State the theorem that a function has the same value at x and x~."""
        x, y, k = self.x, self.y, claim.fraction.degree
        lines = [
            "(* num / den is an integral; cofactor is that of num and den as Darboux polynomials. *)",
            *self.products(claim.fraction, ("num", "cofactor"), ("den", "cofactor")),
            f"Theorem {theorem} :",
            f"  den {x} <> 0 -> den {y} <> 0 ->",
            f"  num {y} / den {y} = num {x} / den {x}.",
            "Proof.",
            "  intros Hx Hy. apply equal_fractions; [assumption | assumption |].",
            f"  apply (Rmult_eq_reg_r (det ^ {k})); [| apply pow_nonzero; exact regular].",
            f"  transitivity (num {y} * det ^ {k} * den {x}); [ring |]. rewrite num_image.",
            f"  transitivity (num {x} * (den {y} * det ^ {k})); [rewrite den_image; ring | ring].",
            "Qed.",
        ]
        return lines

    def darboux_polynomial(self, claim: DarbouxPolynomial, theorem: str) -> list[str]:
        """State the theorem that P(x~) is P(x) times the cofactor."""
        x, y, k = self.x, self.y, claim.product.degree
        return [
            "(* A Darboux polynomial, with its cofactor over a power of det. *)",
            *self.products(claim.product, ("num", "cofactor")),
            f"Theorem {theorem} : num {y} = cofactor / det ^ {k} * num {x}.",
            "Proof.",
            f"  apply (Rmult_eq_reg_r (det ^ {k})); [| apply pow_nonzero; exact regular].",
            "  rewrite num_image. field. exact regular.",
            "Qed.",
        ]

    def derivative(self) -> tuple[list[str], str]:
        """Return the lines that define l11, l12, ..., the entries of L in dPhi = M^-1 L, and the text "l11 l12 ..."."""
        lines = ["(* The derivative of the map is M^-1 L with L the derivative of r - M x~ in x at fixed x~. *)"]
        names = [name for row in entries("l", self.data.dim) for name in row]
        entries_of_L = [entry for row in self.data.derivative for entry in row]
        lines += [
            f"Definition {name} : R := {self.text(entry)}." for name, entry in zip(names, entries_of_L, strict=True)
        ]
        for i, difference in enumerate(self.data.residuals, 1):
            terms = " + ".join(f"m{i}{k + 1} * {y}" for k, y in enumerate(self.ys))
            definitions = " ".join(f"m{i}{k + 1}" for k in range(self.data.dim))
            lines += [
                f"Definition e{i} ({self.x} : R) : R := {self.text(difference)}.",
                f"Lemma residual{i} : e{i} {self.x} = r{i} - ({terms}).",
                f"Proof. cbv delta [e{i} r{i} {definitions}] beta; ring. Qed.",
            ]
            for s in range(self.data.dim):
                lines += self.slope(f"e{i}", difference, s, f"l{i}{s + 1}")
        return lines, " ".join(names)

    def slope(self, function: str, P: fmpq_mpoly, s: int, name: str) -> list[str]:
        """State the lemma P(x + t e_s) = P(x) + t d + t^2 (polynomial); P is called `function`, d is called `name`."""
        names, t_name, x_text = names_of(P), "t_", " ".join(self.xs)
        context = ring((*names, "".join(names) + "_"))  # t may be a variable, so take a name longer than all others
        *letters, t = context.gens()
        P_shifted = P.compose(*letters[:s], letters[s] + t, *letters[s + 1 :], ctx=context)
        P_x, slope = (polynomial.compose(*letters, ctx=context) for polynomial in (P, P.derivative(s)))
        remainder = (P_shifted - P_x - t * slope) / t**2
        remainder_text = polynomial_text(remainder, [*(self.letters[x] for x in names), t_name])
        point = " ".join(f"({x} + {t_name})" if k == s else x for k, x in enumerate(self.xs))
        return [
            f"Lemma derivative_{function}_{s + 1} : forall {t_name}, exists rest,",
            f"  {function} {point} = {function} {x_text} + {t_name} * {name} + {t_name} ^ 2 * rest.",
            f"Proof. intro {t_name}. exists ({remainder_text}). cbv delta [{function} {name}] beta; ring. Qed.",
        ]

    def poisson_tensor(self, claim: InvariantTensor, theorem: str) -> list[str]:
        """State the theorems L T(x) L^T = M T(x~) M^T, entry by entry, and the Jacobi identities."""
        n, k, x, y = claim.dim, claim.degree, self.x, self.y
        lines, L_names = self.derivative()
        lines.append("(* The Poisson tensor T: T_ij = pij / den for i < j, T_ji = -T_ij. *)")
        name_of_pair = {pair: f"p{pair[0] + 1}{pair[1] + 1}" for pair in claim.upper}
        functions = {name: claim.upper[pair] for pair, name in name_of_pair.items()} | {"den": claim.denominator}
        lines += self.functions(x, **functions)
        names = " ".join(functions)

        def entry_text(
            letter: str, i: int, j: int, point: str, entry_format: str = "{}", tensor_format: str = "{}"
        ) -> str:
            """Return entry (i, j) of A (den T) A^T, with A_11 = `letter`11, ... and formats for entries of both."""
            a = [[entry_format.format(f"{letter}{row + 1}{column + 1}") for column in range(n)] for row in (i, j)]
            minors = ((a[0][s], a[1][t], a[0][t], a[1][s], name) for (s, t), name in name_of_pair.items())
            return " + ".join(
                f"({b} * {c} - {d} * {e}) * {tensor_format.format(f'{name} {point}')}" for b, c, d, e, name in minors
            )

        if not claim.is_free:
            for i, row in enumerate(self.data.derivative):
                for j, entry in enumerate(row):
                    label, forms = f"l{i + 1}{j + 1}", [_scaled_row(entry, self, n, at_n) for at_n in (False, True)]
                    lines += [
                        f"Lemma {label}_image : {label} * det = {forms[1]}.",
                        f"Proof. transitivity ({forms[0]}); [unfold {label}; ring | rewrite {self.cramer}; ring]. Qed.",
                    ]
            for name, P in functions.items():
                lines += self.image_lemma(name, P, k)
        for i, j in combinations(range(n), 2):
            left, right = entry_text("l", i, j, x), entry_text("m", i, j, y)
            label = f"{theorem}_{i + 1}{j + 1}"
            lines += [
                f"Theorem {label} : den {x} <> 0 -> den {y} <> 0 ->",
                f"  ({left}) / den {x} =",
                f"  ({right}) / den {y}.",
                "Proof.",
                "  intros Hx Hy. apply equal_fractions; [assumption | assumption |].",
            ]
            if claim.is_free:
                lines += [f"  (* This identity holds for any x and x~. *) {self.expand_tactic(names, L_names)}", "Qed."]
                continue
            scaled_sides = (
                entry_text("l", i, j, x, "({} * det)"),
                entry_text("m", i, j, y, tensor_format=f"({{}} * det ^ {k})"),
            )
            images = [f"?l{row + 1}{column + 1}_image" for row in (i, j) for column in range(n)]
            images += [f"?{name}_image" for name in names.split()]
            lines += [
                f"  apply (Rmult_eq_reg_r (det ^ {k + 2})); [| apply pow_nonzero; exact regular].",
                f"  transitivity (({scaled_sides[0]}) * (den {y} * det ^ {k})); [ring |].",
                f"  transitivity (({scaled_sides[1]}) * den {x} * det ^ 2); [| ring].",
                f"  rewrite {', '.join(images)}. {self.expand_tactic(names)}",
                "Qed.",
            ]
        return [*lines, *self.jacobi(claim, name_of_pair, functions, theorem)] if claim.triples else lines

    def jacobi(
        self, claim: InvariantTensor, names: Mapping[Any, str], functions: Mapping[str, fmpq_mpoly], theorem: str
    ) -> list[str]:
        """State the Jacobi identities for i < j < k: the cyclic sum over T_is d/dx_s T_jk, times den^3, is 0.

        `names` has the name of the numerator of T_ij at (i, j), i < j; `functions` has the numerators and den by name.
        """
        x, lines = self.x, list[str]()
        for name, P in functions.items():
            for s in range(claim.dim):
                lines.append(f"Definition {name}_{s + 1} : R := {self.text(P.derivative(s))}.")
                lines += self.slope(name, P, s, f"{name}_{s + 1}")
        definitions = " ".join([*functions, *(f"{name}_{s + 1}" for name in functions for s in range(claim.dim))])

        def entry(i: int, j: int, ending: str) -> str:
            return f"{'- ' * (i > j)}{names[min(i, j), max(i, j)]}{ending}"

        for i, j, k in claim.triples:
            terms = [
                f"({entry(a, s, f' {x}')}) * (({entry(b, c, f'_{s + 1}')}) * den {x} - "
                f"({entry(b, c, f' {x}')}) * den_{s + 1})"
                for a, b, c in ((i, j, k), (j, k, i), (k, i, j))
                for s in range(claim.dim)
                if s != a
            ]
            lines += [f"Theorem {theorem}_jacobi_{i + 1}{j + 1}{k + 1} :", f"  {' + '.join(terms)} = 0."]
            lines.append(f"Proof. cbv delta [{definitions}] beta; ring. Qed.")
        return lines

    def invariant_volume(self, claim: InvariantVolume, theorem: str) -> list[str]:
        """State the theorem that dx/phi is invariant: phi(x~) det M = phi(x) det L."""
        n, x, y = self.data.dim, self.x, self.y
        lines, L_names = self.derivative()
        lines += [
            f"Definition volume : R := {determinant_text(entries('l', n))}.  (* det L *)",
            "(* dx/phi with phi = num / den is invariant: phi(x~) = phi(x) det(M^-1 L). *)",
        ]
        statement = [
            f"Theorem {theorem} :",
            f"  den {x} <> 0 -> den {y} <> 0 ->",
            f"  num {y} / den {y} = num {x} / den {x} * (volume / det).",
            "Proof.",
            "  intros Hx Hy.",
            f"  replace (num {x} / den {x} * (volume / det)) with (num {x} * volume / (den {x} * det))",
            "    by (field; split; [exact regular | assumption]).",
            "  apply equal_fractions; [assumption | apply Rmult_integral_contrapositive_currified; [assumption |"
            " exact regular] |].",
        ]
        if claim.fraction is None:
            proof = self.expand_tactic(f"num den volume {L_names}")
            lines += self.functions(x, num=claim.numerator, den=claim.denominator)
            return [*lines, *statement, f"  (* This identity holds for any x and x~. *) {proof}", "Qed."]
        lines += self.products(claim.fraction, ("num", "cofactor_num"), ("den", "cofactor_den"))
        # Each row of L has degree 1 in x~, so det^n det L is a determinant whose rows contain det and det x~.
        scaled_rows = [[f"({_scaled_row(entry, self, n)})" for entry in row] for row in self.data.derivative]
        common_text, left, right = map(_monomial_text, claim.balance)
        factor_names, k = [f"c{j}" for j in range(1, len(claim.fraction.common_factors) + 1)], claim.fraction.degree
        return [
            *lines,
            f"Lemma volume_scaled : volume * det ^ {n} = {determinant_text(scaled_rows)}.",
            f"Proof. cbv delta [volume {L_names}] beta; ring. Qed.",
            f"Lemma shorter : {left} = {right} * (volume * det ^ {n}).",
            f"Proof. rewrite volume_scaled, {self.cramer}. {self.expand_tactic(*factor_names)} Qed.",
            f"Lemma balance : cofactor_num * (det * det ^ {n}) = cofactor_den * (volume * det ^ {n}).",
            "Proof.",
            f"  transitivity ({common_text} * ({left})); [unfold cofactor_num; ring |].",
            f"  transitivity ({common_text} * ({right} * (volume * det ^ {n})));",
            "    [apply Rmult_eq_compat_l; exact shorter |].",
            "  unfold cofactor_den. ring.",
            "Qed.",
            *statement,
            f"  apply (Rmult_eq_reg_r (det ^ {k + n})); [| apply pow_nonzero; exact regular].",
            f"  transitivity (num {y} * det ^ {k} * (den {x} * det * det ^ {n})); [ring |].",
            f"  transitivity (num {x} * (volume * det ^ {n}) * (den {y} * det ^ {k})); [| ring].",
            "  rewrite num_image, den_image.",
            f"  transitivity (num {x} * den {x} * (cofactor_num * (det * det ^ {n}))); [ring |].",
            "  rewrite balance. ring.",
            "Qed.",
        ]


def rocq_certificate(claims: Sequence[MapClaim], header: Sequence[str] = ()) -> str:
    """Write a script that Coq accepts only if it proves the claims.

    Args:
        claims: the statements to be proved, each in a section of its own.
        header: the lines of the initial comment.
    """
    # A header line must not end the comment, or begin a comment or a string. Commands quote ' as '"'"', which is
    # written here without the quotation marks.
    unquoted_lines = (line.replace("'\"'\"'", "'\\''").replace('"', "'") for line in header)
    safe_lines = (line.replace("(*", "( *").replace("*)", "* )") for line in unquoted_lines)
    lines = ["(*", *(f"   {line}" for line in safe_lines), "   Check: coqc FILE", "*)"]
    lines += ["Require Import Reals.", "Open Scope R_scope.", "", _LEMMA]
    lines += [LIBRARY] if any(isinstance(claim, PositiveEntropy) for claim in claims) else []
    groups: dict[tuple[int, ...], list[MapClaim]] = {}  # grouped by map: its equation and Cramer's rule are stated once
    for k, claim in enumerate(claims, 1):
        chain_number = k if isinstance(claim, Chain) else 0
        groups.setdefault((id(claim.data), isinstance(claim, EquationClaim), chain_number), []).append(claim)
    theorems = list[str]()
    for m, group in enumerate(groups.values(), 1):
        script = _Script(group[0].data)
        lines += [f"Module Map{m}.", "Section Map."]
        if isinstance(group[0], EquationClaim):
            lines += script.constants
        else:
            lines += [*script.map_equation(any(claim.is_at_image for claim in group)), ""]
        statement_of: dict[str, str] = {}
        for k, claim in enumerate(group, 1):
            prove, ending = _PROOF_METHODS[type(claim)]
            name = re.sub(r"[^A-Za-z0-9_]", "_", claim.name)
            theorem = f"{name if re.match('[A-Za-z]', name) else f'v_{name}'}_{ending}"
            proof = _new_statements(prove(script, claim, theorem), statement_of, f"_claim_{k}")
            theorems += [f"Map{m}.{line.split()[1]}" for line in proof if line.startswith("Theorem ")]
            lines += [*proof, ""]
        lines += ["End Map.", f"End Map{m}.", ""]
    lines += [f"Definition theorems := ({', '.join(theorems)}).", "Print Assumptions theorems."]
    return "\n".join(lines) + "\n"


_PROOF_METHODS: dict[type[MapClaim], tuple[Any, str]] = {
    ConservedFunction: (_Script.conserved_function, "conserved"),
    DarbouxPolynomial: (_Script.darboux_polynomial, "darboux"),
    InvariantVolume: (_Script.invariant_volume, "invariant"),
    InvariantTensor: (_Script.poisson_tensor, "poisson"),
    OrbitIntegral: (_Script.orbit_integral, "conserved"),
    AffineSymmetry: (_Script.affine_symmetry, "symmetry"),
    Chain: (_Script.chain, "everywhere"),
    ChangedFunction: (_Script.coordinate_change, "coordinates"),
    PositiveEntropy: (lambda *arguments: [*entropy_proof(*arguments)], "exponential"),
}


def _new_statements(lines: Sequence[str], statement_of: dict[str, str], ending: str) -> list[str]:
    """Return the statements not yet in `statement_of`; a name that another statement has gets `ending` appended.

    A statement uses earlier statements only, so that a changed name is known before it is used.
    """
    statements, new_names = list[str](), dict[str, str]()
    for line in lines:
        if re.match(r"\(\*|(Definition|Lemma|Theorem|Variables|Hypothesis) ", line) and not (
            statements and statements[-1].startswith("(*") and "\n" not in statements[-1]
        ):
            statements.append(line)
        else:
            statements[-1] += f"\n{line}"
    result = list[str]()
    for statement in statements:
        for old_name, new_name in new_names.items():
            statement = re.sub(rf"\b{old_name}\b", new_name, statement)
        name = re.sub(r"^\(\*.*\*\)\n", "", statement).split()[1]
        if statement_of.get(name) == statement:
            continue
        if name in statement_of:
            new_names[name] = name + ending
            name, statement = name + ending, re.sub(rf"\b{name}\b", name + ending, statement)
        statement_of[name] = statement
        result += statement.split("\n")
    return result


def _monomial_text(monomial: Monomial) -> str:
    return monomial.text("det", " * ", " ^ ")


def _power_text(exponent: int) -> str:
    return "" if exponent == 1 else f" ^ {exponent}"


def entries(letter: str, n: int) -> list[list[str]]:
    """Return the names of the entries of an n x n matrix, such as a11, a12, ..."""
    return [[f"{letter}{i + 1}{j + 1}" for j in range(n)] for i in range(n)]


def powers_text(letters: Iterable[str], exponents: Iterable[Any], power: str = " ^ ") -> list[str]:
    """Return the text of the powers of the letters with nonzero exponents."""
    return [name if k == 1 else f"{name}{power}{k}" for name, k in zip(letters, exponents, strict=True) if k]


def polynomial_text(polynomial: fmpq_mpoly, letters: Sequence[str], times: str = " * ", power: str = " ^ ") -> str:
    """Return the text of a polynomial with integer coefficients in `letters`, as a sum of products."""
    terms: list[str] = []
    for exponents, coefficient in polynomial.terms():
        factors = powers_text(letters, exponents, power)
        absolute = abs(coefficient)
        product = times.join(([str(absolute)] if absolute != 1 or not factors else []) + factors)
        sign = ("- " if coefficient < 0 else "") if not terms else (" - " if coefficient < 0 else " + ")
        terms.append(sign + product)
    return "".join(terms) or "0"


def determinant_text(entries: Sequence[Sequence[str]]) -> str:
    """Return the determinant of a matrix of texts, expanded along the first row."""
    if len(entries) == 1:
        return entries[0][0]
    products: list[str] = []
    for j, entry in enumerate(entries[0]):
        minor = [[*row[:j], *row[j + 1 :]] for row in entries[1:]]
        minor_text = determinant_text(minor)
        product = f"{entry} * {minor_text if len(minor) == 1 else f'({minor_text})'}"
        products.append(product if j == 0 else f"{' - ' if j % 2 else ' + '}{product}")
    return "".join(products)


def _homogeneous_text(
    polynomial: fmpq_mpoly, letters: Sequence[str], degree: int, image: slice, det: str = "det ^ {}"
) -> str:
    """Return the text of det^degree P with (det x~)/det put for x~; `letters` has det x~, or N, in the slice `image`.

    Terms with the same powers of x~ are collected, so that `ring` computes each product of powers of N once.
    """
    terms: dict[tuple[int, ...], dict[tuple[int, ...], fmpq]] = {}
    for exponents, coefficient in polynomial.terms():
        powers, other_exponents = tuple(map(int, exponents[image])), list(exponents)
        other_exponents[image] = [0] * len(powers)
        terms.setdefault(powers, {})[tuple(other_exponents)] = coefficient
    products = []
    for powers, coefficients in terms.items():
        det_exponent = degree - sum(powers)
        factors = [*powers_text(letters[image], powers), *([det.format(det_exponent)] if det_exponent else [])]
        coefficient_text = polynomial_text(polynomial.context().from_dict(coefficients), letters)
        products.append(" * ".join([f"({coefficient_text})", *factors]))
    return " + ".join(products) or "0"


def _scaled_row(entry: fmpq_mpoly, script: _Script, dim: int, at_n: bool = False) -> str:
    """Return the text of det times an entry of L, of degree at most 1 in x~; det x~ is written as N if `at_n`."""
    letters, image = [script.letters[name] for name in names_of(entry)], slice(dim, 2 * dim)
    letters[image] = script.image_letters(at_n)
    return _homogeneous_text(entry, letters, 1, image, "det")
