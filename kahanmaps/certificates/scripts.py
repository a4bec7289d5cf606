"""Certificates for PARI/GP and for SymPy: each identity is expanded, and `true` is printed if it holds.

The map is given by M(x) x~ = r(x). The script states M and r and, if needed, N and D with M N = D r, so that x~ = N/D
if det M is not 0. For instance, P(x~) = P C/D^k for a polynomial P of degree k means that the polynomials D^k P(N/D)
and C P are equal; the script computes both. The script ends with status 1 if an identity does not hold. Both languages
get functions with the same names, so that the text of the checks differs only in the notation of powers.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import singledispatchmethod

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import names_of
from kahanmaps.certificates.chains import Chain
from kahanmaps.certificates.combinations import AffineSymmetry, ChangedFunction, OrbitIntegral
from kahanmaps.certificates.darboux import (
    ConservedFunction,
    DarbouxPolynomial,
    DarbouxProducts,
    InvariantVolume,
)
from kahanmaps.certificates.entropy import EPS, LINE, PRIME, PositiveEntropy, homogenizing
from kahanmaps.certificates.identities import (
    InvariantTensor,
    MapClaim,
    MapData,
    letters_of,
)
from kahanmaps.certificates.rocq import polynomial_text

_PARI = """\
default(recover, 0);  \\\\ an error ends gp with a status that is not 0
default(parisizemax, 2*10^9);
ok = 1;
check(text, holds) = { print(text, ": ", if(holds, "true", "FALSE")); if(!holds, ok = 0); }
"""
_PARI_TOOLS = {
    "put": "put(A, letters, values) = substvec(A, letters, values);",
    "at": "at(A, letters, P, Q) = substvec(A, letters, vector(#P, i, P[i]/Q[i]));  \\\\ at the point P/Q",
    "det": "det(A) = matdet(A);",
    "product": "product(v) = vecprod(v);",
    "mul": "mul(A, B) = A*B;",
    "transposed": "transposed(A) = A~;",
    "scale": "scale(c, A) = c*A;",
    "act": "act(A, v) = (A*v~)~;",
    "dot": "dot(v, w) = v*w~;",  # no definition of concat follows: it is a function of PARI
    "derivative": "derivative(v, letters) = matrix(#v, #letters, i, j, deriv(v[i], letters[j]));",
    "bracket": """\
bracket(P, Q, i, j, k) = {  \\\\ Q^3 times the sum of T_is d/dx_s T_jk over s, T = P/Q
  sum(s = 1, n, P[i+1,s]*(deriv(P[j+1,k+1], old[s])*Q - P[j+1,k+1]*deriv(Q, old[s])));
}""",
    "image": """\
image(G, k, letters) = {  \\\\ D^k G, with N/D for the letters, in which G has a degree of at most k
  my(H = substvec(G, letters, tt*letters));
  if(poldegree(H, tt) > k, error("degree"));
  sum(j = 0, k, D^(k-j)*substvec(polcoef(H, j, tt), letters, N));
}""",
    "monomial": "monomial(v, e) = prod(i = 1, #e, v[i]^e[i]);",
    "total": "total(v, e) = sum(i = 1, #e, v[i]*e[i]);",
    "images": "images(A, k, letters) = matrix(#A, #A, i, j, image(A[i,j], k, letters));",
    "line_degree": """\
line_degree(F, steps, p, residue, start, slope) = {  \\\\ of the image of start + t*slope modulo p, at eps = residue
  my(G = put(F, [eps], [Mod(residue, p)]), curve = (start + t*slope)*Mod(1, p), common);
  for(k = 1, steps, curve = put(G, point, curve); common = gcd(gcd(curve[1], curve[2]), curve[3]);
    curve = apply(P -> P \\ common, curve));  \\\\ an error if all three are 0
  vecmax(apply(P -> poldegree(P, t), curve));
}""",
}
_PYTHON = """\
import sys
from itertools import permutations
from math import prod

from sympy import GF, QQ, isprime
from sympy.polys.rings import ring

R, {letters} = ring("{names}", QQ)
one = R.one  # makes a polynomial of a number
results = []


def check(text, holds):
    results.append(holds)
    print(f"{{text}}: {{'true' if holds else 'FALSE'}}")
"""
_PYTHON_TOOLS = {
    "at": """\
def at(A, letters, P, Q):  # A at the point P/Q, times powers of the denominators
    if isinstance(A, list):
        return [at(a, letters, P, Q) for a in A]
    assert all(q != 0 for q in Q)
    places, distinct, total = [R.gens.index(letter) for letter in letters], list(set(Q)), R.zero
    degrees = {e: [sum(e[p] for p, q in zip(places, Q) if q == d) for d in distinct] for e, _ in A.terms()}
    largest = [max(column) for column in zip(*degrees.values())]
    for e, coefficient in A.terms():
        rest = tuple(0 if p in places else k for p, k in enumerate(e))
        factors = [value ** e[p] for p, value in zip(places, P)]
        factors += [d ** (a - b) for d, a, b in zip(distinct, largest, degrees[e])]
        total += prod(factors, start=R({rest: coefficient}))
    return total""",
    "put": """\
def put(A, letters, values):
    return [put(a, letters, values) for a in A] if isinstance(A, list) else A.compose(list(zip(letters, values)))""",
    "product": """\
def product(v):
    return prod(v, start=R.one)""",
    "det": """\
def det(A):
    n, total = len(A), R.zero
    for p in permutations(range(n)):
        sign = (-1) ** sum(p[i] > p[j] for i in range(n) for j in range(i + 1, n))
        total += prod((A[i][p[i]] for i in range(n)), start=R(sign))
    return total""",
    "mul": """\
def mul(A, B):
    return [[sum((a * b for a, b in zip(row, column)), R.zero) for column in zip(*B)] for row in A]""",
    "transposed": """\
def transposed(A):
    return [list(row) for row in zip(*A)]""",
    "scale": """\
def scale(c, A):
    return [scale(c, a) for a in A] if isinstance(A, list) else c * A""",
    "act": """\
def act(A, v):
    return [dot(row, v) for row in A]""",
    "concat": """\
def concat(v, w):
    return v + w""",
    "dot": """\
def dot(v, w):
    return sum((a * b for a, b in zip(v, w)), R.zero)""",
    "derivative": """\
def derivative(v, letters):
    return [[a.diff(letter) for letter in letters] for a in v]""",
    "bracket": """\
def bracket(P, Q, i, j, k):  # Q^3 times the sum of T_is d/dx_s T_jk over s, T = P/Q
    return sum((P[i][s] * (P[j][k].diff(old[s]) * Q - P[j][k] * Q.diff(old[s])) for s in range(n)), R.zero)""",
    "image": """\
def image(G, k, letters):  # D^k G, with N/D for the letters, in which G has a degree of at most k
    places = [R.gens.index(letter) for letter in letters]
    total = R.zero
    for exponents, coefficient in G.terms():
        rest = [0 if p in places else e for p, e in enumerate(exponents)]
        powers = [exponents[p] for p in places]  # a negative power of D is an error
        factors = [value**e for value, e in zip((*N, D), (*powers, k - sum(powers)))]
        total += prod(factors, start=R({tuple(rest): coefficient}))
    return total""",
    "monomial": """\
def monomial(v, e):
    return prod((a**k for a, k in zip(v, e)), start=R.one)""",
    "total": """\
def total(v, e):
    return sum(a * k for a, k in zip(v, e))""",
    "images": """\
def images(A, k, letters):
    return [[image(a, k, letters) for a in row] for row in A]""",
    "line_degree": """\
def line_degree(F, steps, p, residue, start, slope):  # of the image of start + t*slope modulo p, at eps = residue
    field, places = GF(p), [R.gens.index(letter) for letter in (*point, eps)]
    t = ring("t", field)[1]
    curve = [a + b * t for a, b in zip(start, slope)]
    for _ in range(steps):
        values = []
        for G in F:
            total = 0 * t
            for exponents, coefficient in G.terms():
                *powers, k = (exponents[place] for place in places)
                scalar = field(int(coefficient)) * field(residue) ** k
                total += prod((X**e for X, e in zip(curve, powers)), start=t**0) * scalar
            values.append(total)
        common = values[0].gcd(values[1]).gcd(values[2])
        curve = [X.exquo(common) for X in values]  # an error if all three are 0
    return max(X.degree() for X in curve)""",
}
_STATEMENTS: dict[type[MapClaim], str] = {
    ConservedFunction: "P/Q is an integral",
    DarbouxPolynomial: "P is a Darboux polynomial, P(x~) = P C/D^k",
    InvariantVolume: "dx/phi is invariant, phi = P/Q",
    InvariantTensor: "the map is Poisson for the tensor P/Q",
    PositiveEntropy: "positive entropy, hence no rational integral, for all but finitely many eps",
    Chain: "points are images of others",
    ChangedFunction: "P/Q at x = T z is p/q",
    OrbitIntegral: "P(x, x~)/Q is an integral",
    AffineSymmetry: "x -> T takes the map to itself, its inverse or another map",
}
_REQUIRED_TOOLS = {"act": ("dot",), "images": ("image",)}


@dataclass(frozen=True)
class Language:
    """The syntax of a program for powers, definitions, vectors, matrices and comments, and its functions for checks."""

    start: str  # the first lines of a script
    tools: dict[str, str]  # definitions of functions; a script contains those that it uses
    end: str  # the last line, which sets the exit status
    run: str  # the command that runs a script
    power: str
    comment: str
    definition: str
    vector: str
    matrix: str
    next_row: str  # between two rows of a matrix
    residual: str  # M x~ - r, for the point x~ = new


GP = Language(
    _PARI, _PARI_TOOLS, "quit(!ok)", "gp -q FILE", "^", r"\\ ", "{} = {};", "[{}]", "[{}]", "; ", "(M{0}*new~ - r{0}~)~"
)  # fmt: skip
PYTHON = Language(
    _PYTHON, _PYTHON_TOOLS, "sys.exit(not all(results))", "python FILE (needs SymPy)", "**", "# ", "{} = {}",
    "[one*a for a in [{}]]", "[[one*a for a in row] for row in [[{}]]]", "], [",
    "[sum(a*b for a, b in zip(row, new)) - c for row, c in zip(M{0}, r{0})]",
)  # fmt: skip


class _Script:
    """The lines of a script about one map; `define` and `check` append to them."""

    def __init__(self, language: Language, data: MapData) -> None:
        self.language, self.data, self.lines = language, data, list[str]()
        self.has_points = self.has_equation = self.is_solved = False
        self.letters = letters_of(data, r"[hijknpqrst]|c\d+") | {homogenizing(data.names): "h"}

    def text(self, polynomial: fmpq_mpoly) -> str:
        """Return the text of a polynomial; a long sum is split, since Python cannot parse very deep expressions."""
        letters = [self.letters[name] for name in names_of(polynomial)]
        text = polynomial_text(polynomial, letters, "*", self.language.power)
        terms = re.split(r" (?=[+-] )", text)
        partial_sums = [" ".join(terms[k : k + 50]) for k in range(0, len(terms), 50)]
        return text if self.language is GP or len(partial_sums) == 1 else f"sum([{', '.join(partial_sums)}])"

    def vector(self, entries: Sequence[fmpq_mpoly]) -> str:
        """Return the text of a vector of polynomials."""
        return self.language.vector.format(", ".join(map(self.text, entries)))

    def matrix(self, rows: Sequence[Sequence[str]]) -> str:
        """Return the text of a matrix whose entries are texts."""
        if len(rows) == 1 and self.language is GP:  # in GP, [a] would be a vector
            return f"Mat({rows[0][0]})"
        return self.language.matrix.format(self.language.next_row.join(", ".join(row) for row in rows))

    def polynomials(self, rows: Sequence[Sequence[fmpq_mpoly]]) -> str:
        """Return the text of a matrix of polynomials."""
        return self.matrix([[self.text(entry) for entry in row] for row in rows])

    def define(self, name: str, text: str) -> None:
        """Append a definition; `text` is a polynomial or any other expression."""
        self.lines.append(self.language.definition.format(name, text))

    def polynomial(self, name: str, polynomial: fmpq_mpoly) -> None:
        """Append the definition of a polynomial."""
        self.define(name, f"({self.text(polynomial)})" + " * one" * (self.language is PYTHON))

    def check(self, label: str, identity: str) -> None:
        """Append a check of an identity, a text in which ^ means a power in every language."""
        identity = identity.replace("^", self.language.power)
        identity = identity.replace("&&", "and") if self.language is PYTHON else identity
        self.lines.append(f'check("{label}", {identity})' + ";" * (self.language is GP))

    def begin(self, claim: MapClaim, count: int) -> None:
        """Append the map of the claim (unless the previous claim has the same map) and the names of `count` points."""
        if claim.data is not self.data or not self.has_points:
            self.data, self.has_points, self.has_equation, self.is_solved = claim.data, True, False, False
            self.points(count)
        if not self.has_equation and not isinstance(claim, Chain | ChangedFunction):
            self.has_equation = True
            self.equation(self.data)
        if not self.is_solved and claim.is_at_image:
            self.is_solved = True
            self.solution()
        self.lines.append("")

    def points(self, count: int) -> None:
        """Append the names for x, x~ and, if `count` is 3, the image of x~."""
        self.define("n", str(self.data.dim))
        points = {"old": self.data.variables, "new": self.data.new, "third": [f"{name}2" for name in self.data.new]}
        for name, letters in [*points.items()][:count]:
            self.define(name, f"[{', '.join(self.letters[letter] for letter in letters)}]")

    def equation(self, data: MapData, letter: str = "") -> None:
        """Define M, r and E = M x~ - r, with `letter` appended to their names."""
        self.define(f"M{letter}", self.polynomials([row[:-1] for row in data.rows]))
        self.define(f"r{letter}", self.vector([row[-1] for row in data.rows]))
        self.define(f"E{letter}", self.language.residual.format(letter))
        self.lines[-1] += f"  {self.language.comment}0 where new is the image of old"

    def solution(self) -> None:
        """Append the definitions of N and D, and the checks that D is not 0 and M N = D r."""
        self.define("N", self.vector(self.data.numerators))
        self.polynomial("D", self.data.determinant)
        self.check("D is not 0", "D != 0")
        self.check("M N = D r", "act(M, N) == scale(D, r)")

    def claim(self, claim: MapClaim) -> None:
        """Append the statement of a claim, and its proof."""
        label = re.sub(r"[^\w ~^*/+(),>-]", "_", claim.name)
        self.lines.append(f"{self.language.comment}{label}: {_STATEMENTS[type(claim)]}")
        self.prove(claim, label)
        self.lines.append("")

    @singledispatchmethod
    def prove(self, claim: MapClaim, label: str) -> None:
        """Append the definitions and checks of a claim."""
        raise NotImplementedError(type(claim))

    @prove.register
    def chain(self, claim: Chain, label: str) -> None:
        names = list[tuple[str, str]]()
        for letter, data in claim.maps.items():
            self.equation(data, letter)
        for v, value in enumerate(claim.values):
            names.append((f"P{v}", f"Q{v}"))
            self.define(f"P{v}", self.vector(value.numerators))
            self.define(f"Q{v}", self.vector([value.denominators[k] for k in value.denominator_indices]))
        self.define("zero", self.vector([self.data.rows[0][0] * 0] * self.data.dim))
        for k, (letter, source, v) in enumerate(claim.arrows, 1):
            (P, Q), (P_image, Q_image) = names[claim.value_of(source)], names[v]
            points = f"concat({P}, {P_image}), concat({Q}, {Q_image})"
            statement = f"point {k}, {P_image}/{Q_image}, is the image of point {source} under {letter}"
            self.check(statement, f"at(E{letter}, concat(old, new), {points}) == zero")
            statement = f"det M is not 0 at point {source}"
            eps = self.letters[self.data.names[-1]]
            determinant = claim.maps[letter].determinant
            if determinant.subs({"eps": 0}).is_constant():  # det M of a Kahan map is 1 at eps = 0, at every point
                self.check(f"{statement}, as eps -> 0", f"put(det(M{letter}), [{eps}], [0*{eps}]) != 0")
                self.check(f"point {source} is defined as eps -> 0", f"put(product({Q}), [{eps}], [0*{eps}]) != 0")
            else:
                self.check(statement, f"at(det(M{letter}), old, {P}, {Q}) != 0")
        i, j = claim.equal_points
        common_value = f"P{claim.value_of(i)}/Q{claim.value_of(j)}"
        self.lines.append(f"{self.language.comment}So points {i} and {j} are equal: both are {common_value}.")

    @prove.register
    def conserved(self, claim: ConservedFunction, label: str) -> None:
        k = claim.fraction.degree
        left, right = self.products(claim.fraction, label, "PQ", [k, k])
        self.check(f"{label}: Q is not 0", "Q != 0")
        statement = f"{label}: D^{k} P(N/D) = C P and D^{k} Q(N/D) = C Q with the same C, not 0"
        self.check(statement, f"{left} == {right} && {left} != 0")

    @prove.register
    def darboux(self, claim: DarbouxPolynomial, label: str) -> None:
        self.products(claim.product, label, "P", [0])

    def products(self, fraction: DarbouxProducts, label: str, names: str, powers: Sequence[int]) -> list[str]:
        """Append each product P with the identities of its factors; return the texts of D^k P(N/D)/P, k in `powers`.

        The script contains the exponents of a product only once, so that all checks use the same exponents.
        """
        for j, common_factor in enumerate(fraction.common_factors, 1):
            self.polynomial(f"c{j}", common_factor)
        cofactors = []
        for name, product, power in zip(names, fraction.products, powers, strict=True):
            factor_names = [name if product.is_single else f"{name}{i}" for i in range(1, len(product.factors) + 1)]
            for factor_name, factor in zip(factor_names, product.factors, strict=True):
                monomial = factor.cofactor.text("D")
                self.polynomial(factor_name, factor.polynomial)
                statement = f"{label}: D^{factor.degree} {factor_name}(N/D) = {monomial} {factor_name}"
                self.check(statement, f"image({factor_name}, {factor.degree}, old) == {monomial}*{factor_name}")
            content_text = f"({self.text(product.content)})" + " * one" * (self.language is PYTHON)
            if product.is_single or not factor_names:
                monomial = product.cofactor(power, len(fraction.common_factors)).text("D")
                if factor_names and power >= product.degree:
                    monomial = f"D^{power - product.degree}*{product.factors[0].cofactor.text('D')}"
                if not factor_names:
                    self.define(name, content_text)
            else:
                self.define(f"e{name}", f"[{', '.join(str(factor.exponent) for factor in product.factors)}]")
                content_text = "" if product.content.is_one() else f"{content_text}*"
                self.define(name, f"{content_text}monomial([{', '.join(factor_names)}], e{name})")
                D_exponents = [factor.cofactor.powers[0] - factor.degree for factor in product.factors]
                other_monomials = ", ".join(factor.cofactor.text("") for factor in product.factors)
                monomial = f"D^({power} + total({D_exponents}, e{name}))*monomial([{other_monomials}], e{name})"
            cofactors.append(monomial)
        return cofactors

    def derivative(self, label: str) -> None:
        """Append L, the derivative of r - M x~ in x at fixed x~; the derivative of the map is M^-1 L."""
        self.define("L", self.polynomials(self.data.derivative))
        self.check(f"{label}: L is the derivative of r - M x~ in x", "derivative(scale(-1, E), old) == L")

    @prove.register
    def volume(self, claim: InvariantVolume, label: str) -> None:
        statement = f"{label}: phi(x~) det M = phi(x) det L(x, x~)"
        if claim.fraction is None:
            self.fraction(claim)
            self.check("P is not 0", "P != 0")
            self.derivative(label)
            identity = "put(P, old, new)*Q*det(M) == P*put(Q, old, new)*det(L)"
            self.check(f"{statement} for any x and x~", identity)
            return
        k, common_power = claim.fraction.degree, claim.balance[0].powers[0]
        left, right = self.products(
            claim.fraction, label, "PQ", [k + self.data.dim + 1 - common_power, k - common_power]
        )
        self.check("P and Q are not 0", "P != 0 && Q != 0")
        self.derivative(label)
        self.check("D = det M", "D == det(M)")
        self.check(f"{statement} at x~ = N/D", f"{left} == {right}*det(images(L, 1, new))")

    @prove.register
    def tensor(self, claim: InvariantTensor, label: str) -> None:
        n, k = claim.dim, claim.degree
        self.define("P", self.polynomials([[claim.entry(i, j) for j in range(n)] for i in range(n)]))
        self.polynomial("Q", claim.denominator)
        self.check(f"{label}: P is skew", "transposed(P) == scale(-1, P)")
        self.derivative(label)
        statement = f"{label}: L(x, x~) T(x) L^T = M T(x~) M^T"
        left_form, right_form = "mul(mul({}, P), transposed({}))", "mul(mul(M, {}), transposed(M))"
        if claim.is_free:
            left, right = left_form.format("L", "L"), right_form.format("put(P, old, new)")
            self.check(f"{statement} for any x and x~", f"scale(put(Q, old, new), {left}) == scale(Q, {right})")
        else:
            self.define("S", "images(L, 1, new)")
            left, right = left_form.format("S", "S"), right_form.format(f"images(P, {k}, old)")
            self.check(f"{statement} at x~ = N/D", f"scale(image(Q, {k}, old), {left}) == scale(Q*D^2, {right})")
        for i, j, l in claim.triples:
            terms = (f"bracket(P, Q, {i}, {j}, {l})", f"bracket(P, Q, {j}, {l}, {i})", f"bracket(P, Q, {l}, {i}, {j})")
            self.check(f"{label}: Jacobi identity {i + 1}, {j + 1}, {l + 1}", " + ".join(terms) + " == 0")

    @prove.register
    def along_orbit(self, claim: OrbitIntegral, label: str) -> None:
        self.fraction(claim)
        self.define("first", self.vector(claim.first))
        self.define("second", self.vector(claim.second))
        next_value = "put({}, concat(old, new), concat(new, third))"
        identity = f"{next_value.format('P')} - P == dot(first, E) + dot(second, {next_value.format('E')})"
        self.check(f"{label}: P(y, z) - P(x, y) = first . E(x, y) + second . E(y, z)", identity)

    @prove.register
    def changed(self, claim: ChangedFunction, label: str) -> None:
        self._affine(claim)
        for name, polynomial in zip(("P", "Q", "p", "q"), (*claim.old_function, *claim.new_function), strict=True):
            self.polynomial(name, polynomial)
        self.check(f"{label}: P(T z) q(z) = p(z) Q(T z)", "put(P, old, T)*q == p*put(Q, old, T)")

    def _affine(self, claim: AffineSymmetry | ChangedFunction) -> None:
        self.define("T", f"scale({self.number(Fraction(1, claim.divisor))}, {self.vector(claim.image)})")

    @prove.register
    def symmetry(self, claim: AffineSymmetry, label: str) -> None:
        self._affine(claim)
        self.check(f"{label}: T is invertible", "det(derivative(T, old)) != 0")
        self.define("Y", "put(T, old, new)")
        self.define("K", self.matrix([[str(entry) for entry in row] for row in claim.matrix]))
        target = "E" if claim.target is self.data else "Et"
        if target == "Et":
            self.equation(claim.target, "t")
        pair, points = ("Y, T", "(T y, T x)") if claim.reversing else ("T, Y", "(T x, T y)")
        identity = f"scale({claim.multiple}, put({target}, concat(old, new), concat({pair}))) == act(K, E)"
        self.check(f"{label}: {target}{points} is a combination of E(x, y)", identity)

    @prove.register
    def entropy(self, claim: PositiveEntropy, label: str) -> None:
        """Append the forms F_1, ..., F_n, the image of a line modulo a prime, and the inequality."""
        comment = self.language.comment
        n, x, y = len(claim.forms), *(self.letters[name] for name in self.data.variables)
        self.lines += [
            f"{comment}Assumed, a theorem on birational maps f of the plane (docs/mathematics.md): with D_n = deg f^n",
            f"{comment}and the dynamical degree lambda, 2 cosh(n log lambda) + 2 >= (D_2n - 1)/(D_n - 1).",
            f"{comment}Here f over Q(eps) is birational, D_{n} <= {claim.degree} and D_{2 * n} >= {claim.line_degree}.",
        ]
        self.define("point", f"[{x}, {y}, h]")
        self.define("B", self.vector(claim.inverse))
        for k, (forms, factor) in enumerate(zip(claim.forms, claim.factors, strict=True), 1):
            self.define(f"F{k}", self.vector(forms))
            self.polynomial(f"c{k}", factor)
            degree = max(sum(e) - sum(e[2:-1]) for e in (list(map(int, m)) for m in forms[0].monoms()))
            identity = f"put(F{k}, point, scale(h, point)) == scale(h^{degree}, F{k})"
            self.check(f"F{k} is homogeneous of degree {degree}", identity)
            if k == 1:
                statement = "c1 F1 = (N : D) at h = 1, not 0"
                identity = "put(scale(c1, F1), [h], [h^0]) == concat(N, [D])"
            else:
                statement = f"F1(F{k - 1}) = c{k} F{k}, not 0"
                identity = f"put(F1, point, F{k - 1}) == scale(c{k}, F{k})"
            self.check(statement, f"c{k} != 0 && {identity}")
        self.define("G", "put(B, point, F1)")
        G_3 = "G[3]" if self.language is GP else "G[2]"
        self.check("f is birational: B(F1) = point", f"{G_3} != 0 && scale(h, G) == scale({G_3}, point)")
        self.check("the modulus is prime", f"isprime({PRIME})")
        start, slope = ([a for a, _ in LINE], [b for _, b in LINE])
        statement = f"the image of a line under {2 * n} steps modulo a prime has degree {claim.line_degree}"
        line_degree = f"line_degree(F1, {2 * n}, {PRIME}, {EPS}, {start}, {slope})"
        self.check(statement, f"{line_degree} == {claim.line_degree}")
        self.define("low", self.number(claim.lower))
        bound = self.number(Fraction(claim.line_degree - 1, claim.degree - 1))
        statement = f"the dynamical degree is more than {claim.lower} > 1"
        self.check(statement, f"low > 1 && low^{n} + 1/low^{n} + 2 < {bound}")

    def number(self, value: Fraction) -> str:
        """Return the text of a rational number."""
        text = f"{value.numerator}, {value.denominator}"
        return text.replace(", ", "/") if self.language is GP else f"QQ({text})"

    def fraction(self, claim: InvariantVolume | OrbitIntegral) -> None:
        """Append the definitions of the numerator P and the denominator Q of a claim."""
        self.polynomial("P", claim.numerator)
        self.polynomial("Q", claim.denominator)
        self.check("Q is not 0", "Q != 0")


def script_certificate(language: Language, claims: Sequence[MapClaim], header: Sequence[str] = ()) -> str:
    """Write a script that expands the identities of the claims and compares their two sides.

    Args:
        language: GP, for `gp -q FILE`, or PYTHON, for SymPy.
        claims: the statements to be checked.
        header: the lines of the comment at the beginning.
    """
    largest_map = max((claim.data for claim in claims), key=lambda data: data.dim)
    script = _Script(language, largest_map)
    has_three_points = any(isinstance(claim, OrbitIntegral) for claim in claims)
    for claim in claims:
        script.begin(claim, 2 + has_three_points)
        script.claim(claim)
    used_names = set(re.findall(r"\w+", "\n".join(script.lines)))
    used_names |= {tool for name in used_names for tool in _REQUIRED_TOOLS.get(name, ())}
    has_entropy = any(isinstance(claim, PositiveEntropy) for claim in claims)
    unused_letters = set() if has_entropy else {homogenizing(largest_map.names)}
    unused_letters |= set() if has_three_points else {f"{name}2" for name in largest_map.new}
    names = [letter for name, letter in script.letters.items() if name not in unused_letters]
    lines = [f"{language.comment}{line}" for line in (*header, f"Check: {language.run}")]
    start = language.start
    lines.append(start.format(letters=", ".join(names), names=",".join(names)) if language is PYTHON else start)
    for name, text in language.tools.items():
        if name in used_names:
            lines += ["", text, ""] if language is PYTHON else [text]
    return "\n".join([*lines, *script.lines, language.end]) + "\n"
